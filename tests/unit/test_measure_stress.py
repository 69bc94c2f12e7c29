"""Stress and solid fraction of states whose answer is known in closed form."""

import math

import numpy as np
import pytest
from scenes import NOTHING, SOFT, pile, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.kernels import compiler
from barchan.measure import contact_table, solid_fraction, stress, void_ratio
from barchan.measure.brick import Brick
from barchan.measure.sphere_cuts import bar_volume, brick_volume, corner_of_three, corner_volume
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

ELASTIC = {**SOFT, "gamma_n": 0.0, "gamma_t": 0.0}
SIMPLE_CUBIC = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) + 0.5
FACE_CENTRED = np.concatenate([SIMPLE_CUBIC - 0.4 + half for half in [(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)]])


def crystal(points, radius, **options):
    """A crystal of cells of edge 1 in a box of edge 4 without faces."""
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, True)), properties=ELASTIC)
    sim.add_grains(points, radius, **options)
    sim.prepare()
    return sim


# -- stress ----------------------------------------------------------------------------------------------------------------


def test_a_simple_cubic_crystal_has_the_pressure_force_per_face():
    found = stress(crystal(SIMPLE_CUBIC, 0.51))
    assert found.contact == pytest.approx(1000.0 * 0.02 / 1.0**2 * np.eye(3), rel=1e-12, abs=1e-12)
    assert not found.kinetic.any()
    assert found.mean_stress == pytest.approx(20.0, rel=1e-12), "compression is positive"
    assert found.deviatoric_stress == pytest.approx(0.0, abs=1e-12)


def test_a_face_centred_crystal():
    """24 contacts a cell of edge 1, force F = k (2 R - D) at the distance D = 1/sqrt(2): p = 24 F D / 3."""
    distance = math.sqrt(0.5)
    found = stress(crystal(FACE_CENTRED, 0.36))
    assert found.contact == pytest.approx(8.0 * 1000.0 * (0.72 - distance) * distance * np.eye(3), rel=1e-11, abs=1e-10)


def chain():
    """A chain along x through the periodic faces: 4 grains, 1.25 apart, F = 50, in a box of 5 x 4 x 2."""
    sim = simulation(bc.Box((0, 0, 0), (5, 4, 2), (True, True, False)), properties=ELASTIC)
    sim.add_grains([[x, 1.0, 1.0] for x in (0.2, 1.45, 2.7, 3.95)], 0.65)
    sim.prepare()
    return sim


def test_in_a_room_of_another_shape_its_volume_counts():
    """Of all grains: those of the chain, in a room of 10 that is a quarter of the box."""
    sim = chain()
    assert stress(sim, volume=10.0).contact == pytest.approx(4.0 * stress(sim).contact, rel=1e-12)
    solid = 4 * 4 / 3 * math.pi * 0.65**3
    assert solid_fraction(sim, volume=10.0) == pytest.approx(solid / 10.0, rel=1e-12)
    assert void_ratio(sim, volume=10.0) == pytest.approx(10.0 / solid - 1.0, rel=1e-12)
    for wrong in (0.0, -1.0, math.nan, "room", (1.0, 2.0)):
        with pytest.raises(SceneError, match="volume"):
            stress(sim, volume=wrong)
    with pytest.raises(SceneError, match="give low and high, or the volume, but not both"):
        void_ratio(sim, low=(0, 0, 0), volume=1.0)


def test_a_chain_is_stressed_along_itself_only():
    found = stress(chain())
    assert found.contact == pytest.approx(np.diag([50.0 / (4 * 2), 0, 0]), rel=1e-12, abs=1e-12)
    assert found.mean_stress == pytest.approx(50.0 / 8.0 / 3.0)
    assert found.deviatoric_stress == pytest.approx(50.0 / 8.0), "uniaxial: the difference of axial and radial stress"


@pytest.mark.parametrize("x", [(0.0, 0.1), (0.3, 0.9), (4.9, 5.0), (0.0, 4.0), (1.45, 2.7)])
def test_bricks_of_a_chain_have_its_stress_wherever_they_lie(x):
    """The line of the chain passes every cross-section once: F over the area of the brick, from any part of the branches."""
    found = stress(chain(), (x[0], 0.5, 0.5), (x[1], 1.5, 2.0))
    assert found.contact[0, 0] == pytest.approx(50.0 / (1.0 * 1.5), rel=1e-12)
    assert not stress(chain(), (x[0], 1.1, 0.0), (x[1], 4.0, 2.0)).contact.any(), "beside the chain there is nothing"


def test_bricks_side_by_side_add_up_to_the_whole():
    sim = pile(110)
    sim.run(40)
    whole, sums = stress(sim), np.zeros((3, 3))
    for low in np.ndindex(2, 3, 2):
        corner = np.array(low) * (3.0, 2.0, 3.0)
        sums += stress(sim, corner, corner + np.array([3.0, 2.0, 3.0])).contact / 12.0
    assert sums == pytest.approx(whole.contact, rel=1e-12, abs=1e-12 * np.abs(whole.contact).max())


