"""Discs, and spheres in a plane: rolling down an incline, head-on and oblique impact, against closed forms with the inertia of
each."""

from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from analytic import linear_contact_time, linear_restitution

import barchan as bc

#: I / (m r^2) of what rolls in the plane.
INERTIA = {"sphere": 0.4, "disc": 0.5}
SHAPES = pytest.mark.parametrize("shape", list(INERTIA))
RADIUS, DENSITY = 0.1, 1000.0


def mass_of(shape):
    return DENSITY * (pi * RADIUS**2 if shape == "disc" else 4.0 / 3.0 * pi * RADIUS**3)


def plane(shape, dt, gravity=(0.0, 0.0, 0.0), **elastic):
    grain = bc.Material("grain", density=DENSITY, **elastic)
    return bc.Simulation(bc.Box((-2, -2), (30, 20)), bc.laws.linear, grain, dt, gravity, threads=1, shape=shape)


@SHAPES
@pytest.mark.parametrize("angle", [10.0, 25.0])
def test_rolling_down_an_incline(shape, angle):
    """Without slip: a = g sin(angle) / (1 + I/(m r^2)), 5/7 g sin(angle) of a sphere, 2/3 of a disc; it turns clockwise by v/r.

    It sinks in by 1e-5 of its radius, which is its arm's error; damped, it has stopped bouncing after a fifth of a second.
    """
    gravity, angle, dt = 9.81, radians(angle), 2e-5
    mass = mass_of(shape)
    stiffness = mass * gravity / (1e-5 * RADIUS)
    rate = sqrt(stiffness / mass)
    elastic = {"kn": stiffness, "kt": 2.0 / 7.0 * stiffness, "gamma_n": rate, "gamma_t": 0.5 * rate, "friction": 0.5}
    sim = plane(shape, dt, (gravity * sin(angle), -gravity * cos(angle), 0.0), **elastic)
    sim.check_dt = False  # it looks at an overlap of 5 %; here it is 0.001 %
    sim.add_wall(bc.Plane((0, 0, 0), (0, 1, 0)))
    sim.add_grains([(0.0, RADIUS * (1.0 - 1e-5 * cos(angle)), 0.0)], RADIUS)
    sim.run(10_000)
    before = sim.grains.velocity[0, 0]
    sim.run(10_000)
    acceleration = (sim.grains.velocity[0, 0] - before) / (10_000 * dt)
    assert acceleration == pytest.approx(gravity * sin(angle) / (1.0 + INERTIA[shape]), rel=1e-4)
    assert acceleration == pytest.approx({"sphere": 5.0 / 7.0, "disc": 2.0 / 3.0}[shape] * gravity * sin(angle), rel=1e-4)
    assert sim.grains.omega[0, 2] * RADIUS == pytest.approx(-sim.grains.velocity[0, 0], rel=1e-4)


@SHAPES
def test_head_on_impact_has_the_restitution_of_the_dashpot(shape):
    """Two equal grains in any direction of the plane; the effective mass is half that of one."""
    mass_eff, direction = 0.5 * mass_of(shape), np.array([0.6, 0.8, 0.0])
    stiffness, rate = 1e6 * mass_eff, 400.0
    time = linear_contact_time(stiffness, mass_eff, rate)
    sim = plane(shape, time / 4000, kn=stiffness, kt=stiffness, gamma_n=rate, gamma_t=rate, friction=0.5)
    place = np.array([5.0, 5.0, 0.0])
    sim.add_grains([place - RADIUS * direction, place + RADIUS * direction], RADIUS, velocity=[direction, -direction])
    sim.prepare()
    sim.run(4400)
    away = sim.grains.sorted_by_id("velocity") @ direction
    restitution = linear_restitution(stiffness, mass_eff, rate)
    assert sim.touching == 0 and away == pytest.approx([-restitution, restitution], rel=5e-3) and 0.5 < restitution < 0.9
    assert np.abs(sim.grains.omega).max() < 1e-10


@SHAPES
def test_oblique_impact_that_slides_throughout(shape):
    """On a wall: friction gives mu (1 + e) v_n along it, and of the same impulse the spin mu (1 + e) v_n m r / I."""
    friction, normal, tangential = 0.2, 1.0, 3.0
    mass = mass_of(shape)
    stiffness = 1e7 * mass
    time = linear_contact_time(stiffness, mass)
    sim = plane(shape, time / 2000, kn=stiffness, kt=stiffness, friction=friction)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 1, 0)))
    sim.add_grains([(0.0, RADIUS, 0.0)], RADIUS, velocity=[(tangential, -normal, 0.0)])
    sim.run(2200)
    impulse = 2.0 * friction * normal
    assert sim.touching == 0
    assert sim.grains.velocity[0] == pytest.approx([tangential - impulse, normal, 0.0], rel=2e-3)
    assert sim.grains.omega[0, 2] * RADIUS == pytest.approx(-impulse / INERTIA[shape], rel=5e-3)  # the arm is r less the overlap


@SHAPES
def test_oblique_impact_keeps_the_momenta(shape):
    """Two grains that stick and slide in turn: momentum and angular momentum about any point, of orbit and spin."""
    mass = mass_of(shape)
    stiffness = 1e6 * mass
    sim = plane(shape, 2e-5, kn=stiffness, kt=0.3 * stiffness, gamma_n=100.0, gamma_t=50.0, friction=0.4)
    sim.add_grains(
        [(5.0, 5.0, 0.0), (5.15, 5.1333, 0.0)],
        RADIUS,
        velocity=[(1.0, 0.4, 0.0), (-0.7, 0.2, 0.0)],
        omega=[(0, 0, 5.0), (0, 0, -1.0)],
    )
    sim.prepare()

    def angular():
        p, v, w = (sim.grains.sorted_by_id(name) for name in ("position", "velocity", "omega"))
        half = p - 0.5 * sim.dt * v
        return (mass * np.cross(half, v)[:, 2] + INERTIA[shape] * mass * RADIUS**2 * w[:, 2]).sum()

    momentum, before, spin = sim.grains.velocity.sum(axis=0), angular(), sim.grains.sorted_by_id("omega")[:, 2]
    sim.run(2000)
    assert np.abs(sim.grains.sorted_by_id("omega")[:, 2] - spin).min() > 0.1, "friction acted"
    assert sim.touching == 0 and sim.grains.velocity.sum(axis=0) == pytest.approx(momentum, abs=1e-12)
    assert angular() == pytest.approx(before, rel=2e-3)
