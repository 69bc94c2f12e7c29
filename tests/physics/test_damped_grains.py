"""Damping of grains as a whole, against closed forms of the leap-frog."""

from math import pi, sqrt

import numpy as np
import pytest
from impacts import advance

import barchan as bc

DT, STEPS, GRAVITY = 1e-3, 200, 9.81


def flying(damping, gravity=(0.0, 0.0, 0.0), velocity=0.0, omega=0.0, frozen=False):
    """Two grains that never meet, of which the second is ten times as heavy."""
    glass = bc.Material("glass", density=1000.0, shear_modulus=1e4, poisson_ratio=0.2, friction=0.5)
    sim = bc.Simulation(bc.Box((-50.0,) * 3, (50.0,) * 3), bc.laws.shm, glass, DT, gravity, threads=1)
    sim.check_dt = False
    sim.add_grains(
        [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)], [0.5, 0.5 * 10.0 ** (1.0 / 3.0)], velocity=velocity, omega=omega, frozen=frozen
    )
    sim.damping = damping
    return sim


@pytest.mark.parametrize("once", [True, False], ids=["many steps in one call", "single steps"])
def test_viscous_damping_takes_its_share_each_step(once):
    """v = v_0 (1 - c dt)^n, for velocity and spin of light and heavy grains alike, to rounding."""
    velocity, omega, rate = np.array([1.0, -2.0, 3.0]), np.array([-4.0, 0.5, 0.0]), 30.0
    sim = flying(bc.Damping(viscous=rate), velocity=velocity, omega=omega)
    sim.prepare()
    sim.run(STEPS) if once else advance(sim, STEPS)
    assert ("steps" in sim.clock.seconds) == once
    left = (1.0 - rate * DT) ** STEPS
    np.testing.assert_allclose(sim.grains.velocity, [left * velocity] * 2, rtol=1e-12)
    np.testing.assert_allclose(sim.grains.omega, [left * omega] * 2, rtol=1e-12)


@pytest.mark.parametrize("once", [True, False], ids=["many steps in one call", "single steps"])
def test_local_damping_makes_gravity_weaker_down_and_stronger_up(once):
    """Thrown up with v_0: v = v_0 - (1 + alpha) g t; let fall with a little speed: v = v_0 - (1 - alpha) g t. Each axis for
    itself, and from rest the first step is not damped."""
    alpha, gravity = 0.7, (GRAVITY, 0.0, -GRAVITY)
    sim = flying(bc.Damping(local=alpha), gravity, velocity=[(0.0, 2.0, 50.0), (-50.0, 0.0, -1e-9)])
    sim.prepare()
    sim.run(STEPS) if once else advance(sim, STEPS)
    t = STEPS * DT
    slow, fast = (1.0 - alpha) * GRAVITY, (1.0 + alpha) * GRAVITY
    expected = [(GRAVITY * DT + slow * (t - DT), 2.0, 50.0 - fast * t), (-50.0 + fast * t, 0.0, -slow * t)]
    np.testing.assert_allclose(sim.grains.sorted_by_id("velocity"), expected, rtol=1e-7)


def test_local_damping_of_torques():
    """A sphere that spins about the normal of its plane, with the couple M of twisting friction against it: omega' grows to
    (1 + alpha) M / I."""
    alpha, radius, mu = 0.5, 0.1, 0.05
    mass = 4.0 / 3.0 * pi * radius**3 * 1000.0
    options = {"youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 0.5, "restitution": 0.3, "twisting_friction": mu}
    law = bc.laws.hertz_mindlin_constant_rolling
    sim = bc.Simulation(
        bc.Box((-1,) * 3, (1,) * 3), law, bc.Material("m", density=1000.0, **options), 2e-5, (0, 0, -GRAVITY), threads=1
    )
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    depth = (mass * GRAVITY / (4.0 / 3.0 * 1e7 / (1.0 - 0.3**2) / 2.0 * sqrt(radius))) ** (2.0 / 3.0)
    sim.add_grains([(0, 0, radius - depth)], radius, omega=(0.0, 0.0, 50.0))
    sim.damping = bc.Damping(local=alpha)
    sim.run(5000)
    early = sim.grains.omega[0, 2]
    sim.run(5000)
    slowing = (early - sim.grains.omega[0, 2]) / (5000 * 2e-5)
    assert slowing == pytest.approx((1.0 + alpha) * 2.5 * mu * GRAVITY / radius, rel=1e-3)


def test_both_act_on_the_force_before_damping():
    """F - alpha |F| sign(v) - c m v; the forces that grains show are those after damping."""
    sim = flying(bc.Damping(local=0.2, viscous=3.0), (0.0, 0.0, -GRAVITY), velocity=(0.0, 0.0, 2.0))
    sim.prepare()
    mass = sim.grains.mass
    np.testing.assert_allclose(sim.grains.force[:, 2], -mass * (GRAVITY * 1.2 + 3.0 * 2.0), rtol=1e-14)


def test_frozen_grains_are_left_alone():
    sim = flying(bc.Damping(local=0.2, viscous=3.0), (0.0, 0.0, -GRAVITY), velocity=(0.0, 0.0, 2.0), frozen=True)
    sim.run(10)
    assert sim.grains.velocity[:, 2].tolist() == [2.0, 2.0]
    np.testing.assert_allclose(sim.grains.force[:, 2], -GRAVITY * sim.grains.mass, rtol=1e-14)


def test_each_swing_of_a_spring_loses_the_same_share():
    """A grain swings about its balance on a linear spring k. On the way in the spring acts as (1 - alpha) k, on the way out as
    (1 + alpha) k, so each swing goes sqrt((1 - alpha) / (1 + alpha)) as far as the one before; within 0.5 %. It ends at rest,
    where the plane carries the weight."""
    alpha, radius, stiffness = 0.7, 0.1, 1e5
    rubber = bc.Material("rubber", density=1000.0, kn=stiffness, kt=stiffness, friction=0.0)
    sim = bc.Simulation(bc.Box((-1,) * 3, (1,) * 3), bc.laws.linear, rubber, 2e-5, (0, 0, -GRAVITY), threads=1)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    weight = 4.0 / 3.0 * pi * radius**3 * 1000.0 * GRAVITY
    balance = radius - weight / stiffness
    sim.add_grains([(0, 0, balance + 0.9 * weight / stiffness)], radius)
    sim.damping = bc.Damping(local=alpha)
    sim.prepare()
    heights, speeds = [balance + 0.9 * weight / stiffness], [-1.0]
    while len(heights) < 6:
        advance(sim, 1)
        speed = sim.grains.sorted_by_id("velocity")[0, 2]
        if speed * speeds[-1] < 0.0:
            heights.append(sim.grains.sorted_by_id("position")[0, 2])
        speeds.append(speed)
    swings = np.abs(np.array(heights) - balance)
    np.testing.assert_allclose(swings[1:] / swings[:-1], sqrt((1.0 - alpha) / (1.0 + alpha)), rtol=5e-3)
    sim.run(50000)
    assert abs(sim.grains.velocity[0, 2]) < 1e-12
    assert sim.walls[0].load.pressing == pytest.approx(weight, rel=1e-9)
