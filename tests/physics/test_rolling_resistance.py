"""Resistance to rolling and twisting, against closed forms: a sphere of radius R on a plane, which its weight presses with F_n.

Rolling with the couple M against it, m v' = -f and I omega' = f R - M with v = R omega: v' = -M / (7/5 m R), so that the
couple's limit mu_r R F_n slows a sphere on a level plane by 5/7 mu_r g. It holds the sphere on an incline up to tan = mu_r.
Twisting, I omega' = -mu_t R F_n: omega' = -5/2 mu_t g / R.
"""

from math import atan, cos, pi, sin

import numpy as np
import pytest
from impacts import Impacts

import barchan as bc
from barchan.laws.rolling import rolling_couple
from barchan.laws.vector import scale

RADIUS, DENSITY, GRAVITY, DT, POISSON = 0.1, 1000.0, 9.81, 2e-5, 0.3
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY
WEIGHT = MASS * GRAVITY

#: The sphere sinks in by 1.5e-5 of its radius: F = 4/3 E* sqrt(R) depth^1.5.
DEPTH = 1.5e-5 * RADIUS
MODULUS = WEIGHT / (4.0 / 3.0 * RADIUS**0.5 * DEPTH**1.5) * 2.0 * (1.0 - POISSON**2)

SPRING, CONSTANT = bc.laws.hertz_mindlin_rolling, bc.laws.hertz_mindlin_constant_rolling
BOTH = pytest.mark.parametrize("law", [SPRING, CONSTANT], ids=lambda law: law.name)


def material(name, friction=0.8, restitution=0.3, **more):
    elastic = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "restitution": restitution}
    return bc.Material(name, density=DENSITY, friction=friction, **elastic, **more)


def spheres_on_plane(law, resistances, incline=0.0, speed=0.0, spin=(0.0, 0.0, 0.0)):
    """Spheres that rest on the plane z = 0, lots along y, each with rolling and twisting friction of its own."""
    materials = [material(f"mu {mu}", rolling_friction=mu, twisting_friction=mu) for mu in resistances]
    box = bc.Box((-5.0, -1.0, -1.0), (5.0, 0.5 * len(resistances) + 1.0, 1.0))
    gravity = (GRAVITY * sin(incline), 0.0, -GRAVITY * cos(incline))
    plane = material("plane", rolling_friction=1.0, twisting_friction=1.0)
    sim = bc.Simulation(box, law, [*materials, plane], DT, gravity, threads=1)
    for mu in resistances:
        sim.materials.set_pair(f"mu {mu}", "plane", rolling_friction=mu, twisting_friction=mu)
    sim.check_dt = False  # it looks at an overlap of 5 %; here it is 0.001 %, and softer by far
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), material="plane"))
    height = RADIUS - DEPTH * cos(incline) ** (2.0 / 3.0)
    for number, m in enumerate(materials):
        sim.add_grains([(0.0, 0.5 * number, height)], RADIUS, m.name, velocity=(speed, 0.0, 0.0), omega=spin)
    return sim


def after(sim, steps, field, axis):
    sim.run(steps)
    return sim.grains.sorted_by_id(field)[:, axis]


@BOTH
def test_a_rolling_sphere_slows_by_five_sevenths_of_mu_g(law):
    """mu_r 0.02, 0.05, 0.1, set rolling at 0.5 m/s: within 0.1 %, and u = R omega within 1e-4."""
    resistances = np.array([0.02, 0.05, 0.1])
    sim = spheres_on_plane(law, resistances, speed=0.5, spin=(0.0, 0.5 / RADIUS, 0.0))
    early, late = after(sim, 5000, "velocity", 0), after(sim, 15000, "velocity", 0)
    np.testing.assert_allclose((early - late) / (15000 * DT), 5.0 / 7.0 * resistances * GRAVITY, rtol=1e-3)
    np.testing.assert_allclose(RADIUS * sim.grains.sorted_by_id("omega")[:, 1], late, atol=1e-4)


@BOTH
def test_a_rolling_sphere_stops_and_stays(law):
    """mu_r 0.1 and 0.2, rolling at 0.2 m/s: it stops after v / (5/7 mu_r g) = 0.29 and 0.14 s, where v^2 / 2 of that takes it,
    within 1 %, and does not move any more."""
    resistances = np.array([0.1, 0.2])
    slowing = 5.0 / 7.0 * resistances * GRAVITY
    sim = spheres_on_plane(law, resistances, speed=0.2, spin=(0.0, 0.2 / RADIUS, 0.0))
    place = after(sim, 25000, "position", 0)
    np.testing.assert_allclose(place, 0.02 / slowing, rtol=0.01)
    assert np.abs(after(sim, 5000, "velocity", 0)).max() < 1e-9
    np.testing.assert_allclose(sim.grains.sorted_by_id("position")[:, 0], place, rtol=0.0, atol=1e-9)


def test_the_spring_holds_a_sphere_on_an_incline():
    """Incline of tan = 0.1: with mu_r = 0.101 the sphere stays, with 0.099 and 0.05 it rolls down at 5/7 g (sin - mu_r cos)
    within 2e-5 g: the torque's arm is shorter than R by the depth."""
    angle = atan(0.1)
    sim = spheres_on_plane(SPRING, [0.101, 0.099, 0.05], incline=angle)
    early, late = after(sim, 20000, "velocity", 0), after(sim, 20000, "velocity", 0)
    rolls = 5.0 / 7.0 * GRAVITY * (sin(angle) - np.array([0.099, 0.05]) * cos(angle))
    np.testing.assert_allclose((late - early)[1:] / (20000 * DT), rolls, rtol=0.0, atol=2e-5 * GRAVITY)
    assert abs(late[0]) < 1e-9