def test_stress_is_the_sum_of_force_times_branch_in_the_table():
    sim = pile(110)
    sim.run(40)
    table, expected = contact_table(sim), np.zeros((3, 3))
    place = sim.grains.sorted_by_id("position")
    for first, second, force, point in zip(*(table[name] for name in ("first", "second", "force", "point"))):
        other = place[second] if second >= 0 else point
        expected += np.outer(force, sim.box.difference(place[first], other)) / 216.0
    assert (table["second"] < 0).any() and (table["second"] >= 0).any()
    assert stress(sim).contact == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


def column(frozen):
    """Three grains on top of each other at rest under gravity on a floor, or on a frozen grain, added before or after them."""
    properties = {**SOFT, "gamma_n": 40.0}
    sim = simulation(bc.Box((0, 0, -2), (2, 2, 6)), properties=properties, gravity=(0, 0, -2.0))
    if not frozen:
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    z = {None: (0.5, 1.5, 2.5), "first": (-0.5, 0.5, 1.5, 2.5), "last": (0.5, 1.5, 2.5, -0.5)}[frozen]
    sim.add_grains([[1, 1, height] for height in z], 0.5, frozen=np.array(z) < 0.0)
    sim.run(20_000)
    return sim


@pytest.mark.parametrize("frozen", [None, "first", "last"])
def test_a_column_at_rest_bears_its_weight(frozen):
    sim = column(frozen)
    weight = 3.0 * math.pi / 6.0 * 2.0
    at_floor = stress(sim, (0, 0, 0.0), (2, 2, 0.25)).contact
    assert at_floor == pytest.approx(np.diag([0, 0, weight / 4.0]), rel=1e-9, abs=1e-9)
    if not frozen:
        assert at_floor[2, 2] == pytest.approx(-sim.walls[0].force[2] / 4.0, rel=1e-12)
    z = np.sort(sim.grains.position[:, 2])[-3:]
    contact_point = -0.5 * weight / 1000.0 if frozen else 0.0  # in the middle of the overlap, or on the wall
    assert stress(sim).contact[2, 2] == pytest.approx(weight * (z - contact_point).mean() / 32.0, rel=1e-9)


def test_the_kinetic_part_is_that_of_the_fluctuations_at_the_full_step():
    rng = np.random.default_rng(5)
    sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), (True, True, True)), properties=NOTHING, gravity=(0, 0, -100.0))
    radius, velocity = rng.uniform(0.2, 0.4, 30), rng.normal(size=(30, 3)) + np.array([1e3, 0, 0])
    velocity[0] = 0.0
    site = rng.permutation(216)[:30]
    place = np.stack([site % 6, site // 6 % 6, site // 36], axis=1) + 0.5
    sim.add_grains(place, radius, velocity=velocity, frozen=np.arange(30) == 0)
    sim.start_at_full_step()
    assert stress(sim).kinetic == pytest.approx(fluctuations(radius[1:], velocity[1:]) / 216.0, rel=1e-10, abs=1e-12)
    some = (sim.grains.sorted_by_id("position")[1:, 0] < 2.0).nonzero()[0] + 1
    part = stress(sim, (0, 0, 0), (2, 6, 6)).kinetic
    assert 2 < len(some) < 20
    assert part == pytest.approx(fluctuations(radius[some], velocity[some]) / 72.0, rel=1e-10, abs=1e-12)
    sim = pile(110)
    sim.run(40)
    grains = sim.grains
    velocity = grains.velocity + 0.5 * sim.dt * grains.force / grains.mass[:, None]
    assert stress(sim).kinetic == pytest.approx(fluctuations(grains.radius, velocity) / 216.0, rel=1e-10, abs=1e-12)


def fluctuations(radius, velocity):
    mass = 4.0 / 3.0 * math.pi * radius**3
    rest = velocity - (mass[:, None] * velocity).sum(axis=0) / mass.sum()
    return (mass[:, None] * rest).T @ rest


def test_without_grains_there_is_no_stress():
    sim = simulation()
    sim.prepare()
    assert not stress(sim).total.any() and stress(sim).mean_stress == 0.0
    assert solid_fraction(sim) == 0.0 and void_ratio(sim) == math.inf


# -- solid fraction --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("edge", [(4, 4, 4), (1, 2, 3), (0.5, 0.5, 0.5)])
@pytest.mark.parametrize("corner", [(0, 0, 0), (0.5, 0, 0.5)])
def test_cells_of_a_crystal_have_its_solid_fraction(edge, corner):
    """Cut through the centres of grains, or between them, or out of the periodic box's corner."""
    low = np.array(corner) * (np.array(edge) < 4)
    sim = crystal(SIMPLE_CUBIC, 0.4)
    phi = 4.0 / 3.0 * math.pi * 0.4**3
    assert solid_fraction(sim, low, low + edge) == pytest.approx(phi, rel=1e-13)
    assert void_ratio(sim, low, low + edge) == pytest.approx((1.0 - phi) / phi, rel=1e-13)


def test_grains_that_reach_through_a_periodic_face_fill_the_other_side():
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, False, True)))
    sim.add_grains([[3.9, 2, 2]], 0.5)
    cap = math.pi * (2.0 / 3.0 - 0.2 + 0.2**3 / 3.0) * 0.125
    assert solid_fraction(sim, (0, 0, 0), (2, 4, 4)) * 32.0 == pytest.approx(cap, rel=1e-12)
    assert solid_fraction(sim) * 64.0 == pytest.approx(math.pi / 6.0, rel=1e-14)


