"""What the summary of an avalanche says follows from its tables, and each of its checks can fail."""

import numpy as np
import pytest

from barchan import record
from barchan.experiments.avalanche import Avalanche
from barchan.experiments.avalanche.figures import figures
from barchan.experiments.avalanche.parameters import Outline
from barchan.experiments.avalanche.results import arrival, front_speed, results, time_series

SCENE = Avalanche.make({"coarse_graining": 10.0, "equilibrate": 0.1, "duration": 0.4})
GRAINS = Outline.of(SCENE).flowing
LAYERS = [f"moving layer {name} [m]" for name in ("upstream", "right wall", "downstream")]


def table(**changes):
    """A run of 0.5 s, a row every 10 ms: the front runs at 2 m/s from the release on, energy turns from potential to heat."""
    since = 0.01 * np.arange(-9, 41)
    flow = np.maximum(since, 0.0)
    columns = {
        "since release [s]": since,
        "front [m]": 2.0 * flow,
        "99 % of grains [m]": 1.5 * flow,
        "foremost grain [m]": 2.5 * flow,
        **{name: 0.05 + 0.0 * flow for name in LAYERS},
        "kinetic energy [J]": flow,
        "rotational energy [J]": 0.1 * flow,
        "potential energy [J]": 5.0 - 2.0 * flow,
        "elastic energy [J]": 1e-3 + 0.0 * flow,
        "dissipated energy [J]": 0.9 * flow,
        "jet height [m]": 0.1 * (since > 0.3),
        "jet volume [m^3]": 1e-6 * (since > 0.3),
        "jet speed [m/s]": 1.0 * (since > 0.3),
        "contacts": 1000.0 + 0.0 * flow,
        "coordination": 4.0 + 0.0 * flow,
        "largest overlap [1]": 0.01 + 0.0 * flow,
        "grains": GRAINS - 3.0 * (since > 0.35),
        "left through outlets": 3.0 * (since > 0.35),
    }
    return columns | {name: changes[name](since) for name in changes}


def put(directory, columns, **account):
    """Write a table, and a record, as a run does."""
    (directory / "tables").mkdir()
    names = ["step", "time [s]", *columns]
    rows = zip(np.arange(1, 51) * 100, 0.01 * np.arange(1, 51), *columns.values())
    lines = [",".join(names), *(",".join([str(row[0]), *(repr(float(value)) for value in row[1:])]) for row in rows)]
    (directory / "tables" / "time.csv").write_text("\n".join(lines) + "\n")
    plain = {"threads": 1, "first_step": 0, "last_step": 5000, "seconds": 1.0, "stages": {}, "work": {}, "rebuilds": 0}
    plain |= {"steps_between_rebuilds": 0, "stable_dt": 1e-4}
    record.add(directory / "record.json", record.Account(**plain | account))


def failed(directory):
    return [check.name for check in results(SCENE, directory).checks if not check.passed]


def test_speed_of_the_front_and_its_arrival():
    flow = {name: column[9:] for name, column in table().items()}
    assert front_speed(flow)[3:-3] == pytest.approx(2.0)
    outline = Outline.of(SCENE)
    way = (outline.floor - outline.length) * outline.edge - 2.0 * SCENE.simulated.radius_max
    assert arrival(SCENE, flow) == pytest.approx(way / 2.0, abs=0.01)
    flow["front [m]"] = 0.5 * flow["front [m]"]
    assert arrival(SCENE, flow) is None


def test_the_values_are_those_of_the_table(tmp_path):
    put(tmp_path, table())
    found = results(SCENE, tmp_path)
    values = dict(found.values)
    assert "at 800 mm" in values["front"] and "fastest 2.00 m/s" in values["front"]
    assert "50 mm at x = " in values["moving layer"] and "(0.30 s" in values["moving layer"]
    assert "first grain at the end wall at 0.310 s; highest 100 mm" in values["jet"]
    assert "0.78 J released, 0.351 J dissipated; 0.44 J in motion at the end" in values["energy"]
    assert failed(tmp_path) == []


def test_every_value_that_is_not_the_paper_s_is_listed(tmp_path):
    put(tmp_path, table())
    rows = {name: (here, paper) for name, here, paper in results(SCENE, tmp_path).differs}
    assert set(rows) == {
        "grains", "radius_min", "radius_max", "width", "kn", "kt", "gamma_n", "gamma_t", "dt", "equilibrate", "duration", "floor"
    }  # fmt: skip
    assert rows["radius_max"] == ("11.2 mm", "1.12 mm")
    (tmp_path / "b").mkdir()
    put(tmp_path / "b", table())
    other = Avalanche.make({"coarse_graining": 1.0, "angle": 30.0, "equilibrate": 0.4, "duration": 1.2})
    rows = {name: (here, paper) for name, here, paper in results(other, tmp_path / "b").differs}
    assert rows["angle"] == ("30 deg", "31.2 deg") and "kn" not in rows


@pytest.mark.parametrize(
    ("name", "changes", "account"),
    [
        ("at rest before the release", {"kinetic energy [J]": lambda t: 1.0 + t}, {}),
        ("time step", {}, {"stable_dt": 1e-6}),
        ("overlap", {}, {"large_overlaps": 10_000}),
        ("energy never grows", {"dissipated energy [J]": lambda t: 0.9 * np.abs(t - 0.2)}, {}),
        ("lost grains", {"grains": lambda t: GRAINS - 4.0 * (t > 0.35)}, {}),
    ],
)
def test_a_check_fails_when_it_should(tmp_path, name, changes, account):
    put(tmp_path, table(**changes), **account)
    assert failed(tmp_path) == [name]


def test_tangential_springs_may_give_back_what_they_held_at_the_time_and_no_more(tmp_path):
    """5/4 mu^2 k_n/k_t = 4.37 times 1e-3 J of normal springs; what they held earlier does not count."""
    back = {"dissipated energy [J]": lambda t: 0.9 * np.maximum(t, 0.0) - 4.0e-3 * (t > 0.395)}
    flat = {"dissipated energy [J]": lambda t: 0.02 * (t > 0.1) - 6.0e-3 * (t > 0.3)}
    emptied = {"elastic energy [J]": lambda t: 1e-3 + 0.1 * (t < 0.15)}
    for name, changes, fails in (
        ("a", back, []),
        ("b", flat, ["energy never grows"]),
        ("c", flat | emptied, ["energy never grows"]),
    ):
        (tmp_path / name).mkdir()
        put(tmp_path / name, table(**changes))
        assert failed(tmp_path / name) == fails


def test_a_run_stopped_before_the_release_has_not_come_to_rest_yet(tmp_path):
    put(tmp_path, table(**{"since release [s]": lambda t: t - 1.0, "kinetic energy [J]": lambda t: 9.0 + 0.0 * t}))
    assert "at rest before the release" not in [check.name for check in results(SCENE, tmp_path).checks]
    assert dict(results(SCENE, tmp_path).values)["flow"] == "the table has no row after the release yet"


def test_a_run_that_has_not_got_anywhere_is_told_so(tmp_path):
    assert results(SCENE, tmp_path).checks == [] and time_series(tmp_path) is None
    assert "shorter" in results(SCENE, tmp_path).values[0][1]
    assert list(figures(SCENE, tmp_path)) == []