@BOTH
def test_spin_about_the_normal_slows_linearly(law):
    """mu_t 0.05 and 0.1, spin 20 /s: omega = omega_0 - 5/2 mu_t g / R t within 0.1 %, then rest; the wall feels the couple."""
    frictions = np.array([0.05, 0.1])
    sim = spheres_on_plane(law, frictions, spin=(0.0, 0.0, 20.0))
    slowing = 2.5 * frictions * GRAVITY / RADIUS
    early, late = after(sim, 5000, "omega", 2), after(sim, 25000, "omega", 2)
    np.testing.assert_allclose((early - late) / (25000 * DT), slowing, rtol=1e-3)
    np.testing.assert_allclose(early, 20.0 - slowing * 5000 * DT, rtol=1e-3)
    torque = frictions * RADIUS * WEIGHT
    np.testing.assert_allclose(sim.grains.sorted_by_id("torque")[:, 2], -torque, rtol=1e-6)
    assert sim.walls[0].load.torque[2] == pytest.approx(torque.sum(), rel=1e-6)
    assert np.abs(after(sim, 80000, "omega", 2)).max() < 1e-9


def test_stiffness_of_the_spring():
    """A sphere on the plane is turned about the contact by a small angle: the couple is 9/4 k_n (mu_r R)^2 times the angle, the
    secant stiffness k_n = F_n / depth; likewise about the normal."""
    sim = spheres_on_plane(SPRING, [0.3], spin=(0.0, 1e-6 / RADIUS, 1e-6 / RADIUS))
    sim.grains.velocity = (1e-6, 0.0, 0.0)
    sim.run(1)
    stiffness = 2.25 * WEIGHT / DEPTH * (0.3 * RADIUS) ** 2
    *_, rolled, _, twisted = bc.measure.contact_table(sim)["memory"][0][2:]
    np.testing.assert_allclose((rolled, twisted), -stiffness * sim.grains.omega[0, 1:] * DT, rtol=1e-6)


def test_the_couple_turns_with_the_contact():
    """A contact that turns rigidly by 90 degrees in steps of 3 keeps the size of its couple, which stays in the plane."""
    rolled = (0.0, 3e-5, 4e-5)
    for angle in np.radians(3.0 * np.arange(1, 31)):
        normal, half = ((np.cos(a), np.sin(a), 0.0) for a in (angle, angle - np.radians(1.5)))
        couple, rolled = rolling_couple(rolled, (0.0, 0.0, 0.0), normal, half, 1e-3, 1.0, 7.0, 0.2)
    np.testing.assert_allclose(rolled, (-3e-5, 0.0, 4e-5), rtol=0.03, atol=1e-18)
    assert couple == rolled and np.linalg.norm(rolled) == pytest.approx(5e-5, rel=1e-12)


def impacts(law, resistance, partner, restitution):
    """Impacts at 5 to 85 degrees of spheres that spin about all axes."""
    angles = np.radians(np.arange(5.0, 86.0, 5.0))
    velocity = np.stack([-np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    spins = np.outer(np.ones(len(angles)), (3.0, -5.0, 4.0)) / RADIUS
    options = {"restitution": restitution, "friction": 0.5}
    if resistance:
        options |= {"rolling_friction": resistance, "twisting_friction": resistance}
    one = [material("one", **options)]
    if partner == "plane":
        return Impacts(law, one, 1e-6, RADIUS, "one", velocity, spins, wall="one")
    second = {"radius": 0.6 * RADIUS, "material": "one", "velocity": -0.5 * velocity}
    return Impacts(law, one, 1e-6, RADIUS, "one", 0.5 * velocity, spins, second=second)


@pytest.mark.parametrize("partner", ["plane", "grain"])
@BOTH
def test_impact_creates_no_energy_and_loses_more_with_resistance(law, partner):
    """Elastic and damped impacts at all angles with spin about all axes: nothing is gained beyond 1e-6 of it; resistance takes
    energy."""
    for restitution in (1.0, 0.7):
        left = {}
        for resistance in (0.0, 0.05, 0.5):
            run = impacts(law, resistance, partner, restitution)
            before = run.kinetic_energy()
            run.run_until_apart(4000)
            left[resistance] = run.kinetic_energy() / before
        assert max(ratio.max() for ratio in left.values()) <= 1.0 + 1e-6
        assert (left[0.05] < left[0.0] - 1e-5).all()


@BOTH
def test_without_resistance_the_bits_are_those_of_hertz_mindlin(law):
    own, other = (impacts(which, 0.0, "grain", 0.7) for which in (law, bc.laws.hertz_mindlin))
    for run in (own, other):
        run.sim.run(400)
    for name in ("position", "velocity", "omega", "force", "torque"):
        np.testing.assert_array_equal(own.sim.grains.sorted_by_id(name), other.sim.grains.sorted_by_id(name))


def test_a_law_of_ones_own_has_a_couple():
    """The couple turns the first grain, and its opposite the second, beside the torque of the tangential force."""

    @bc.law(properties={"kn": "force/length"}, couple=True)
    def winds(overlap, normal, relative_omega, kn):
        return kn * overlap, (0.0, 0.0, 0.0), scale(kn * overlap, relative_omega)

    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), winds, bc.Material("m", density=1.0, kn=10.0), 1e-4, threads=1)
    sim.add_grains([(4.0, 4.0, 4.0), (5.9, 4.0, 4.0)], 1.0, omega=[(1.0, 2.0, 3.0), (0.5, 0.0, -1.0)])
    sim.prepare()
    np.testing.assert_allclose(sim.grains.torque, [(0.5, 2.0, 4.0), (-0.5, -2.0, -4.0)], rtol=1e-12)
