"""What is read from the tables of a drum, from surfaces and flows that are known; the mixing index by its closed forms."""

import numpy as np
import pytest

from barchan.errors import SceneError
from barchan.experiments.drum import Drum
from barchan.experiments.drum.mixing import lacey
from barchan.experiments.drum.results import ENDS, INNER, Tables, layer_of, steady, surface_of, torques
from barchan.experiments.drum.setup import start
from barchan.experiments.repose.surface import PARTS

SCENE = Drum(duration=1.0, develop=0.5)
STEPS = SCENE.turn_step + SCENE.frame_steps * np.arange(11)


def table(**columns):
    """A table with the rows of each frame one below the other."""
    rows = len(next(iter(columns.values())))
    return {"step": np.repeat(STEPS, rows)} | {name: np.tile(column, len(STEPS)) for name, column in columns.items()}


def test_colours_apart_have_the_index_0_and_grains_at_random_1():
    assert lacey([10, 0, 7], [10, 20, 7]) == pytest.approx(0.0, abs=1e-12)
    random = np.random.default_rng(3)
    grains = random.integers(5, 30, 4000)
    assert lacey(random.binomial(grains, 0.4), grains) == pytest.approx(1.0, abs=0.01)


def test_half_of_the_colours_exchanged_at_random_have_the_index_three_quarters():
    """Shares 3/4 and 1/4 instead of 1 and 0 leave a quarter of the variance, but for chance."""
    grains = np.full(6000, 40)
    coloured = np.random.default_rng(4).binomial(grains, np.repeat([0.75, 0.25], 3000))
    assert lacey(coloured, grains) == pytest.approx(0.75, abs=0.01)


def test_cells_without_grains_count_nothing_and_one_colour_has_no_index():
    assert lacey([3, 0, 1, 0], [4, 0, 4, 0]) == lacey([3, 1], [4, 4])
    assert np.isnan(lacey([4, 4], [4, 4]))


def test_angles_of_known_surfaces_are_found_in_the_strips_they_belong_to():
    x = np.linspace(-SCENE.drum_radius, SCENE.drum_radius, 24)
    part = np.repeat(np.arange(PARTS), 24)
    degrees = np.where(np.isin(part, ENDS), 30.0, 24.0)
    height = SCENE.drum_radius - np.tile(x, PARTS) * np.tan(np.radians(degrees))
    columns = {"part": part, "x [m]": np.tile(x, PARTS), "height [m]": height, "points": np.full(len(part), 5)}
    surface = surface_of(Tables(None, table(**columns), None, None))
    late = steady(SCENE, surface.steps)
    assert late.sum() == 6
    assert surface.line(SCENE, late, ENDS).angle == pytest.approx(30.0)
    assert surface.line(SCENE, late, INNER).angle == pytest.approx(24.0)


def test_the_layer_ends_where_nothing_flows():
    depth = np.linspace(0.5e-3, 39.5e-3, 40)
    velocity = np.where(depth < 16e-3, 0.2 * (1.0 - depth / 15e-3), -0.1)
    mass = np.where(depth < 30e-3, 2e-3, 0.0)
    columns = {"depth [m]": depth, "mass [kg]": mass, "momentum [kg m/s]": mass * velocity}
    found = layer_of(SCENE, Tables(None, None, table(**columns), None))
    assert found.thickness == pytest.approx(15e-3, rel=1e-9)
    assert found.depth == pytest.approx(depth[:30]) and found.velocity == pytest.approx(velocity[:30])
    down, up = velocity[:15].sum(), -velocity[15:30].sum()
    assert found.balance == pytest.approx((down - up) / (down + up), rel=1e-9)


def test_torques_are_means_of_the_steady_flow_only():
    series = {"step": STEPS, "torque [N m]": np.where(STEPS < SCENE.steady_step, 5.0, -2.0)}
    series["torque of the weight [N m]"] = series["torque [N m]"] / 2.0
    assert torques(SCENE, series) == (2.0, 1.0)


@pytest.mark.parametrize("ends", ["plates", "periodic"])
def test_grains_start_inside_and_apart(ends):
    scene = Drum(ends=ends, grains=400, drum_radius=0.04, length=0.06)
    place, radius = start(scene), scene.radius_max
    assert (np.hypot(place[:, 0], place[:, 2] - 0.04) <= 0.04 - radius).all()
    gap = place[:, None] - place
    if ends == "periodic":
        gap[..., 1] -= scene.length * np.round(gap[..., 1] / scene.length)
    else:
        assert place[:, 1].min() >= radius and place[:, 1].max() <= scene.length - radius
    apart = np.sqrt((gap**2).sum(axis=-1)) + np.where(np.eye(400), np.inf, 0.0)
    assert apart.min() >= 2.0 * radius


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"radius_max": 0.001}, r"radius_max = 0\.001 m is below"),
        ({"length": "10 mm"}, r"length = 0\.01 m has no room for a flow"),
        ({"drum_radius": "10 mm"}, r"drum_radius = 0\.01 m has no room"),
        ({"duration": "1 s"}, r"develop = 1\.5 s leaves nothing to measure of duration = 1 s"),
        ({"ends": "open"}, "ends = 'open'"),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(SceneError, match=words):
        Drum.make(given)


def test_more_grains_than_the_drum_holds_are_refused_with_the_number_that_fits():
    with pytest.raises(SceneError, match=r"grains = 20000 do not fit into a drum .*: \d+ do"):
        start(Drum(grains=20_000))
