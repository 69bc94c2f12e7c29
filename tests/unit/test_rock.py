"""The rock: what its parameters mean, what is concluded from tables and cracks, and a small one from beginning to end."""

from math import cos, radians

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from barchan.cli import app
from barchan.errors import SceneError
from barchan.experiments.rock import ROCK, Rock, build, results, stages
from barchan.experiments.rock.block import block, cut, outline
from barchan.experiments.rock.curve import Curve
from barchan.experiments.rock.emission import FEWEST, Events, events, histogram
from barchan.experiments.rock.parameters import FLAT, GRIP, TESTS, WAIST
from barchan.experiments.rock.results import FAILED, area, measured, parts
from barchan.experiments.rock.setup import axis_of, platens
from barchan.laws.parallel_bond import MODES
from barchan.measure import bond_table
from barchan.scene import read_scene_file
from barchan.view.grains import draw_grains

SMALL = {"grains": 200, "dt": "0.17 us", "compression_rate": 20.0, "tension_rate": 5.0, "brazilian_rate": 24.0}
SMALL |= {"duration": "0.4 ms", "table_every": "5 us", "frame_every": "0.1 ms"}


# -- parameters and specimens -----------------------------------------------------------------------------------------


def test_so_many_grains_fill_so_much_of_the_block():
    scene = Rock(grains=2000, solid_fraction=0.5, size_ratio=2.0)
    smallest, largest = scene.radii
    radius = np.linspace(smallest, largest, 100_001)
    filled = 2000 * (4.0 / 3.0 * np.pi * radius**3).mean() / (scene.disc * scene.width * scene.height)
    assert largest == 2.0 * smallest and filled == pytest.approx(0.5, rel=1e-4)


def test_it_ends_after_whole_frames_of_whole_rows():
    scene = Rock.make({"dt": "0.1 us", "table_every": "3 us", "frame_every": "10 us", "duration": "25 us"})
    assert (scene.row_steps, scene.frame_steps, scene.last_step) == (30, 90, 270)
    assert Rock(duration=scene.last_step * scene.dt, dt=scene.dt, table_every=3e-6, frame_every=1e-5).last_step == 270
    assert [(stage.name, stage.end) for stage in stages(scene)] == [("load", 270)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frame_every": "1 us", "table_every": "2 us"}, "must be at least table_every = 2e-06 s"),
        ({"test": "shear"}, "one of 'all', 'compression', 'tension', 'brazilian'"),
        ({"solid_fraction": 0.7}, "solid_fraction"),
    ],
)
def test_parameters_that_cannot_be_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        Rock.make(changes)


def test_specimens_are_cut_as_a_saw_would():
    scene = Rock(grains=800)
    position, radius = block(scene)
    made = {test: cut(scene, test, position, radius) for test in TESTS}
    width, height = scene.width, scene.height
    for test in ("compression", "tension"):
        assert np.abs(made[test].position[:, :2]).max() < 0.5 * width
        assert made[test].ends == pytest.approx((0.0, height), abs=0.1 * scene.radius), "ends are flat"
    shared = np.isin(made["compression"].radius, made["tension"].radius)
    assert len(made["compression"].radius) == pytest.approx(400, abs=30) and not shared.any(), "each from a half of its own"
    x, _, z = made["tension"].position.T
    waist = np.abs(z / height - 0.5) < 0.2
    assert 0.35 * width < np.abs(x[waist]).max() < 0.5 * WAIST * width < np.abs(x[~waist]).max()
    x, _, z = made["brazilian"].position.T
    far = np.hypot(x, z - 0.5 * height)
    assert 0.5 * scene.disc - scene.radius < far.max() < 0.5 * scene.disc == 0.5 * height / cos(radians(FLAT))


def test_the_dumbbell_is_smooth():
    heights = np.linspace(0.0, 1.0, 1001)
    width = outline(heights)
    assert (width[heights < GRIP] == 1.0).all() and outline(0.5) == WAIST == pytest.approx(width.min())
    assert width == pytest.approx(width[::-1]) and np.abs(np.diff(width, 2)).max() < 1e-4


