"""Adhesion of Johnson, Kendall and Roberts: the curve of force over overlap, pull-off, where contacts begin and end, energy."""

from math import pi, sqrt

import numpy as np
import pytest
from impacts import Impacts

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import LawError
from barchan.laws.jkr import reach, root_of_contact_radius
from barchan.measure import EnergyAccount
from barchan.parallel import virtual_ranks

RADII, DENSITY, MODULUS, POISSON, FRICTION, WORK, DT = (0.3, 0.5), 1.0, 1e5, 0.3, 0.4, 50.0, 1e-4
RADIUS_EFF = RADII[0] * RADII[1] / sum(RADII)
MODULUS_EFF = MODULUS / (2.0 * (1.0 - POISSON**2))
ADHESION = sqrt(2.0 * pi * WORK / MODULUS_EFF)


def pull(radius_eff):
    """1.5 pi w R*."""
    return 1.5 * pi * WORK * radius_eff


def end(radius_eff):
    """How far apart a contact ends, as numbers.md and the paper have it."""
    return 0.75 * (pi**2 * WORK**2 * radius_eff / MODULUS_EFF**2) ** (1.0 / 3.0)


def bisect(function, low, high):
    """Where ``function`` grows through 0."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if function(middle) > 0.0 else (middle, high)
    return low


def radius_of(overlap, radius_eff):
    """Contact radius, by bisection of overlap = a^2 / R* - sqrt(2 pi w a / E*) above its turning point."""

    def error(a):
        return a * a / radius_eff - sqrt(2.0 * pi * WORK * a / MODULUS_EFF) - overlap

    turning = (pi * WORK * radius_eff**2 / (8.0 * MODULUS_EFF)) ** (1.0 / 3.0)
    return bisect(error, turning, 10.0 * (turning + sqrt(radius_eff * abs(overlap))))


def force_at(overlap, radius_eff):
    """4 E* a^3 / (3 R*) - sqrt(8 pi w E* a^3)."""
    a = radius_of(overlap, radius_eff)
    return 4.0 * MODULUS_EFF * a**3 / (3.0 * radius_eff) - sqrt(8.0 * pi * WORK * MODULUS_EFF * a**3)


def material(**more):
    values = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "friction": FRICTION, "restitution": 0.5} | more
    return bc.Material("m", **{"density": DENSITY, "work_of_adhesion": WORK} | values)


def pair(overlap, dt=DT, **held):
    """Two grains along x that overlap, of which the first has the radius 0.3."""
    sim = bc.Simulation(bc.Box((-3.0,) * 3, (3.0,) * 3), bc.laws.jkr, material(), dt, threads=1)
    sim.max_overlap = 0.5
    sim.add_grains([(0.0, 0.0, 0.0)], RADII[0], **held)
    sim.add_grains([(sum(RADII) - overlap, 0.0, 0.0)], RADII[1])
    return sim


def test_contact_radius_is_the_larger_root_of_the_curve():
    overlaps = [*(-end(RADIUS_EFF) * np.array([0.999, 0.9, 0.5, 1e-3])), 1e-6, 0.01, 0.1]
    for overlap in overlaps:
        found = root_of_contact_radius(overlap, RADIUS_EFF, ADHESION) ** 2
        assert found == pytest.approx(radius_of(overlap, RADIUS_EFF), rel=1e-12)
    assert reach(RADIUS_EFF, ADHESION) == pytest.approx(end(RADIUS_EFF), rel=1e-14)


@pytest.mark.parametrize("overlap", [0.1, 0.03, 0.003, 1e-9])
def test_force_in_closed_form(overlap):
    """From the compiled loop, at rest."""
    sim = pair(overlap)
    sim.prepare()
    assert -sim.grains.sorted_by_id("force")[0, 0] == pytest.approx(force_at(overlap, RADIUS_EFF), rel=1e-9)


def test_slowly_pulled_apart_it_draws_the_whole_curve():
    """Force over overlap until the contact ends, with 5/9 of the largest pull, 1.5 pi w R*."""
    sim = pair(0.01, dt=1e-5, frozen=True)
    sim.materials.list[0] = material(restitution=1.0)
    speed, overlaps, forces = 0.05, [], []
    sim.grains.velocity = [(0.0, 0.0, 0.0), (speed, 0.0, 0.0)]
    sim.release(1)
    sim.grains.mass[1] = 1e9
    while True:
        sim.run(10)
        if not sim.touching:
            break
        place = sim.grains.sorted_by_id("position")[:, 0]
        overlaps.append(sum(RADII) - (place[1] - place[0]))
        forces.append(sim.grains.sorted_by_id("force")[1, 0])
    expected = [force_at(overlap, RADIUS_EFF) for overlap in overlaps]
    np.testing.assert_allclose(forces, expected, rtol=1e-6, atol=1e-6 * pull(RADIUS_EFF))
    assert -min(forces) == pytest.approx(pull(RADIUS_EFF), rel=1e-4)
    assert overlaps[-1] == pytest.approx(-end(RADIUS_EFF), abs=11 * speed * 1e-5)
    assert forces[-1] == pytest.approx(-5.0 / 9.0 * pull(RADIUS_EFF), rel=0.06)


def test_a_contact_begins_where_grains_touch():
    """Not before, however near: no force at half the reach, 8/9 of the pull-off force at overlap 0."""
    sim = pair(-0.5 * end(RADIUS_EFF))
    sim.run(10)
    assert sim.touching == 0 and not sim.grains.force.any()
    assert force_at(0.0, RADIUS_EFF) == pytest.approx(-8.0 / 9.0 * pull(RADIUS_EFF))
    near = bc.Simulation(bc.Box((-3,) * 3, (3,) * 3), bc.laws.jkr, material(), DT, threads=1)
    near.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    near.add_grains([(0, 0, RADII[0] + 0.5 * end(RADII[0]))], RADII[0])
    near.run(10)
    assert near.touching == 0 and not near.grains.force.any()


def test_a_contact_that_has_ended_stays_so():
    """Drawn over its reach and brought back to half of it."""
    sim = pair(0.0, velocity=(0.0, 0.0, 0.0))
    sim.grains.position[0, 0] = 1e-3
    sim.run(1)
    for apart, touching in ((0.9, 1), (1.1, 0), (0.5, 0), (-0.1, 1)):
        sim.grains.velocity = 0.0
        sim.grains.position[0, 0] = -apart * end(RADIUS_EFF)
        sim.prepare()
        assert sim.touching == touching, apart


WALLS = {
    "plane": (0.0, lambda: bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))),
    "in a sphere": (-0.5, lambda: bc.Sphere((0.0, 0.0, -2.0), 2.0)),
    "in a narrow sphere": (-1.0 / 0.35, lambda: bc.Sphere((0.0, 0.0, -0.35), 0.35)),
    "on a sphere": (1.0, lambda: bc.Sphere((0.0, 0.0, 1.0), 1.0, inside=False)),
}


def load_at(time):
    """Weight over pull-off force."""
    return 1.94 * time if time < 0.5 else 0.97 + 0.01 * (time - 0.5)


def hanging(where, **options):
    """A grain of radius 0.3 at a wall above it, and its pull-off force there; its weight grows to 0.97 of that in 0.5 s, and by a
    hundredth of it in every second after."""
    curvature, wall = WALLS[where]
    largest = pull(RADII[0] / (1.0 + curvature * RADII[0]))
    mass = 4.0 / 3.0 * pi * RADII[0] ** 3 * DENSITY

    def gravity(time):
        return 0.0, 0.0, -largest / mass * load_at(time)

    sim = bc.Simulation(bc.Box((-3,) * 3, (3,) * 3), bc.laws.jkr, material(restitution=0.1), DT, gravity, **options)
    sim.max_overlap = 0.5
    sim.add_wall(wall())
    sim.add_grains([(0.0, 0.0, 1e-6 - RADII[0])], RADII[0])
    return sim


@pytest.mark.parametrize("where", WALLS)
def test_pull_off_force(where):
    """Under a load that grows it lets go at 1.5 pi w R*, within what the load grows by while the grain leaves."""
    sim = hanging(where, threads=1)
    while sim.touching or not sim.step_number:
        sim.run(20)
    assert load_at(sim.time) == pytest.approx(1.0, abs=0.01)


def test_a_contact_at_a_wall_outlasts_rebuilds_and_a_resume(tmp_path):
    """Apart but held: the same bits with a rebuild in every step, and from a checkpoint of that time."""
    plain, rebuilt, resumed = (hanging("in a narrow sphere", threads=1) for _ in range(3))
    plain.run(9800)
    assert plain.touching == 1 and sim_gap(plain) > 0.0
    save(plain, tmp_path / "held.h5")
    rebuilt.staleness.also_when = lambda step: True
    rebuilt.run(9900)
    plain.run(100)
    resumed.remove([0])
    restore(resumed, tmp_path / "held.h5")
    resumed.run(100)
    assert differences(collect(plain), collect(rebuilt)) == []
    assert differences(collect(plain), collect(resumed)) == []


def test_a_contact_is_held_across_the_border_of_two_ranks():
    """Two equal grains, one at the border, are drawn apart to 9/10 of their reach, with a skin a hundredth of it."""

    def drawn_apart():
        heavy = material(density=1e12)
        sim = bc.Simulation(bc.Box((-3,) * 3, (3,) * 3), bc.laws.jkr, heavy, DT, threads=1)
        sim.skin, sim.staleness.also_when = 0.01 * end(0.25), lambda step: True
        sim.add_grains([(-1e-6, 0, 0), (0.9998, 0, 0)], 0.5, velocity=[(0, 0, 0), (0.1, 0, 0)])
        sim.run(round((0.9 * end(0.25) + 0.0002) / (0.1 * DT)))
        return int(sim.comm.sum([sim.touching])[0]), sim.grains.n

    assert drawn_apart() == (1, 2)
    assert virtual_ranks(2, drawn_apart) == [(1, 1), (1, 1)]


def sim_gap(sim):
    """Between the grain and its only wall [length]."""
    return float(sim.contacts.surface[0, 0] - RADII[0])


def rebound(work, speed, restitution, dt=DT):
    """Speed of rebound of two spheres over that of approach."""
    second = {"radius": RADII[1], "material": "m", "velocity": (0.5 * speed, 0.0, 0.0)}
    made = [material(work_of_adhesion=work, restitution=restitution)]
    run = Impacts(bc.laws.jkr, made, dt, RADII[0], "m", [(-0.5 * speed, 0.0, 0.0)], second=second)
    run.run_until_apart(int(2.0 / dt))
    return (run.get("velocity") - run.get("velocity", "second"))[0, 0] / speed


def work_of_parting():
    """What is drawn out between overlap 0 and the end of a contact."""
    apart = np.linspace(-end(RADIUS_EFF), 0.0, 2001)
    return -float(np.trapezoid([force_at(d, RADIUS_EFF) for d in apart], apart))


def test_an_elastic_impact_loses_the_work_of_parting():
    """What is drawn out between overlap 0 and the end, since a contact begins at 0 and ends beyond it. (Johnson & Pollock, J.
    Adhes. Sci. Technol. 8, 1323, 1994, have 7.09 (w^5 R*^4 / E*^2)^(1/3) with their jump.)"""
    mass = [4.0 / 3.0 * pi * r**3 * DENSITY for r in RADII]
    mass_eff, speed = mass[0] * mass[1] / sum(mass), 4.0
    expected = sqrt(1.0 - work_of_parting() / (0.5 * mass_eff * speed**2))
    assert expected < 0.99
    assert rebound(WORK, speed, 1.0, 1e-5) == pytest.approx(expected, abs=1e-3)
    assert rebound(0.0, speed, 1.0, 1e-5) == pytest.approx(1.0, abs=1e-5)
    with pytest.raises(AssertionError, match="still touch"):
        rebound(WORK, 0.1 * speed * sqrt(1.0 - expected**2), 1.0)


def test_the_energy_account_knows_what_parting_takes():
    """Of an elastic impact it is all that is gone."""
    sim = pair(-1e-3, dt=1e-5, velocity=(4.0, 0.0, 0.0))
    sim.materials.list[0] = material(restitution=1.0)
    sim.writers.append(EnergyAccount())
    sim.run(10)
    while sim.touching or sim.time < 0.01:
        sim.run(100)
    found = sim.writers[0].compute(sim)
    assert found.parting == pytest.approx(work_of_parting(), rel=5e-3) and found.elastic == 0.0  # O(dt): the force jumps


def test_without_adhesion_it_is_hertz_mindlin():
    values = {"overlap": 0.01, "normal": (1.0, 0.0, 0.0), "normal_half": (1.0, 0.0, 0.0), "normal_velocity": 0.3}
    values |= dict.fromkeys(("tangential_velocity", "slip_velocity_half"), (0.0, 0.2, -0.1)) | {"shear": (0.0, 20.0, 0.0)}
    values |= {"radius_eff": RADIUS_EFF, "mass_eff": 0.1, "dt": DT}
    found = []
    for law in (bc.laws.jkr, bc.laws.hertz_mindlin):
        properties = {name: value for name, value in material(work_of_adhesion=0.0).properties.items() if name in law.properties}
        found.append(law(**values, **dict(zip(law.parameters, law.pair_parameters(properties, properties, "here")))))
    np.testing.assert_allclose(np.hstack(found[0]), np.hstack(found[1]), rtol=1e-12)


def test_friction_of_a_contact_that_carries_nothing():
    """mu times twice the pull-off force, where the normal force is 0 (Thornton)."""
    law, one = bc.laws.jkr, material().properties
    overlap = bisect(lambda d: force_at(d, RADIUS_EFF), 1e-9, 0.1)
    values = dict.fromkeys(("tangential_velocity", "slip_velocity_half"), (0.0, 1e9, 0.0)) | {"shear": (0.0, 0.0, 0.0)}
    values |= {"overlap": overlap, "normal": (1.0, 0.0, 0.0), "normal_half": (1.0, 0.0, 0.0), "normal_velocity": 0.0}
    values |= {"radius_eff": RADIUS_EFF, "mass_eff": 1.0, "dt": DT}
    normal_force, force, _ = law(**values, **dict(zip(law.parameters, law.pair_parameters(one, one, "here"))))
    assert normal_force == pytest.approx(0.0, abs=1e-9 * pull(RADIUS_EFF))
    assert force == pytest.approx((0.0, -FRICTION * 2.0 * pull(RADIUS_EFF), 0.0), rel=1e-9)


def reaching(returned):
    """A law that says so of its reach."""

    def far(radius_eff):
        return returned

    @bc.law(properties={"kn": "force/length"}, history={"count": 1}, reach=far)
    def sticks(overlap, kn, count):
        return kn * overlap, (0.0, 0.0, 0.0), count

    return sticks


@pytest.mark.parametrize("wrong", [-1.0, float("nan"), float("inf")])
def test_a_reach_that_is_no_length_is_refused(wrong):
    sim = bc.Simulation(bc.Box((0,) * 3, (1,) * 3), reaching(wrong), bc.Material("m", density=1.0, kn=1.0), 1e-3)
    sim.add_grains([(0.5, 0.5, 0.5)], 0.1)
    with pytest.raises(LawError, match=r"its reach\(\) is .* must be a finite number >= 0"):
        sim.prepare()
