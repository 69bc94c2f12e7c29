"""A small drum: the torque on it carries the slope, its work is what friction and dashpots take, and as much flows down as up."""

import numpy as np
import pytest

from barchan.experiments.drum import Drum, build, instruments, results, stages
from barchan.experiments.drum.results import ENDS, INNER, Tables, layer_of, steady, surface_of, torques

#: Turns fast, so that it takes seconds.
SMALL = {
    "grains": 420,
    "ends": "periodic",
    "drum_radius": "40 mm",
    "length": "36 mm",
    "radius_min": "2.7 mm",
    "radius_max": "3.25 mm",
    "dt": "45 us",
    "rotation": 3.0,
    "equilibrate": "0.2 s",
    "develop": "0.6 s",
    "duration": "1.4 s",
}


def turned(directory, **changes):
    """A small drum that has turned: its scene."""
    scene = Drum.make(SMALL | changes)
    sim = build(scene, threads=1)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return scene


@pytest.fixture(scope="module")
def drum(tmp_path_factory):
    """A small drum that has turned: its scene and directory."""
    out = tmp_path_factory.mktemp("drum")
    return turned(out), out


def test_its_balances_hold(drum):
    """The torque is that of the weight, and the work of the drum is taken by friction and dashpots but for the step's error."""
    checks = {check.name: check for check in results(*drum).checks}
    for name in ("torque carries the slope", "energy", "overlap", "lost grains"):
        assert checks[name].passed, checks[name]


def test_the_weight_is_that_of_a_wedge_at_the_angle_of_the_surface(drum):
    """A round wedge of one density has its centre on the line across its chord: sin(angle) is its place over its distance."""
    scene, out = drum
    tables = Tables.of(out)
    surface = surface_of(tables)
    angle = np.radians(surface.line(scene, steady(scene, surface.steps), ENDS + INNER).angle)
    share = scene.filling / 0.58
    half = next(a for a in np.linspace(0.1, np.pi, 4000) if a - np.sin(a) * np.cos(a) >= np.pi * share)
    centre = 2.0 / 3.0 * scene.drum_radius * np.sin(half) ** 3 / (half - np.sin(half) * np.cos(half))
    mass = scene.filling * np.pi * scene.drum_radius**2 * scene.length * scene.density
    said = mass * scene.gravity * centre * np.sin(angle)
    assert torques(scene, tables.time)[1] == pytest.approx(said, rel=0.12)


def test_a_layer_flows_down_and_the_rest_goes_up_with_the_wall(drum):
    scene, out = drum
    layer = layer_of(scene, Tables.of(out))
    assert 1.5 < layer.thickness / scene.diameter < 5.0 and abs(layer.balance) < 0.15
    wall = scene.rotation * scene.drum_radius
    assert layer.velocity[0] > 0.5 * wall and -1.05 * wall < layer.velocity.min() < -0.5 * wall


def test_colours_mix(drum):
    scene, out = drum
    series = Tables.of(out).time
    index = series["mixing index [1]"][series["step"] > scene.turn_step]
    assert index[:5].max() + 0.1 < index[-1] < 1.0