def test_each_test_can_be_made_alone_of_the_same_grains():
    together = build(Rock.make(SMALL), threads=1)
    scene = Rock.make(SMALL | {"test": "brazilian"})
    alone, own = build(scene, threads=1), together.grains.view("specimen") == TESTS.index("brazilian")
    moved = together.grains.view("position")[own] - (axis_of(Rock.make(SMALL), "brazilian"), 0.0, 0.0)
    assert alone.grains.view("position") == pytest.approx(moved)
    assert len(alone.walls) == 2 and len(together.walls) == 4
    places = [[wall.point[2] for wall in sim.walls[-2:]] for sim in (alone, together)]
    assert places[0] == places[1] == pytest.approx([0.0, scene.height], abs=0.1 * scene.radius)


def test_all_grains_begin_to_move_with_the_ends_and_nothing_is_locked_in():
    scene = Rock.make(SMALL)
    sim = build(scene, threads=1)
    stages(scene)[0].begin(sim)
    sim.prepare()
    assert len(bond_table(sim)["first"]) > 300 and (bond_table(sim)["energy"] == 0.0).all()
    assert np.abs(sim.grains.view("force")).max() < 1e-6, "platens touch the outermost grains, up to rounding"
    specimen, speed = sim.grains.view("specimen"), sim.grains.view("velocity")[:, 2]
    height, held = sim.grains.view("position")[:, 2] / scene.height - 0.5, sim.grains.view("frozen") == 1
    for number, test in enumerate(TESTS):
        own, ends = (specimen == number) & ~held, scene.rate(test) * scene.height * (1.0 if test == "tension" else -1.0)
        assert speed[own] == pytest.approx(ends * height[own])
        if test != "tension":
            assert [platen.velocity[2] for platen in platens(sim, scene, test)] == pytest.approx([-0.5 * ends, 0.5 * ends])
    pulled = scene.tension_rate * scene.height
    assert (np.abs(height[held]) > 0.5 - GRIP).all() and (specimen[held] == 1).all() and held.sum() > 10
    assert speed[held] == pytest.approx(np.copysign(0.5 * pulled, height[held]))


# -- curves -----------------------------------------------------------------------------------------------------------


def made_up(test, scene, strength=30e6, modulus=10e9, poisson=0.25, left=0.1, apart=0.01):
    """Columns of a test that rises to a strength in 100 rows and falls to a part of it in 50; its middle is strained as its
    modulus and Poisson's ratio say, and whose ends have forces that differ by a part of the strength."""
    rise = np.concatenate([np.linspace(0.0, 1.0, 100), np.linspace(1.0, left, 51)[1:]])
    sense, stress = (1.0 if test == "tension" else -1.0), strength * rise
    force, more = stress * area(scene, test), 0.5 * apart * strength * area(scene, test)
    strain = sense * stress / modulus
    counts = np.arange(150.0)
    return {
        "step": np.linspace(1, scene.last_step, 150).astype(int),
        "displacement [m]": np.linspace(0.0, 1e-3, 150),
        "force bottom [N]": force - more,
        "force top [N]": force + more,
        "axial strain [1]": strain,
        "strain along x [1]": -poisson * strain + 1e-5,
        "strain along y [1]": -poisson * strain - 1e-5,
        "bonds": 1000.0 - counts,
        **{f"cracks in {mode}": counts if mode == "tension" else 0.0 * counts for mode in MODES},
        "grains": np.full(150, 50.0),
    }


@pytest.mark.parametrize("test", TESTS)
def test_a_curve_tells_strength_modulus_and_poissons_ratio(test):
    scene = Rock()
    curve = Curve.of(made_up(test, scene, apart=0.02, left=0.3), test, area(scene, test))
    assert curve.strength == pytest.approx(30e6) and curve.peak == 99
    assert curve.modulus == pytest.approx(10e9) and curve.poisson == pytest.approx(0.25)
    assert curve.imbalance == pytest.approx(0.02) and curve.residual == pytest.approx(0.3)


