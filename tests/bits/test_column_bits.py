"""Columns with all their instruments leave the same files on any number of threads and ranks, and stopped as they collapse."""

import pytest
from staged import files, run

from barchan.experiments.column import COLUMN
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: Few grains in a strong gravity, so that it takes few steps.
SCENE = {
    "columns": 2,
    "aspect_min": 0.8,
    "aspect_max": 1.6,
    "column_radius": "18 mm",
    "gravity": "60 m/s^2",
    "youngs_modulus": "10 MPa",
    "dt": "20 us",
    "equilibrate": "16 ms",
    "duration": "30 ms",
    "table_every": "5 ms",
    "frame_every": "10 ms",
}

#: While fronts run.
STOP = 1333


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(COLUMN, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"), [(2, 1, None), pytest.param(1, 3, None, marks=pytest.mark.validate), (1, 1, STOP)]
)
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    virtual_ranks(ranks, run, COLUMN, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    rows = read_table(tmp_path / "tables" / "columns.csv")
    front, step = rows["front [m]"][rows["column"] == 1], rows["step"][rows["column"] == 1]
    there = front[step < STOP][-1]
    assert 0.018 < there < 0.9 * front[-1], "the stop is within the collapse"
