"""The angle of repose: a surface of known angle gives that angle, and each check of the summary can fail."""

import numpy as np
import pytest

import barchan as bc
from barchan import record
from barchan.errors import SceneError
from barchan.experiments.repose import Repose
from barchan.experiments.repose.figures import figures
from barchan.experiments.repose.results import results, shapes_of
from barchan.experiments.repose.slope import foot, pile, straight
from barchan.experiments.repose.surface import LINES, PARTS, binned, profile, scan

SCENE = Repose.make({"equilibrate": 0.1, "duration": 0.2, "floor": 0.2})
TOP = 0.05


def cone(angle, x, y):
    """Height of a cone with ``TOP`` [m] and an angle [deg]."""
    return np.maximum(TOP - np.tan(np.radians(angle)) * np.hypot(x, y), 0.0)


def lines_of_sight(scene):
    spacing = scene.diameter / LINES
    along = spacing * (np.arange(round(2.0 * scene.floor / spacing)) + 0.5) - scene.floor
    return [axis.ravel() for axis in np.meshgrid(along, along, indexing="ij")]


def cone_profile(angle, scene=SCENE):
    """Profile of a cone whose angle grows by half a degree from sector to sector, ``angle`` in the mean."""
    x, y = lines_of_sight(scene)
    turn = np.arctan2(y, x) / (2.0 * np.pi) + 0.5
    sector = np.minimum((turn * PARTS).astype(int), PARTS - 1)
    height = cone(angle + 0.5 * (sector - 0.5 * (PARTS - 1)), x, y)
    return binned(np.hypot(x, y), turn, height, scene.diameter, int(scene.floor / scene.diameter))


def put(directory, angle=25.0, stop=None, **changes):
    """Tables and record of a run at whose end a cone stands; the last row of the table is changed."""
    (directory / "tables").mkdir()
    surface = cone_profile(angle)
    rows = [
        f"{SCENE.last_step},{SCENE.last_step * SCENE.dt!r},{part},{float(x)!r},{float(surface.height[part, k])!r},"
        f"{int(surface.points[part, k])}"
        for part in range(PARTS)
        for k, x in enumerate(surface.distance)
    ]
    head = "step,time [s],part,distance [m],height [m],points"
    (directory / "tables" / "profiles.csv").write_text("\n".join([head, *rows]) + "\n")
    last = {
        "angle [deg]": angle,
        "height [m]": TOP,
        "run-out [m]": 0.1,
        "kinetic energy [J]": 1e-9,
        "unbalanced force [1]": 1e-3,
        "weight [N]": 4.9,
        "floor force [N]": 4.9,
        "lifted force [N]": 0.0,
        "other walls' force [N]": 0.0,
        "lifted contacts": 0,
        "contacts": 7000,
        "coordination": 4.5,
        "largest overlap [1]": 0.01,
        "grains": SCENE.grains - 2,
        "left over the edge": 2,
    }
    steps = range(SCENE.lift_step % SCENE.row_steps, (stop or SCENE.last_step) + 1, SCENE.row_steps)
    lines = [",".join(["step", "time [s]", "since lift [s]", *last])]
    for step in steps:
        row = last | (changes if step == steps[-1] else {})
        lines.append(",".join(map(repr, [step, step * SCENE.dt, (step - SCENE.lift_step) * SCENE.dt, *row.values()])))
    (directory / "tables" / "time.csv").write_text("\n".join(lines) + "\n")
    record.add(directory / "record.json", record.Account(**ACCOUNT))


ACCOUNT = {"threads": 1, "first_step": 0, "last_step": 5000, "seconds": 1.0, "stages": {}, "work": {}, "rebuilds": 0}
ACCOUNT |= {"steps_between_rebuilds": 0, "stable_dt": 1e-4}


def failed(directory, scene=SCENE):
    return [check.name for check in results(scene, directory).checks if not check.passed]


# -- the line ----------------------------------------------------------------------------------------------------------


def test_a_straight_line_and_its_error():
    """y = 3 - x/2 with errors +e, -e, -e, +e at 0, 1, 2, 3: the slope stays, and s^2 = 4 e^2/2 over 5 is its variance."""
    x = np.arange(4.0)
    line = straight(x, 3.0 - 0.5 * x + 0.01 * np.array([1.0, -1.0, -1.0, 1.0]))
    assert (line.slope, line.origin) == (pytest.approx(-0.5), pytest.approx(3.0))
    assert line.error == pytest.approx(0.01 * np.sqrt(2.0 / 5.0))
    assert line.angle == pytest.approx(np.degrees(np.arctan(0.5)))
    assert line.angle_error == pytest.approx(np.degrees(line.error) / 1.25)
    assert np.isnan(straight(x[:1], x[:1]).slope) and np.isnan(straight(x[:2], x[:2]).error)


def test_the_foot_is_where_the_surface_falls_below_a_height_beyond_its_top():
    x = np.arange(6.0)
    assert foot(x, np.array([1.0, 5.0, 4.0, 2.0, 0.0, 3.0]), 1.0) == pytest.approx(3.5), "what lies before and beyond is left out"
    assert foot(x, np.full(6, 2.0), 1.0) == 5.0
    assert foot(x, np.full(6, 0.5), 1.0) == 0.0


