"""Fabric, coordination, sliding, unbalanced force and inertial number of states whose answer is known in closed form."""

import math

import numpy as np
import pytest
from scenes import SOFT, fingerprint, pile, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.kernels import compiler
from barchan.measure import contact_table, coordination, fabric, inertial_number, sliding_fraction, stress, unbalanced_force
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

SIMPLE_CUBIC = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) + 0.5
FACE_CENTRED = np.concatenate([SIMPLE_CUBIC - 0.4 + half for half in [(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)]])
ELASTIC = {**SOFT, "gamma_n": 0.0, "gamma_t": 0.0}


def crystal(points, radius, edge=(4, 4, 4)):
    sim = simulation(bc.Box((0, 0, 0), edge, (True, True, True)))
    sim.add_grains(points, radius)
    sim.prepare()
    return sim


# -- fabric ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("points", "radius"), [(SIMPLE_CUBIC, 0.51), (FACE_CENTRED, 0.36)])
def test_cubic_crystals_are_isotropic(points, radius):
    found = fabric(crystal(points, radius))
    assert found.tensor == pytest.approx(np.eye(3) / 3.0, abs=1e-13)
    assert found.deviator == pytest.approx(np.zeros((3, 3)), abs=1e-13)
    assert found.anisotropy == pytest.approx(0.0, abs=1e-13)


def test_layers_that_do_not_touch_have_a_flat_fabric():
    found = fabric(crystal(SIMPLE_CUBIC * (1.0, 1.0, 1.5), 0.51, (4, 4, 6)))
    assert found.tensor == pytest.approx(np.diag([0.5, 0.5, 0.0]), abs=1e-14)
    assert found.deviator == pytest.approx(np.diag([1.0, 1.0, -2.0]) / 6.0, abs=1e-14)
    assert found.anisotropy == pytest.approx(0.5)


def test_fabric_of_leaning_contacts_through_a_periodic_face_and_none_of_walls():
    sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True, False, False)))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains([[0.2, 4, 4.4], [7.4, 4, 4.8], [3, 3, 0.45]], [0.6, 0.35, 0.5], frozen=[False, True, False])
    sim.prepare()
    direction = np.array([0.8, 0.0, -0.4]) / math.hypot(0.8, 0.4)
    assert fabric(sim).tensor == pytest.approx(np.outer(direction, direction), abs=1e-14)


# -- coordination ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("points", "radius", "neighbours"), [(SIMPLE_CUBIC, 0.51, 6.0), (FACE_CENTRED, 0.36, 12.0)])
def test_crystals_have_their_neighbours(points, radius, neighbours):
    assert coordination(crystal(points, radius)) == (neighbours, neighbours, 0)


def test_rattlers_count_in_the_plain_number_only():
    """A square of four, a fifth that hangs on it, and one alone: 2 C = 10, N = 6, N0 = 1, N1 = 1."""
    sim = simulation()
    sim.add_grains([[5, 5, 5], [6, 5, 5], [5, 6, 5], [6, 6, 5], [7, 6, 5], [9, 9, 9]], 0.505)
    sim.prepare()
    found = coordination(sim)
    assert found.plain == pytest.approx(10.0 / 6.0)
    assert found.mechanical == pytest.approx((10.0 - 1.0) / (6.0 - 2.0))
    assert found.rattlers == 2


def test_walls_and_frozen_grains_count_for_the_moving_grain_only():
    """On the floor beside a frozen grain, 2 contacts; between frozen grains, 2; one on the floor alone, a rattler."""
    sim = simulation()
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    frozen = [False, True, False, True, False]
    sim.add_grains([[4, 4, 0.49], [4.98, 4, 0.49], [5.96, 4, 0.6], [6.94, 4, 0.6], [9, 9, 0.49]], 0.5, frozen=frozen)
    sim.prepare()
    assert coordination(sim) == (pytest.approx(5.0 / 3.0), 2.0, 1)


# -- sliding ---------------------------------------------------------------------------------------------------------------


def on_floor(friction, velocity, steps, law=bc.laws.linear):
    """Two grains apart on a floor, under gravity, of which the first slides and the second rests."""
    material = bc.Material("a", density=1.0, **{**SOFT, "gamma_n": 40.0, "friction": friction})
    sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), law, material, 1e-3, (0, 0, -9.0))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains([[2, 2, 0.495], [2, 9, 0.495]], 0.5, velocity=[[velocity, 0, 0], [0, 0, 0]])
    sim.run(steps)
    return sim


def test_a_grain_thrown_along_a_floor_slides_until_it_rolls():
    """v = v0 - mu g t, and it rolls from t = 2 v0 / (7 mu g) on: 0.4 s."""
    assert sliding_fraction(on_floor(0.4, 5.04, 300)) == 0.5
    assert sliding_fraction(on_floor(0.4, 5.04, 500)) == 0.0


def test_contacts_without_friction_slide():
    assert sliding_fraction(on_floor(0.0, 0.0, 5)) == 1.0


