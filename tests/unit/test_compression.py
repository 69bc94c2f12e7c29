"""The compression test: what its parameters mean, what is concluded from its tables, and a small one from beginning to end."""

import io

import numpy as np
import pytest

from barchan.errors import SceneError
from barchan.experiments import session
from barchan.experiments.cell import WALLS, Cell
from barchan.experiments.cell.results import errors, load_series
from barchan.experiments.cell.scene import Lattice
from barchan.experiments.compression import COMPRESSION, Compression, build, results
from barchan.experiments.compression.results import loading
from barchan.report import Journal
from barchan.writers import Table

SMALL = {"grains": 250, "width": "10 mm", "height": "9 mm", "gravity": 60, "rain": "50 ms", "seat": "10 ms"}
SMALL |= {"stress_rate": "6 MPa/s"}


def test_the_target_grows_at_the_rate_and_ends():
    scene = Compression.make({"stress_rate": "1 MPa/s", "initial_stress": "10 kPa", "end_stress": "110 kPa", "dt": "1 us"})
    rained, seated, loaded, held = scene.ends
    assert (rained, seated - rained, loaded - seated, held - loaded) == (160_000, 15_000, 100_000, 5_000)
    assert scene.target(rained) == scene.target(seated) == 10e3
    assert scene.target(seated + 50_000) == pytest.approx(60e3) and scene.target(loaded) == scene.target(held + 5) == 110e3


@pytest.mark.parametrize("grains", [1000, 3000, 20_000])
def test_grains_start_clear_of_walls_and_of_each_other(grains):
    scene = Compression.make({"grains": grains, "height": "7.5 mm" if grains < 3000 else "24 mm"})
    sim = build(scene)
    sim.prepare()
    assert sim.touching == 0 and sim.grains.n == Lattice.of(scene).grains == pytest.approx(grains, rel=0.6)
    assert all(wall.contacts == 0 for wall in sim.walls)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius_max": "0.5 mm"}, "radius_max = 0.0005 m is below radius_min"),
        ({"end_stress": "1 kPa"}, "end_stress = 1000 Pa must exceed initial_stress = 5000 Pa"),
        ({"width": "5 mm"}, "must be at least three of the largest diameters"),
        ({"controller": "pid"}, "controller"),
        ({"gain": "3 m/s"}, "gain"),
    ],
)
def test_parameters_that_do_not_fit_together_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        Compression.make(changes)


def made_up(path, scene, noise):
    """Tables of a test in which the walls are off by ``noise``, and the sample shrinks by 1 % on each side."""

    class Sim:
        step_number, time, comm = 0, 0.0, build(scene, with_grains=False).comm

    rained, seated, _, held = scene.ends
    sim, writer = Sim(), Table(path / "tables" / "load.csv", lambda step: True, lambda sim: row(sim.step_number))

    def row(step):
        target, part = scene.target(step), (step - seated) / (held - seated) if step > seated else 0.0
        stresses = {f"stress {name} [Pa]": target * (1.0 + (noise if name == "back" else 0.0)) for name in WALLS}
        sizes = {f"size {axis} [m]": 0.02 * (1.0 - 0.01 * part) for axis in "xyz"}
        others = ("deviatoric stress of grains [Pa]", "void ratio [1]", "coordination", "mechanical coordination", "rattlers")
        others += ("anisotropy of fabric [1]", "sliding contacts [1]", "unbalanced force [1]", "inertial number [1]")
        rest = dict.fromkeys((*others, "largest overlap [1]"), 1e-4) | {"contacts": 10, "grains": 50}
        means = {"mean stress [Pa]": target, "mean stress of grains [Pa]": target * (1.0 + 0.4 * noise)}
        return {"target stress [Pa]": target} | stresses | sizes | means | rest

    for sim.step_number in np.linspace(rained + 1, held, 200).astype(int).tolist():
        writer.write(sim)


@pytest.mark.parametrize(("noise", "follows"), [(0.008, True), (0.012, False), (0.02, False)])
def test_checks_tell_a_wall_that_follows_from_one_that_does_not(noise, follows, tmp_path):
    scene = Compression()
    made_up(tmp_path, scene, noise)
    found = {check.name: check for check in results(scene, tmp_path).checks}
    assert found["walls follow the target"].passed is follows and "back wall" in found["walls follow the target"].measured
    assert found["stress of the grains"].passed is (0.4 * noise <= 0.005)
    assert found["quasi-static"].passed and found["overlap"].passed and found["lost grains"].passed
    load = load_series(scene, tmp_path)
    error = errors(load, loading(scene, load), WALLS)
    assert error[WALLS.index("back")] == pytest.approx(noise) and error[0] == 0.0
    assert load["volumetric strain [1]"][-1] == pytest.approx(-3.0 * np.log(0.99), rel=1e-2)


def test_grains_that_cannot_fill_the_cell_are_refused():
    with pytest.raises(SceneError, match=r"grains = 800 reach a height of at most 0\.0069 m .* height = 0\.024 m is"):
        Compression.make({"grains": 800})


def test_without_a_table_nothing_is_concluded(tmp_path):
    assert ("loading", "not begun yet") in results(Compression(), tmp_path).values


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    out = tmp_path_factory.mktemp("small") / "run"
    scene, told = Compression.make(SMALL), io.StringIO()
    session.start(COMPRESSION, scene, out, session.Manner(2, 10**9), Journal(stream=told))
    return scene, out, told.getvalue()


def test_a_small_sample_follows_its_target_and_carries_it(small):
    """Nine grains at a wall are few, so it may be off by 3 %, and fast; figures are there, the sample is as dense as such are."""
    scene, out, told = small
    checks = {check.name: check for check in results(scene, out).checks}
    assert {name for name, check in checks.items() if not check.passed} <= {"walls follow the target", "quasi-static"}, told
    load = load_series(scene, out)
    assert errors(load, loading(scene, load), WALLS).max() < 0.03
    assert load["mean stress [Pa]"][-1] == pytest.approx(100e3, rel=2e-3)
    assert load["mean stress of grains [Pa]"][-1] == pytest.approx(load["mean stress [Pa]"][-1], rel=5e-3)
    assert 0.5 < load["void ratio [1]"][-1] < 1.0 and load["coordination"][-1] > 4.0
    assert {path.name for path in (out / "figures").iterdir()} == {"stress.png", "strain.png", "structure.png", "sample.png"}
    assert "stress of the grains" in told and "drawing figures" in told


def test_the_cell_names_its_walls():
    sim = build(Compression.make(SMALL))
    cell = Cell.of(sim)
    low, high = cell.corners()
    assert low.tolist() == [0.0, 0.0, 0.0] and high[:2].tolist() == [1e-2, 1e-2]
    assert cell.area(2)(sim) == pytest.approx(1e-4) and cell.area(0)(sim) == pytest.approx(1e-2 * high[2])
    assert [tuple(wall.normal) for wall in cell] == [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