@pytest.mark.parametrize("angle", [15.0, 25.0, 35.0])
def test_a_cone_of_known_angle_gives_that_angle(angle):
    x, y = lines_of_sight(SCENE)
    surface = binned(np.hypot(x, y), np.zeros(len(x)), cone(angle, x, y), SCENE.diameter, int(SCENE.floor / SCENE.diameter))
    found = pile(surface.distance, surface.mean, SCENE.diameter)
    assert found.line.angle == pytest.approx(angle, abs=0.01) and found.line.angle_error < 0.01
    assert found.run_out == pytest.approx((TOP - SCENE.diameter) / np.tan(np.radians(angle)), rel=0.01)
    assert found.height == pytest.approx(TOP, abs=SCENE.diameter * np.tan(np.radians(angle)))


# -- the scan ----------------------------------------------------------------------------------------------------------


def scene_of(position, radius, **more):
    sim = bc.Simulation(bc.Box((-1, -1, -1), (1, 1, 1)), bc.laws.linear, bc.Material("m", 1.0, kn=1.0, kt=1.0, friction=0.5), 1.0)
    sim.add_grains(position, radius, **more)
    return sim


def test_a_scan_sees_the_highest_surface_and_no_frozen_grain():
    sim = scene_of([[0.0, 0.0, 0.1], [0.05, 0.0, 0.1], [0.05, 0.05, 0.3]], 0.05, frozen=[False, False, True])
    x, y, height = scan(sim, (-0.2, -0.1), (0.2, 0.1), 0.01)
    assert height.shape == (len(x), len(y)) == (40, 20)
    one, other = (0.05**2 - (x[:, None] - place) ** 2 - y**2 for place in (0.0, 0.05))
    wanted = 0.1 + np.sqrt(np.maximum(np.maximum(one, other), 0.0))
    assert np.array_equal(height > 0.0, (one > 0.0) | (other > 0.0))
    assert height[height > 0.0] == pytest.approx(wanted[height > 0.0], rel=1e-12)


@pytest.mark.parametrize("method", ["cylinder", "plate"])
def test_grains_heaped_up_at_an_angle_show_it(method):
    """Grains side by side whose tops lie on a plane or cone of 25 degrees."""
    scene = Repose.make({"method": method, "radius_min": 1e-3, "radius_max": 1e-3})
    grid = 1e-3 * np.arange(-110, 111)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid, indexing="ij"))
    height = cone(25.0, x, y) if method == "cylinder" else cone(25.0, x, 0.0)
    chosen = (height > 0.0) if method == "cylinder" else (height > 0.0) & (x > 0.0) & (np.abs(y) < 0.5 * scene.width)
    surface = profile(scene_of(np.column_stack([x, y, height])[chosen], 1e-3), scene)
    assert pile(surface.distance, surface.mean, scene.diameter).line.angle == pytest.approx(25.0, abs=0.1)
    assert (surface.points > 0).all()


# -- the summary -------------------------------------------------------------------------------------------------------


def test_the_values_are_those_of_the_last_profile(tmp_path):
    put(tmp_path)
    values = dict(results(SCENE, tmp_path).values)
    (shape,) = shapes_of(SCENE, tmp_path)
    assert shape.parts == pytest.approx(25.0 + 0.5 * (np.arange(PARTS) - 3.5), abs=0.02)
    assert shape.scatter == pytest.approx(0.5 * np.sqrt(6.0 / PARTS), abs=0.01)
    assert f"{shape.pile.line.angle:.2f} deg" in values["angle of repose"] and "from 8 sectors" in values["angle of repose"]
    assert shape.pile.line.angle == pytest.approx(25.0, abs=0.1)
    assert values["from height and run-out"] == f"{shape.pile.plain_angle:.2f} deg"
    assert failed(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("at rest at the end", {"kinetic energy [J]": 1e-3}),
        ("balanced at the end", {"unbalanced force [1]": 0.1}),
        ("weight is carried", {"floor force [N]": 4.87}),
        ("weight is carried", {"other walls' force [N]": 0.03}),
        ("cylinder is clear of grains", {"lifted contacts": 1}),
        ("overlap", {"largest overlap [1]": 0.021}),
        ("lost grains", {"grains": SCENE.grains - 3}),
    ],
)
def test_a_check_fails_when_it_should(tmp_path, name, changes):
    put(tmp_path, **changes)
    assert failed(tmp_path) == [name]


def test_the_time_step_is_compared_with_the_stable_one(tmp_path):
    put(tmp_path)
    record.add(tmp_path / "record.json", record.Account(**ACCOUNT | {"stable_dt": 2e-4}))
    assert failed(tmp_path) == []
    assert failed(tmp_path, SCENE.model_copy(update={"dt": 3e-4, "duration": 0.0})) == ["time step"]


def test_grains_that_move_when_the_lift_begins_are_told(tmp_path):
    put(tmp_path, stop=SCENE.lift_step, **{"kinetic energy [J]": 1e-3})
    assert failed(tmp_path) == ["at rest before the lift"]
    assert dict(results(SCENE, tmp_path).values)["angle"] == "none yet: the pile is not finished"


def test_a_run_that_has_not_got_anywhere_is_told_so(tmp_path):
    assert results(SCENE, tmp_path).checks == [] and "shorter" in results(SCENE, tmp_path).values[0][1]
    assert list(figures(SCENE, tmp_path)) == []


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"radius_min": 3e-3}, "radius_max = 0.0028 m is below radius_min"),
        ({"cylinder_radius": "5 mm"}, "cylinder_radius = 0.005 m has no room"),
        ({"method": "plate", "width": "5 mm"}, "width = 0.005 m has no room"),
        ({"floor": "41 mm"}, "floor = 0.041 m must exceed cylinder_radius"),
        ({"method": "sieve"}, "one of 'cylinder', 'plate'"),
    ],
)
def test_what_does_not_fit_together_is_refused(changes, says):
    with pytest.raises(SceneError, match=says):
        Repose.make(changes)
