"""Front, profile and jet of flows whose answer is known in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import NOTHING, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.measure import Front, Jet, Profile
from barchan.measure.sphere_cuts import bar_volume, cap_volume, corner_volume
from barchan.measure.sums import Bins, exact_sums, quantile
from barchan.parallel import Serial, virtual_ranks

pytestmark = pytest.mark.nojit

SPHERE = 4.0 / 3.0 * math.pi


def block(cells, low=(0.5, 0.5, 0.5), spacing=1.0):
    """Points of a simple cubic lattice, (k, 3)."""
    grid = np.stack(np.meshgrid(*(np.arange(c) for c in cells), indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(low) + spacing * grid


def flow(points, radius=0.4, periodic_x=False, length=20.0, **values):
    """Grains in a box 4 wide and 20 high, periodic along y."""
    sim = simulation(bc.Box((0, 0, -2), (length, 4, 18), (periodic_x, True, False)), properties=NOTHING)
    if len(points):
        sim.add_grains(points, radius, **values)
    return sim


# -- sums ------------------------------------------------------------------------------------------------------------------


def test_sums_by_bin_are_exact():
    index = np.array([2, 0, 2, 2])
    sums = exact_sums((np.array([1e100, 3.0, 1.0, -1e100]), np.array([1.0, np.nan, 2.0, 3.0])), Serial(), index, 4)
    assert sums[0].tolist() == [3.0, 0.0, 1.0, 0.0]
    assert math.isnan(sums[1, 0]) and sums[1, 1:].tolist() == [0.0, 6.0, 0.0]
    assert exact_sums((np.zeros(0),), Serial()).tolist() == [[0.0]]


def test_bins_have_their_edges_at_multiples_of_the_cell():
    bins = Bins.over(-0.3, 1.2, 0.5)
    assert bins.edges.tolist() == [-0.5, 0.0, 0.5, 1.0, 1.5]
    assert bins.centres.tolist() == [-0.25, 0.25, 0.75, 1.25]
    assert bins.index(np.array([-9.0, -0.1, 0.0, 1.49, 9.0])).tolist() == [0, 0, 1, 3, 3]
    with pytest.raises(SceneError, match=r"cell = 1e-06 .* more than 65535 bins; use a larger cell"):
        Bins.over(0.0, 1.0, 1e-6)


def test_a_quantile_is_interpolated_within_its_bin():
    bins = Bins.over(0.0, 3.9, 1.0)
    assert quantile(bins, np.array([1.0, 0.0, 1.0, 0.0]), 0.5) == 1.0
    assert quantile(bins, np.array([1.0, 0.0, 1.0, 0.0]), 0.75) == 2.5
    assert quantile(bins, np.array([1.0, 0.0, 1.0, 0.0]), 1.0) == 3.0
    assert quantile(bins, np.zeros(4), 0.5) == 0.0


# -- spheres cut by planes -------------------------------------------------------------------------------------------------


def test_caps_sum_to_the_sphere():
    planes = np.linspace(-1.3, 1.3, 14)
    assert np.sum(cap_volume(planes[:-1]) - cap_volume(planes[1:])) == pytest.approx(SPHERE, rel=1e-15)
    assert cap_volume(0.5) == pytest.approx(5.0 / 24.0 * math.pi, rel=1e-15)


@given(a=st.floats(-1.2, 1.2), b=st.floats(-1.2, 1.2))
def test_the_corners_between_two_planes_sum_to_the_sphere(a, b):
    corners = [corner_volume(p, q) for p in (a, -a) for q in (b, -b)]  # -a: its mirror image, the other side of the plane
    assert min(corners) > -1e-14
    assert sum(corners) == pytest.approx(SPHERE, rel=1e-14)
    assert corners[0] + corners[1] == pytest.approx(cap_volume(a), abs=1e-14)
    assert corners[0] + corners[2] == pytest.approx(cap_volume(b), abs=1e-14)
    assert corners[0] == pytest.approx(corner_volume(b, a), abs=1e-14)


@pytest.mark.parametrize(("a", "b"), [(0.3, 0.2), (-0.4, 0.5), (0.6, -0.7), (-0.5, -0.6), (0.8, 0.7)])
def test_a_corner_is_the_integral_of_circular_segments(a, b):
    nodes, weights = np.polynomial.legendre.leggauss(60)
    kink, total = max(math.sqrt(1.0 - a * a), b), 0.0  # beyond it the plane x = a misses the disc
    for low, high in ((max(b, -kink), kink), (kink, 1.0)):
        z = low + (high - low) * np.sin(0.25 * math.pi * (nodes + 1.0)) ** 2  # dense at both ends
        slope = (high - low) * 0.25 * math.pi * np.sin(0.5 * math.pi * (nodes + 1.0))
        ratio = np.clip(a / np.sqrt(1.0 - z * z), -1.0, 1.0)
        segment = (1.0 - z * z) * (np.arccos(ratio) - ratio * np.sqrt(1.0 - ratio**2))
        total += (weights * slope * segment).sum()
    assert corner_volume(a, b) == pytest.approx(total, abs=1e-8)


def test_bars_tile_the_sphere():
    cuts = np.array([-1.0, -0.7, -0.1, 0.35, 1.0])
    i, k = (grid.ravel() for grid in np.meshgrid(np.arange(4), np.arange(4)))
    bars = bar_volume((cuts[i], cuts[i + 1]), (cuts[k], cuts[k + 1]))
    assert bars.min() > 0.0
    assert bars.sum() == pytest.approx(SPHERE, rel=1e-14)
    assert bar_volume((np.array([0.9]), np.array([2.0])), (np.array([0.9]), np.array([2.0])))[0] == 0.0


# -- front -----------------------------------------------------------------------------------------------------------------


def test_the_front_of_a_block():
    """12 layers of cells along x, 3 high: thickness 3 phi in every column, and a vertical face at x = 12."""
    sim = flow(np.concatenate([block((12, 4, 3)), [[16.5, 0.5, 0.5]]]))
    front = Front(origin=2.0, cell=1.0, thickness=0.3).compute(sim)
    column = 3.0 * SPHERE * 0.4**3
    assert front.position == pytest.approx(11.5 - 2.0 + (column - 0.3) / column, rel=1e-14)
    assert abs(front.position - 10.0) < 0.5, "at a vertical face the error is below half a cell"
    assert front.foremost == 14.5
    assert Front(2.0, 1.0, 0.3).compute(flow(block((12, 4, 3)))).position == 9.5, "not beyond the foremost grain"
    grains = 0.99 * (12 * 4 * 3 + 1)
    assert front.mass_99 == pytest.approx((grains - 11 * 12) / 12 + 11.0 - 2.0, rel=1e-14)


def test_a_wedge_has_its_front_where_it_is_as_thin_as_asked():
    """n - k layers in column k: the thickness falls linearly, and interpolation is exact."""
    sim = flow(np.concatenate([block((1, 4, 10 - k), (k + 0.5, 0.5, 0.5)) for k in range(10)]))
    layer = SPHERE * 0.4**3
    assert Front(0.0, 1.0, thickness=3.25 * layer).compute(sim).position == pytest.approx(0.5 + 10 - 3.25, rel=1e-14)
    assert Front(0.0, 1.0).compute(sim).position == pytest.approx(0.5 + 10 - (SPHERE / 8 * 0.8) / layer, rel=1e-14), (
        "one grain per d^2"
    )


def test_mass_beyond_a_gap_is_not_the_front_and_frozen_grains_do_not_flow():
    sim = flow(np.concatenate([block((6, 4, 3)), block((3, 4, 2), (10.5, 0.5, 0.5))]))
    assert 5.5 < Front(0.0, 1.0, 0.1).compute(sim).position < 6.5
    sim = flow(block((6, 4, 3)), frozen=block((6, 4, 3))[:, 0] > 3.0)
    front = Front(0.0, 1.0, 0.1).compute(sim)
    assert front.foremost == 2.5
    assert front.position == 2.5


def test_a_front_at_the_end_of_the_box_and_none_at_all():
    assert Front(0.0, 1.0, 0.1).compute(flow(block((20, 4, 1)), length=19.75)).position == 19.5
    for sim in (flow([]), flow(block((6, 4, 1)), frozen=True)):
        front = Front(0.0, 1.0).compute(sim)
        assert (front.position, front.foremost, front.mass_99) == (0.0, 0.0, 0.0)
    assert Front(0.0, 1.0, thickness=5.0).compute(flow(block((6, 4, 1)))).position == 0.0, "nowhere that thick"
    assert Front(9.0, 1.0, thickness=5.0).compute(flow(block((6, 4, 1)))).position == 0.0


# -- profile ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shift", [0.0, 0.137])
@pytest.mark.parametrize("station", [7.0, 7.31])
def test_a_lattice_has_its_solid_fraction_however_slab_and_bins_cut_it(shift, station):
    """A cell of the lattice holds one grain wherever it begins."""
    sim = flow(block((20, 4, 8), (0.5, 0.5, 0.5 + shift)), radius=0.45)
    profile = Profile(station, width=3.0, cell=1.0).compute(sim)
    phi = SPHERE * 0.45**3
    inner = (profile.z > 1.0) & (profile.z < 7.9)
    assert inner.sum() == 7
    assert profile.solid_fraction[inner] == pytest.approx(phi, rel=1e-12)
    assert profile.solid_fraction.sum() == pytest.approx(8 * phi, rel=1e-12)
    if shift == 0.0:
        assert profile.z.tolist()[:8] == [k + 0.5 for k in range(8)]
        assert profile.surface_height == pytest.approx(8.0, rel=1e-12)


@pytest.mark.parametrize("width", [6.0, 2.0, 5.7])
def test_a_slab_of_a_periodic_flow_holds_what_its_length_says(width):
    sim = flow(block((6, 4, 3), (0.1, 0.5, 0.5)), length=6.0, periodic_x=True)
    profile = Profile(3.0, width, cell=1.0).compute(sim)
    whole = 3 * SPHERE * 0.4**3
    if width == 5.7:  # the gap of 0.3 around x = 0 is cut out of the grains at x = 0.1, and of their images
        cut = bar_volume((np.array([-0.25 / 0.4]), np.array([0.05 / 0.4])), (np.array([-1.0]), np.array([1.0])))[0] * 0.4**3
        assert (profile.solid_fraction * width).sum() == pytest.approx(6 * whole - 3 * cut, rel=1e-12)
    else:
        assert profile.solid_fraction.sum() == pytest.approx(whole, rel=1e-12)


def test_a_linear_velocity_profile_and_its_moving_layer():
    points, rate = block((20, 4, 16)), 0.7
    velocity = np.zeros_like(points)
    velocity[:, 0] = rate * points[:, 2]
    profile = Profile(10.0, 4.0, 1.0).compute(flow(points, velocity=velocity))
    full = profile.solid_fraction > 1e-6
    assert profile.velocity[full] == pytest.approx(rate * profile.z[full], rel=1e-14)
    assert profile.speed[full] == pytest.approx(profile.velocity[full], rel=1e-14)
    assert profile.temperature[full] == pytest.approx(0.0, abs=1e-13)
    assert profile.surface_height == pytest.approx(16.0, rel=1e-14)
    assert profile.surface_speed == pytest.approx(rate * 15.5, rel=1e-14)
    assert profile.moving_layer == pytest.approx(16.0 - 0.1 * 15.5, rel=1e-14)


def test_a_sliding_layer_over_one_at_rest_and_flows_that_move_throughout_or_not_at_all():
    points = block((20, 4, 6))
    velocity = np.where(points[:, 2:] > 4.0, (2.0, 0.0, 0.0), 0.0)
    profile = Profile(10.0, 4.0, 1.0).compute(flow(points, velocity=velocity))
    assert profile.moving_layer == pytest.approx(6.0 - (3.5 + 0.1), rel=1e-14), "between the centres of bins at 3.5 and 4.5"
    assert Profile(10.0, 4.0, 1.0).compute(flow(points, velocity=1.0)).moving_layer == pytest.approx(6.0, rel=1e-14)
    assert Profile(10.0, 4.0, 1.0).compute(flow(points)).moving_layer == 0.0


def test_a_grain_counts_in_a_bin_by_its_part_there():
    """Two grains at heights 0.5 and 1.5 + 0.2: the bin from 1 to 2 holds one, that from 2 to 3 the rest of it."""
    sim = flow([[10, 1, 0.5], [10, 1, 1.7]], velocity=[[1.0, 0, 0], [3.0, 0, 4.0]])
    profile = Profile(10.0, 4.0, 1.0).compute(sim)
    above = cap_volume(0.3 / 0.4) * 0.4**3
    assert profile.solid_fraction * 16.0 == pytest.approx([SPHERE * 0.064, SPHERE * 0.064 - above, above], rel=1e-13)
    assert profile.velocity == pytest.approx([1.0, 3.0, 3.0], rel=1e-14)
    assert profile.speed == pytest.approx([1.0, 5.0, 5.0], rel=1e-14)


def test_granular_temperature_and_mean_speed():
    """Half of the grains up, half down, all along x with 1: mean velocity (1, 0, 0), a third of 4 as temperature."""
    points = block((20, 4, 2))
    velocity = np.stack([np.ones(len(points)), np.zeros(len(points)), np.where(points[:, 1] > 2.0, 2.0, -2.0)], axis=1)
    profile = Profile(10.0, 4.0, 1.0).compute(flow(points, velocity=velocity))
    full = profile.solid_fraction > 1e-6
    assert profile.temperature[full] == pytest.approx(4.0 / 3.0, rel=1e-13)
    assert profile.speed[full] == pytest.approx(math.sqrt(5.0), rel=1e-14)
    assert profile.velocity[full] == pytest.approx(1.0, rel=1e-14)


def test_an_empty_slab_has_no_profile():
    for sim in (flow([]), flow(block((3, 4, 2))), flow(block((20, 4, 2)), frozen=True)):
        profile = Profile(10.0, 4.0, 1.0).compute(sim)
        assert len(profile.z) == len(profile.speed) == len(profile.solid_fraction) == 0
        assert (profile.surface_height, profile.surface_speed, profile.moving_layer) == (0.0, 0.0, 0.0)


def test_spray_does_not_lift_the_surface():
    profile = Profile(10.0, 4.0, 1.0).compute(flow(np.concatenate([block((20, 4, 5)), [[10, 1, 12.5], [9, 2, 15.5]]])))
    bulk = (5 + 2 / 16**2) / (5 + 2 / 16)  # in units of a full layer of 16 grains
    assert profile.surface_height == pytest.approx(4.5 + (1.0 - 0.5 * bulk), rel=1e-13)
    assert profile.z[-1] == 15.5


# -- jet -------------------------------------------------------------------------------------------------------------------


def test_what_stands_and_rises_at_a_wall():
    """Ten layers within 2 of the wall, the upper five rising; what is farther away and what is frozen does not count."""
    points = block((20, 4, 10))
    velocity = np.where(points[:, 2:] > 5.0, (0.0, 0.0, 3.0), (1.0, 0.0, -1.0))
    sim = flow(points, velocity=velocity, frozen=points[:, 0] > 19.0)
    jet = Jet(wall=19.0, cell=1.0, reach=2.0).compute(sim)
    grain = SPHERE * 0.4**3
    assert jet.solid_volume == pytest.approx(80 * grain, rel=1e-14)
    assert jet.mass == pytest.approx(80 * grain, rel=1e-14)
    assert jet.rising_mass == pytest.approx(40 * grain, rel=1e-14)
    assert jet.rising_velocity == pytest.approx(3.0, rel=1e-14)
    assert jet.height == pytest.approx(9.5, rel=1e-14)
    assert jet.highest == 9.5
    assert Jet(19.0, 1.0).compute(sim).mass == pytest.approx(160 * grain, rel=1e-14), "within five diameters, 4"


def test_no_grain_at_the_wall():
    for sim in (flow([]), flow(block((3, 4, 2))), flow(block((20, 4, 2)), frozen=True)):
        jet = Jet(19.0, 1.0).compute(sim)
        assert (jet.height, jet.highest, jet.mass, jet.solid_volume, jet.rising_mass, jet.rising_velocity) == (0.0,) * 6


# -- all of them -----------------------------------------------------------------------------------------------------------


def random_flow():
    rng = np.random.default_rng(5)
    points = block((20, 4, 6)) + rng.uniform(-0.1, 0.1, (480, 3))
    radius, velocity = rng.uniform(0.3, 0.4, 480), rng.normal(size=(480, 3))
    return flow(points, radius, velocity=velocity, frozen=points[:, 2] < 1.0)


def test_same_bits_for_any_number_of_ranks():
    def program():
        sim = random_flow()
        sim.run(20)
        found = [Front(1.0, 1.3).compute(sim), Profile(9.7, 3.1, 0.7).compute(sim), Jet(19.5, 0.6).compute(sim)]
        return [{name: np.asarray(value).tobytes() for name, value in vars(measure).items()} for measure in found]

    alone = program()
    assert virtual_ranks(3, program) == [alone] * 3


def test_velocities_are_those_of_the_full_step():
    sim = simulation(bc.Box((0, 0, -2), (20, 4, 18), (False, True, False)), gravity=(2.0, 0.0, 3.0), properties=NOTHING)
    sim.add_grains([[10.0, 2.0, 0.5]], 0.4)
    sim.start_at_full_step()
    sim.run(100)
    assert Profile(10.0, 4.0, 1.0).compute(sim).velocity == pytest.approx(0.2, rel=1e-12)
    assert Jet(10.0, 1.0).compute(sim).rising_velocity == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Front(0.0, 0.0), r"Front: cell = 0.0 \[length\] must be a finite number > 0"),
        (lambda: Front(0.0, 1.0, thickness=-1.0), r"Front: thickness = -1.0"),
        (lambda: Front("here", 1.0), r"Front: origin = 'here' \[length\] must be numbers"),
        (lambda: Profile(math.nan, 1.0, 1.0), r"Profile: station = nan \[length\] must be a finite number$"),
        (lambda: Profile(0.0, (1.0, 2.0), 1.0), r"Profile: width = \(1.0, 2.0\)"),
        (lambda: Jet(0.0, 1.0, reach=math.inf), r"Jet: reach = inf"),
        (
            lambda: Profile(19.0, 4.0, 1.0).compute(flow([])),
            r"slab from x = 17 to 21 .* leaves the box, 0 to 20; move the station",
        ),
        (lambda: Front(0.0, 1.0).compute(flow([], periodic_x=True)), r"periodic along x; a flow without end"),
        (lambda: Front(0.0, 1e-5).compute(flow([])), r"cell = 1e-05 .* use a larger cell"),
    ],
)
def test_what_cannot_be_measured_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_a_result_read_too_early_says_so():
    with pytest.raises(RuntimeError, match=r"Front: call compute\(sim\) first"):
        _ = Front(0.0, 1.0).position
    assert "[length]" in Front.position.__doc__
