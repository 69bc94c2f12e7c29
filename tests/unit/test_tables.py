"""Tables: numbers come back with their bits, a new start drops the future, a foreign file is not touched."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import simulation
from written import contents

import barchan as bc
from barchan.errors import OutputError, ResultError
from barchan.writers import Table, read_table

ALWAYS = bc.Every(1)


def at_step(sim, step):
    """The simulation, as if it had come to this step."""
    sim.step_number, sim.time = step, step * sim.dt
    return sim


def test_a_table_round_trips_to_the_bit(tmp_path):
    values = [math.pi, 1e-300, -0.0, 5e-324, 1.7976931348623157e308, float("inf"), float("nan"), 3, np.float64(0.1), np.int32(7)]
    table = Table(tmp_path / "t.csv", ALWAYS, lambda sim: {"value [m]": values[sim.step_number]})
    sim = simulation()
    for step in range(len(values)):
        table.write(at_step(sim, step))
    read = read_table(tmp_path / "t.csv")
    assert list(read) == ["step", "time [s]", "value [m]"]
    assert read["step"].dtype == np.int64 and read["step"].tolist() == list(range(len(values)))
    assert read["value [m]"].tobytes() == np.array(values, dtype=np.float64).tobytes()
    assert read["time [s]"].tobytes() == np.array([step * sim.dt for step in range(len(values))]).tobytes()


def test_a_profile_takes_several_rows_or_none(tmp_path):
    sizes = [0, 2, 0, 3]
    table = Table(tmp_path / "p.csv", ALWAYS, lambda sim: [{"z [m]": k, "v [m/s]": 0.5} for k in range(sizes[sim.step_number])])
    sim = simulation()
    for step in range(4):
        table.write(at_step(sim, step))
    assert read_table(tmp_path / "p.csv")["step"].tolist() == [1, 1, 3, 3, 3]
    assert read_table(tmp_path / "p.csv")["z [m]"].tolist() == [0, 1, 0, 1, 2]


def test_a_new_start_drops_the_present_and_the_future_and_a_cut_row(tmp_path):
    path = tmp_path / "t.csv"

    def table():
        return Table(path, ALWAYS, lambda sim: {"x [m]": 0.5, "y [m]": 2.0})

    sim, whole = simulation(), table()
    for step in (10, 20, 30):
        whole.write(at_step(sim, step))
    upto = path.read_text()
    for step in (40, 50):
        whole.write(at_step(sim, step))
    with open(path, "a") as file:
        file.write("6")
    assert read_table(path)["step"].tolist() == [10, 20, 30, 40, 50], "a row that was cut is not read"
    table().write(at_step(sim, 30))
    assert path.read_text() == upto
    path.write_text(upto + "1")  # cut so that its step looks like one of the past
    table().write(at_step(sim, 40))
    assert read_table(path)["step"].tolist() == [10, 20, 30, 40]


def test_a_foreign_file_is_not_touched(tmp_path):
    path = tmp_path / "t.csv"
    for text in ("", "a,b\n1,2\n", "step,time [s],x\nfive,1,2\n", "step,time [s],y [m]\n", "step,time [s],x", "\xff"):
        path.write_text(text, encoding="latin-1")
        with pytest.raises(OutputError, match=r"t\.csv.*(M|m)ove"):
            Table(path, ALWAYS, lambda sim: {"x": 1.0}).write(at_step(simulation(), 9))
        assert path.read_text(encoding="latin-1") == text


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"x": "fast"}, "x = 'fast' must be a number"),
        ({"x": None}, "x = None must be a number"),
        ({"x,y": 1.0}, "without commas"),
        ({3: 1.0}, "column name 3 must be a text"),
        ({"step": 1.0}, "are put there by the table"),
        ([{"x": 1.0}, {"y": 1.0}], "lacks 'x' and adds 'y'"),
    ],
)
def test_a_row_that_cannot_be_written_is_refused(row, message, tmp_path):
    with pytest.raises(OutputError, match=message):
        Table(tmp_path / "t.csv", ALWAYS, lambda sim: row).write(simulation())
    assert not contents(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("step,time [s],x\n1,0.5,2\n2,0.5\n", "line 3 has 2 values for 3 columns"),
        ("step,time [s],x\n1,0.5,2,9\n", "line 2 has 4 values for 3 columns"),
        ("step,time [s],x\n1,0.5,two\n", "something else than numbers"),
        ("step,time [s],x\n1.5,0.5,2\n", "does not begin with a step"),
        ("step,time [s],x,x\n", "no table of barchan"),
        ("time,x\n1,2\n", "no table of barchan"),
        ("", "no table of barchan"),
    ],
)
def test_a_damaged_table_is_refused(text, message, tmp_path):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ResultError, match=message):
        read_table(tmp_path / "t.csv")


def test_a_table_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ResultError, match="No such file"):
        read_table(tmp_path / "t.csv")
    with pytest.raises(ResultError, match="Is a directory"):
        read_table(tmp_path)


@settings(max_examples=300)
@given(data=st.binary(max_size=60), head=st.sampled_from([b"", b"step,time [s]\n", b"step,time [s],x\n1,2,3\n"]))
def test_any_bytes_are_read_or_refused(data, head, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(head + data)
    try:
        assert {"step", "time [s]"} <= set(read_table(path))
    except ResultError as error:
        assert "any.csv" in str(error)