def test_the_friction_of_the_pair_counts():
    """Pairs sheared until k_t slip = 0.4, 0.2, 0.2 and 0.8 F_n, with friction 0.1, 0.3, 0.9 and 0.9."""
    stiff = {**ELASTIC, "kt": 3e5}
    materials = [bc.Material(name, density=1.0, **{**stiff, "friction": mu}) for name, mu in (("a", 0.1), ("b", 0.9))]
    sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), bc.laws.linear, materials, 1e-6)
    sim.materials.set_pair("a", "b", friction=0.3)
    for y, (pair, trial) in enumerate(zip(("aa", "ab", "bb", "bb"), (0.4, 0.2, 0.2, 0.8))):
        slip = trial * 1000.0 * 0.02 / 3e5
        sim.add_grains([[5, 2 + 3 * y, 5], [5.98, 2 + 3 * y, 5]], 0.5, list(pair), velocity=[[0, slip / 1e-4, 0], [0, 0, 0]])
    sim.run(100)
    force = contact_table(sim)["force"]
    assert np.abs(force[:, 1] / force[:, 0]) == pytest.approx([0.1, 0.2, 0.2, 0.8], rel=0.02)
    assert sliding_fraction(sim) == 0.25
    sim.materials.set_pair("a", "b", friction=0.15)
    sim.run(1)
    assert sliding_fraction(sim) == 0.5


@bc.law(properties={"kn": "force/length"})
def springs(overlap, kn):
    return kn * overlap, (0.0, 0.0, 0.0)


def test_a_law_without_friction_has_no_limit_to_slide_at():
    sim = bc.Simulation(bc.Box((0, 0, 0), (5, 5, 5)), springs, bc.Material("a", density=1.0, kn=10.0), 1e-3)
    sim.prepare()
    with pytest.raises(SceneError, match=r"law 'springs' has no parameter 'friction'.*it has kn"):
        sliding_fraction(sim)


# -- unbalanced force --------------------------------------------------------------------------------------------------------


def test_the_unbalanced_force_of_a_pair_that_parts():
    """Two grains pushed apart by F: mean resultant (F + F + 0) / 3, mean contact force F."""
    sim = simulation(properties=ELASTIC)
    sim.add_grains([[5, 5, 5], [5.96, 5, 5], [9, 9, 9], [9.9, 9, 9]], [0.5, 0.5, 0.5, 0.3], frozen=[False, False, False, True])
    sim.prepare()
    assert unbalanced_force(sim) == pytest.approx(2.0 / 3.0, rel=1e-13)


def test_the_unbalanced_force_falls_to_nothing_at_rest():
    sim = on_floor(0.4, 0.5, 20)
    moving = unbalanced_force(sim)
    sim.run(3000)
    assert moving > 0.1 and unbalanced_force(sim) < 1e-5, "gravity belongs to the resultant"


# -- inertial number -------------------------------------------------------------------------------------------------------


def test_inertial_number_of_arrays():
    found = inertial_number([-2.0, 4.0], [100.0, 400.0], 0.001, 2500.0)
    assert found == pytest.approx([0.01, 0.01], rel=1e-14)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"pressure": 0.0}, "pressure = 0.0 must be finite and > 0"),
        ({"shear_rate": math.inf}, "shear_rate = inf must be finite"),
        ({"diameter": -1.0}, "diameter = -1.0 must be finite and > 0"),
        ({"density": "sand"}, "density = 'sand' .* must be numbers"),
    ],
)
def test_inertial_numbers_that_are_none_are_refused(wrong, message):
    with pytest.raises(SceneError, match=message):
        inertial_number(**{"shear_rate": 1.0, "pressure": 1.0, "diameter": 1.0, "density": 1.0, **wrong})


# -- all -------------------------------------------------------------------------------------------------------------------

MEASURES = [coordination, fabric, sliding_fraction, unbalanced_force]


def test_nothing_touches():
    sim = simulation()
    sim.prepare()
    assert coordination(sim) == (0.0, 0.0, 0) and sliding_fraction(sim) == 0.0 and unbalanced_force(sim) == math.inf
    assert not fabric(sim).tensor.any() and fabric(sim).anisotropy == 0.0


@pytest.mark.parametrize("measure", MEASURES)
def test_contacts_of_a_scene_that_was_changed_are_not_measured(measure):
    sim = pile()
    sim.run(5)
    sim.remove([3])
    with pytest.raises(SceneError, match="the scene was changed"):
        measure(sim)


def test_measures_agree_with_the_table_of_contacts():
    sim = pile(110)
    sim.run(40)
    table = contact_table(sim)
    partners = np.concatenate([table["first"], table["second"][table["second"] >= 0]])
    count = np.bincount(partners, minlength=110)
    bearing = count >= 2
    found = coordination(sim)
    assert found.plain == count.sum() / 110 and found.rattlers == 110 - bearing.sum() > 0
    assert found.mechanical == (count.sum() - (count == 1).sum()) / bearing.sum()
    strength = np.sqrt((table["force"] ** 2).sum(axis=1)).mean()
    resultant = np.sqrt((sim.grains.force**2).sum(axis=1)).mean()
    assert unbalanced_force(sim) == pytest.approx(resultant / strength, rel=1e-12)
    assert 0.0 < sliding_fraction(sim) < 1.0


def test_the_same_bits_for_any_number_of_ranks_and_threads_and_nothing_changed(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)

    def measured(sim):
        return [str(measure(sim)) for measure in (coordination, sliding_fraction, unbalanced_force)], fabric(sim)[0].tobytes()

    def program(threads=1):
        sim = pile(110, threads=threads)
        sim.freeze([7, 50])
        sim.run(40)
        return measured(sim)

    alone = program()
    assert program(2) == alone
    for ranks in (1, 2, 4):
        assert virtual_ranks(ranks, program) == [alone] * ranks

    watched, plain = pile(), pile()
    for _ in range(3):
        watched.run(5)
        plain.run(5)
        measured(watched), stress(watched)
    assert fingerprint(watched) == fingerprint(plain)