def test_bricks_side_by_side_hold_all_grains():
    rng = np.random.default_rng(8)
    sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), (True, True, True)))
    sim.add_grains(rng.uniform(0, 6, (100, 3)), rng.uniform(0.1, 0.9, 100))
    x, y, z = [0, 0.7, 3.1, 6], [0, 2.2, 6], [0, 1.3, 1.31, 6]
    filled = sum(
        solid_fraction(sim, (x[i], y[j], z[k]), (x[i + 1], y[j + 1], z[k + 1]))
        * (x[i + 1] - x[i]) * (y[j + 1] - y[j]) * (z[k + 1] - z[k])
        for i, j, k in np.ndindex(3, 2, 3)
    )  # fmt: skip
    assert filled == pytest.approx((4.0 / 3.0 * math.pi * sim.grains.radius**3).sum(), rel=1e-13)


def test_a_sphere_beyond_three_planes_agrees_with_other_closed_forms_and_with_counting():
    rng = np.random.default_rng(3)
    a, b = rng.uniform(-1.1, 1.1, (2, 200))
    assert corner_of_three(a, b, -np.ones(200)) == pytest.approx(corner_volume(a, b), abs=1e-14)
    low, high = np.sort(rng.uniform(-1.2, 1.2, (2, 3, 200)), axis=0)
    low[1], high[1] = -np.inf, np.inf
    assert brick_volume(low, high) == pytest.approx(bar_volume((low[0], high[0]), (low[2], high[2])), abs=1e-14)
    x, y = (np.arange(1000) + 0.5) / 500.0 - 1.0, (np.arange(1000)[:, None] + 0.5) / 500.0 - 1.0
    height = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    for corner in [(0.3, 0.2, 0.1), (-0.3, 0.2, 0.1), (0.3, -0.2, -0.5), (-0.3, -0.2, -0.1), (0.6, 0.6, 0.6)]:
        columns = np.maximum(height - np.maximum(corner[2], -height), 0.0)[(y > corner[1]) & (x > corner[0])]
        assert float(corner_of_three(*corner)) == pytest.approx(columns.sum() * 0.002**2, abs=1e-4)


# -- bricks ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("measure", [stress, solid_fraction, void_ratio])
@pytest.mark.parametrize(
    ("low", "high", "message"),
    [
        ((0, 0, 0), (2, 2), "three finite numbers"),
        ((0, 0, 0), (2, 2, math.nan), "three finite numbers"),
        ((0, 0, 2), (2, 2, 2), "exceed low"),
        ((0, 0, -0.1), (2, 2, 2), "leaves the box"),
        ((0, 0, 0), (2, 2, 4.1), "leaves the box"),
        ("low", (2, 2, 2), "must be numbers"),
    ],
)
def test_bricks_that_are_none_are_refused(measure, low, high, message):
    with pytest.raises(SceneError, match=f"brick: .*{message}"):
        measure(crystal(SIMPLE_CUBIC, 0.51), low, high)


def test_a_brick_that_exceeds_the_box_by_rounding_is_the_box():
    box = bc.Box((0, 0, 0), (4, 4, 4), (True, False, True))
    brick = Brick(box, (-1e-10, 0, 0), (4, 4.0000000001, 4))
    assert brick.endless.tolist() == [True, False, True] and brick.volume == 64.0 and brick.shifts.tolist() == [[0, 0, 0]]


def test_stress_of_a_scene_that_was_changed_is_not_measured():
    sim = pile()
    sim.run(5)
    sim.remove([3])
    with pytest.raises(SceneError, match="the scene was changed"):
        stress(sim)


def test_the_same_bits_for_any_number_of_ranks_and_threads(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)

    def program(threads=1):
        sim = pile(110, threads=threads)
        sim.freeze([7, 50])
        sim.run(40)
        bricks = [((0, 0, 0), (6, 6, 6)), ((0.5, 1, 0), (3, 6, 2))]
        return [(*map(np.ndarray.tobytes, stress(sim, *brick)), solid_fraction(sim, *brick)) for brick in bricks]

    alone = program()
    assert program(2) == alone
    for ranks in (1, 2, 4):
        assert virtual_ranks(ranks, program) == [alone] * ranks
