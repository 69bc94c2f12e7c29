"""A small pile by either method: its own checks hold, friction makes it steeper, and its weight is carried."""

import numpy as np
import pytest

from barchan.experiments.repose import Repose, build, instruments, results, stages
from barchan.experiments.repose.parameters import Outline
from barchan.experiments.repose.results import shapes_of, time_series
from barchan.experiments.repose.setup import LIFTED, floor_grains, start

#: Softer than the default, so that a pile takes seconds.
SMALL = {
    "grains": 300,
    "youngs_modulus": "8 MPa",
    "restitution": 0.3,
    "cylinder_radius": "20 mm",
    "length": "30 mm",
    "width": "50 mm",
    "floor": "80 mm",
    "lift_speed": "0.2 m/s",
    "dt": "26 us",
    "equilibrate": "0.4 s",
    "duration": "0.4 s",
}


def heap(directory, **changes):
    """A small pile; returns its scene, simulation and results."""
    scene = Repose.make(SMALL | changes)
    sim = build(scene, threads=1)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return scene, sim, results(scene, directory)


@pytest.fixture(scope="module", params=["cylinder", "plate"])
def steep(request, tmp_path_factory):
    """A small pile of rough grains by either method, and its directory."""
    out = tmp_path_factory.mktemp(request.param)
    return *heap(out, method=request.param, friction=0.6), out


def test_a_small_pile_passes_its_checks(steep):
    scene, sim, found, out = steep
    assert [check for check in found.checks if not check.passed] == []
    assert {check.name for check in found.checks} >= {"at rest before the lift", "weight is carried", "at rest at the end"}
    assert time_series(out)["step"][-1] == scene.last_step == sim.step_number
    lifted, way = sim.walls[LIFTED], (scene.lifted_step - scene.lift_step) * scene.dt * scene.lift_speed
    edge = lifted.point[2] - (lifted.radius_high if scene.method == "plate" else 0.0)
    assert edge == pytest.approx(way, rel=1e-9) and not lifted.velocity.any(), "it has come as far as its speed says, and stands"


def test_friction_makes_a_pile_steeper(steep, tmp_path):
    scene, _, _, out = steep
    heap(tmp_path, method=scene.method, friction=0.02)
    flat, rough = (shapes_of(scene, place)[-1].pile.line.angle for place in (tmp_path, out))
    assert 3.0 < flat < rough - 3.0 and rough < 40.0


def test_floor_and_walls_carry_the_weight_before_the_lift_and_a_wall_that_slides_up_carries_more_of_it(steep):
    scene, _, _, out = steep
    series = time_series(out)
    rest = int(np.flatnonzero(series["step"] == scene.lift_step)[0])
    carried = sum(series[f"{name} force [N]"] for name in ("floor", "lifted", "other walls'"))
    assert carried[rest] == pytest.approx(series["weight [N]"][rest], rel=5e-3)
    assert series["lifted force [N]"][rest + 1 : rest + 5].mean() > max(series["lifted force [N]"][rest], 0.0)


@pytest.mark.parametrize("method", ["cylinder", "plate"])
def test_grains_stand_in_their_place_at_the_start_and_overlap_nobody(method):
    scene = Repose.make({"method": method, "grains": 500})
    sim, place, outline = build(scene, threads=1), start(scene), Outline.of(scene)
    assert place.shape == (500, 3)
    if method == "cylinder":
        assert (np.hypot(place[:, 0], place[:, 1]) < scene.cylinder_radius - scene.radius_max).all()
    else:
        assert (place[:, :2] > np.add(outline.low, scene.radius_max)).all()
        assert (place[:, :2] < np.subtract(outline.high, scene.radius_max)).all()
    sim.prepare()
    assert sim.touching == 0
    radius = sim.grains.view("radius")[sim.grains.view("frozen") == 0]
    assert scene.radius_min <= radius.min() and radius.max() <= scene.radius_max
    assert radius.mean() == pytest.approx(0.5 * scene.diameter, rel=0.01)


def test_the_glued_layer_covers_the_floor_of_either_method():
    """One grain on each square of a mean diameter; none where the floor is smooth."""
    for method, area in (("cylinder", np.pi * 0.15**2), ("plate", 0.15 * 0.12)):
        scene = Repose.make({"method": method, "floor": 0.15, "width": 0.12})
        assert len(floor_grains(scene)) == pytest.approx(area / scene.diameter**2, rel=0.02)
        assert len(floor_grains(scene.model_copy(update={"rough_floor": False}))) == 0