def test_the_secant_leaves_out_how_the_platens_meet_the_grains():
    """A toe below a tenth of the strength, and a bend above the half, change nothing."""
    stress = np.concatenate([np.zeros(20), np.linspace(0.0, 1.0, 201)])
    strain = np.concatenate([np.linspace(-5.0, 0.0, 20), np.interp(stress[20:], (0.0, 0.1, 0.5, 1.0), (0.0, 1.0, 3.0, 9.0))])
    zero = np.zeros(len(stress))
    curve = Curve(zero, zero, stress, zero, strain, 0.3 * strain)
    assert curve.modulus == pytest.approx(0.4 / 2.0) and curve.poisson == pytest.approx(0.3)


def test_the_area_gives_the_brazilian_formula():
    scene = Rock(height=0.1)
    force, diameter, thickness = 1000.0, 0.1 / cos(radians(FLAT)), 0.05
    assert force / area(scene, "brazilian") == pytest.approx(2.0 * force / (np.pi * diameter * thickness))
    assert area(scene, "compression") == pytest.approx(25e-4) and area(scene, "tension") == pytest.approx(16e-4)


# -- acoustic emission ------------------------------------------------------------------------------------------------


def test_breaks_that_are_near_and_soon_make_one_event():
    """Two that are linked by a third between them; one at the same place later; one at the same time elsewhere."""
    time = np.array([0.0, 0.0, 0.8, 1.6, 9.0])
    place = np.array([[0.0, 0, 0], [50.0, 0, 0], [0.0, 0.9, 0], [0.0, 1.8, 0], [0.0, 0, 0]])
    found = events(time, place, np.array([1.0, 2.0, 3.0, 4.0, 5.0]), near=1.0, soon=1.0)
    assert found.time.tolist() == [0.0, 0.0, 9.0] and found.breaks.tolist() == [3, 1, 1]
    assert found.energy.tolist() == [8.0, 2.0, 5.0] and found.magnitude == pytest.approx(np.log10([8.0, 2.0, 5.0]))
    nothing = events(np.zeros(0), np.zeros((0, 3)), np.zeros(0), 1.0, 1.0)
    assert len(nothing.time) == 0 and np.isnan(nothing.slope).all()


def test_the_slope_is_that_of_a_power_law_and_needs_enough_events():
    drawn = np.random.default_rng(4).exponential(1.0 / (0.8 * np.log(10.0)), 20_000)
    b, error = Events(np.arange(20_000), np.ones(20_000), 10.0**drawn).slope
    assert b == pytest.approx(0.8, abs=4.0 * error) and 0.004 < error < 0.008
    few = FEWEST - 1
    assert np.isnan(Events(np.arange(few), np.ones(few), 10.0 ** drawn[:few]).slope).all()


def test_bins_of_the_histogram_hold_all():
    counts, edges = histogram(np.array([-3.0, -2.99, -2.76, -2.0]))
    assert counts.tolist() == [3, 0, 0, 0, 1] and edges == pytest.approx(np.arange(-3.0, -1.7, 0.25))


# -- checks -----------------------------------------------------------------------------------------------------------


def write(path, columns):
    """A table as ``Table`` leaves it."""
    path.parent.mkdir(exist_ok=True)
    columns = {"step": columns["step"], "time [s]": 0.0 * columns["step"]} | {k: v for k, v in columns.items() if k != "step"}
    lines = [",".join(columns), *(",".join(repr(value.item()) for value in row) for row in zip(*columns.values()))]
    path.write_text("\n".join(lines) + "\n")


def write_run(directory, scene, energy=1e-6, lost=0.0, **changes):
    """Tables of a sound run, strengths 30, 5 and 6 MPa, but for ``changes``: test -> keywords of ``made_up``."""
    strengths = {"compression": 30e6, "tension": 5e6, "brazilian": 6e6}
    for test in scene.tests:
        columns = made_up(test, scene, **({"strength": strengths[test]} | changes.get(test, {})))
        columns["bonds"][-1] -= lost
        columns["grains"][-1] -= lost
        write(directory / "tables" / f"{test}.csv", columns)
    count = 149
    step = np.arange(1, count + 1)
    cracks = {"step": step, "test": np.zeros(count, int), "crack step": step, "mode": np.ones(count, int)}
    cracks |= {f"{name} [m]": np.zeros(count) for name in "xyz"} | {f"n{name} [1]": np.zeros(count) for name in "xyz"}
    write(directory / "tables" / "cracks.csv", cracks | {"energy [J]": np.full(count, energy)})


