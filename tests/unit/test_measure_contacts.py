"""Energy budget and contact statistics of states whose answer is known in closed form."""

import math

import numpy as np
import pytest
from scenes import SOFT, fingerprint, pile, simulation

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.errors import SceneError
from barchan.measure import ContactStatistics, EnergyBudget, Front, Jet, KineticEnergy, Profile, contact_table
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

FRICTIONLESS = {"kn": 1000.0, "kt": 300.0, "friction": 0.0}


# -- energy ----------------------------------------------------------------------------------------------------------------


def test_energy_is_constant_in_free_fall_through_a_periodic_face():
    """x(n) = x0 + v0 n dt + g (n dt)^2 / 2 in the leap-frog too, and v(n) is its slope: only rounding is left."""
    box = bc.Box((0, 0, 0), (4, 20, 20), (True, False, False))
    sim = simulation(box, gravity=(3.0, 0.0, -2.0))
    sim.add_grains([[3.9, 5, 9], [1.0, 9, 9]], [0.5, 0.3], velocity=[[3.0, 1, 2], [-7.0, 0, 0]], omega=(0, 2.0, 1.0))
    sim.start_at_full_step()
    start = EnergyBudget().compute(sim)
    mass = math.pi / 6.0 * np.array([1.0, 0.6**3])
    assert start.potential == pytest.approx(-(mass * (3.0 * np.array([3.9, 1.0]) - 2.0 * 9.0)).sum(), rel=1e-14)
    assert start.rotation == pytest.approx((0.2 * mass * np.array([0.25, 0.09])).sum() * 5.0, rel=1e-14)
    assert (start.elastic, start.dissipated) == (0.0, 0.0)
    sim.run(1000)
    assert np.abs(sim.grains.image[:, 0]).min() > 0, "both have left through the periodic face"
    later = EnergyBudget(start.total).compute(sim)
    assert later.translation > 1.5 * start.translation
    assert abs(later.dissipated) < 1e-12 * later.translation
    kinetic = KineticEnergy().compute(sim)
    assert (later.translation, later.rotation) == (kinetic.translation, kinetic.rotation)


def test_the_gravity_of_the_moment_counts():
    sim = simulation(gravity=lambda t: (0.0, 0.0, -10.0 * t))
    sim.add_grains([[5, 5, 8]], 0.5)
    sim.run(100)
    z = sim.grains.position[0, 2]
    assert EnergyBudget().compute(sim).potential == pytest.approx(math.pi / 6.0 * 1.0 * z, rel=1e-12)


def head_on(gamma, dt=2e-5):
    sim = simulation(dt=dt, properties={**FRICTIONLESS, "gamma_n": gamma})
    sim.add_grains([[5, 5, 5], [6.0, 5, 5]], 0.5, velocity=[[0.5, 0, 0], [-0.5, 0, 0]])
    sim.start_at_full_step()
    return sim


def test_a_damped_head_on_collision_dissipates_what_its_restitution_says():
    """m_eff x'' = -k x - gamma m_eff x': e = exp(-gamma t_c / 2) with t_c = pi / sqrt(k/m_eff - gamma^2/4)."""
    gamma, mass_eff = 20.0, math.pi / 12.0
    sim = head_on(gamma)
    start = EnergyBudget().compute(sim).total
    contact = math.pi / math.sqrt(1000.0 / mass_eff - 0.25 * gamma**2)
    sim.run(int(1.05 * contact / sim.dt))
    budget = EnergyBudget(start).compute(sim)
    assert ContactStatistics().compute(sim).count == 0, "they have parted"
    assert budget.dissipated == pytest.approx(start - KineticEnergy().compute(sim).total, rel=1e-14)
    assert budget.dissipated == pytest.approx(0.5 * mass_eff * (1.0 - math.exp(-gamma * contact)), rel=1e-3)


def test_an_elastic_collision_stores_energy_and_gives_it_back():
    sim = head_on(0.0)
    start = EnergyBudget().compute(sim).total
    stored = []
    for _ in range(11):
        sim.run(250)
        budget = EnergyBudget(start).compute(sim)
        stored.append(budget.elastic / start)
        assert abs(budget.dissipated) < 1e-5 * start, "O(dt^2)"
    assert max(stored) > 0.95 and stored[-1] == 0.0


DAMPED = {**FRICTIONLESS, "gamma_n": 9.0}
LAWS = {
    "linear": (bc.laws.linear, DAMPED, lambda d, r, rr: 0.5 * 1000.0 * d**2),
    "silbert": (bc.laws.silbert, DAMPED, lambda d, r, rr: 0.4 * 1000.0 * d**2.5 / math.sqrt(rr)),
    "hertz_mindlin": (
        bc.laws.hertz_mindlin,
        {"youngs_modulus": 1000.0, "poisson_ratio": 0.25, "friction": 0.3, "restitution": 0.5},
        lambda d, r, rr: 8.0 / 15.0 * (1000.0 / (2.0 * (1.0 - 0.25**2))) * math.sqrt(r) * d**2.5,
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_elastic_energy_of_pairs_and_walls_in_closed_form(name):
    """Of grains that part, spin and slide with damping too: the energy is that of the overlap alone."""
    law, properties, energy = LAWS[name]
    sim = bc.Simulation(
        bc.Box((0, 0, 0), (9, 9, 9), (True, False, False)), law, bc.Material("a", density=1.0, **properties), 1e-4
    )
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains(
        [[0.2, 4, 4], [8.3, 4, 4], [4, 4, 0.45]], [0.6, 0.4, 0.5], velocity=[[3.0, 1, 0], [0, 0, 0], [1, 0, 1]], omega=1.0
    )
    sim.prepare()
    expected = energy(0.1, 0.24, 1.0) + energy(0.05, 0.5, 1.0)
    assert EnergyBudget().compute(sim).elastic == pytest.approx(expected, rel=1e-13)


# -- contacts --------------------------------------------------------------------------------------------------------------


def test_contacts_are_counted_right_at_walls_and_frozen_grains():
    """A wall below, a frozen grain, two moving ones on top of each other and one alone."""
    sim = simulation(properties={**SOFT, "gamma_n": 0.0})
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    points = [[4, 4, 0.49], [4, 4, 1.46], [4.98, 4, 0.49], [9, 9, 9]]
    sim.add_grains(points, [0.5, 0.5, 0.5, 0.3], frozen=[False, False, True, False])
    sim.prepare()
    found = ContactStatistics().compute(sim)
    assert found.count == 3
    assert found.coordination == pytest.approx((3 + 1 + 0) / 3)
    assert found.largest_overlap == pytest.approx(0.03, rel=1e-12)
    assert found.mean_normal_force == pytest.approx((1000 * 0.01 + 1000 * 0.03 + 1000 * 0.02) / 3, rel=1e-12)


def test_a_crystal_has_six_neighbours():
    points = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) + 0.5
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, True)))
    sim.add_grains(points, 0.51)
    sim.prepare()
    found = ContactStatistics().compute(sim)
    assert (found.count, found.coordination) == (192, 6.0)
    assert found.largest_overlap == pytest.approx(0.02 / 1.02, rel=1e-12)


def test_statistics_agree_with_the_table_of_contacts():
    sim = pile(110)
    sim.run(40)
    table, found = contact_table(sim), ContactStatistics().compute(sim)
    assert found.count == len(table["first"]) > 20
    assert found.largest_overlap == table["relative_overlap"].max()
    assert found.coordination == (len(table["first"]) + (table["second"] >= 0).sum()) / 110


def test_no_contacts():
    sim = simulation()
    sim.prepare()
    found = ContactStatistics().compute(sim)
    assert (found.count, found.coordination, found.largest_overlap, found.mean_normal_force) == (0, 0.0, 0.0, 0.0)
    assert EnergyBudget(1.0).compute(sim).dissipated == 1.0


@pytest.mark.parametrize("measure", [ContactStatistics(), EnergyBudget()])
def test_contacts_of_a_scene_that_was_changed_are_not_measured(measure):
    sim = pile()
    sim.run(5)
    measure.compute(sim)
    sim.remove([3])
    with pytest.raises(SceneError, match=r"step 5: the scene was changed .* call prepare\(\) or run\(\)"):
        measure.compute(sim)
    sim.prepare()
    measure.compute(sim)


@pytest.mark.parametrize("measure", [ContactStatistics().compute, EnergyBudget().compute, contact_table])
def test_contacts_of_a_restored_state_are_not_measured_before_a_step(measure, tmp_path):
    """A checkpoint holds what the next step reads: positions, total forces and memory, but no force of a contact."""
    sim = pile()
    sim.run(5)
    save(sim, tmp_path / "c.h5")
    sim.remove(sim.grains.id.copy())
    restore(sim, tmp_path / "c.h5")
    sim.prepare()
    with pytest.raises(
        SceneError, match=r"step 5: the contacts are not computed yet, since the state was restored.*; run a step first"
    ):
        measure(sim)
    sim.run(1)
    measure(sim)


def test_same_bits_for_any_number_of_ranks_and_nothing_changed():
    def measured(sim):
        return [vars(measure.compute(sim)) for measure in (EnergyBudget(0.5), ContactStatistics(), KineticEnergy())]

    def program():
        sim = pile(110)
        sim.run(40)
        return [list(map(str, found.items())) for found in measured(sim)]

    alone = program()
    assert virtual_ranks(3, program) == [alone] * 3

    watched, plain = pile(periodic=(False, True, False)), pile(periodic=(False, True, False))
    for _ in range(3):
        watched.run(5)
        plain.run(5)
        measured(watched)
        Front(0.0, 1.0).compute(watched), Profile(3.0, 2.0, 0.5).compute(watched), Jet(6.0, 0.5).compute(watched)
    assert fingerprint(watched) == fingerprint(plain)