def failed(scene, directory):
    return {check.name for check in results(scene, directory).checks if not check.passed}


def test_a_sound_run_passes_and_tells_all(tmp_path):
    write_run(tmp_path, scene := Rock())
    said = dict(results(scene, tmp_path).values)
    assert failed(scene, tmp_path) == set()
    assert said["compression: unconfined compressive strength"].startswith("30 MPa, at 0.300 % strain")
    assert said["tension: direct tensile strength"].startswith("5 MPa, at 0.050 % strain")
    assert said["brazilian: Brazilian strength 2P/(pi D t)"].startswith("6 MPa")
    assert said["compression: cracks"] == "149 (149 in tension), 149 of them before the peak"
    assert said["tension: Poisson's ratio"].startswith("0.250") and "10 GPa" in said["tension: Young's modulus"]
    assert measured(scene, tmp_path)["compression"].events.energy.sum() == pytest.approx(149e-6)


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"compression": {"left": FAILED + 0.01}}, {"compression: failed"}),
        ({"tension": {"apart": 0.05}}, {"tension: quasi-static"}),
        ({"compression": {"strength": 10e6}}, {"compression over tension"}),
        ({"brazilian": {"strength": 3e6}}, {"Brazilian over direct tension"}),
        ({"energy": 0.0}, {"compression: energy of each crack"}),
        ({"lost": 1.0}, {f"{test}: {name}" for test in TESTS for name in ("cracks are the bonds lost", "lost grains")}),
    ],
)
def test_checks_tell_what_is_wrong(changes, names, tmp_path):
    write_run(tmp_path, scene := Rock(), **changes)
    assert failed(scene, tmp_path) == names


def test_a_run_that_was_stopped_says_nothing_of_failure(tmp_path):
    write_run(tmp_path, Rock())
    assert not any("failed" in check.name for check in results(Rock(duration=5e-3), tmp_path).checks)
    assert results(Rock(), tmp_path / "none").values[-1] == ("loading", "not begun yet")


def test_each_grain_of_a_picture_keeps_its_colour():
    """Far ones are drawn first."""
    place, colours = np.array([[0.0, 0.0, 0.0], [1.0, 5.0, 0.0]]), np.array(["#FF0000", "#0000FF"])
    discs = draw_grains(Figure().subplots(), place, np.full(2, 0.1), colours, None)
    assert discs.get_offsets()[:, 0].tolist() == [1000.0, 0.0] and discs.get_facecolor()[:, 2].tolist() == [1.0, 0.0]


# -- a small one ------------------------------------------------------------------------------------------------------


def test_a_small_rock_breaks_in_all_three_tests(tmp_path):
    out = tmp_path / "run"
    words = [word for name, value in SMALL.items() for word in ("--set", f"{name}={value}")]
    done = CliRunner().invoke(app, ["run", "rock", *words, "--threads", "1", "--out", str(out)])
    assert done.exception is None, done.exception
    scene = read_scene_file(out / "scene.toml", {"rock": ROCK.scene})[1]
    may = {"compression: quasi-static", "tension: quasi-static", "brazilian: quasi-static", "Brazilian over direct tension"}
    assert failed(scene, out) <= may, "so few grains are loaded fast"
    found, broken = measured(scene, out), parts(scene, out)
    for test in TESTS:
        curve = found[test].curve
        assert 3e6 < curve.strength < 100e6 and 0.2 < curve.displacement[curve.peak] / curve.displacement[-1] < 0.95
        assert len(broken[test].number) > 1 and broken[test].mass.sum() == pytest.approx(1.0)
        assert found[test].events.breaks.sum() == len(found[test].cracks["mode"]) > 20
    assert 5e9 < found["compression"].curve.modulus < 25e9 and 0.0 < found["compression"].curve.poisson < 0.4
    names = {f"{test}.png" for test in TESTS} | {"stress.png", "strain.png", "emission.png", "fragments.png"}
    assert {path.name for path in (out / "figures").iterdir()} == names
