"""Momentum of a free cloud of colliding grains, every law from which others are made.

The leap-frog changes v(n-1/2) into v(n+1/2) by forces at step n, and x(n) into x(n+1) by v(n+1/2). So
P = sum m v(n-1/2) changes by pair forces that cancel, and
L = sum m x(n) x v(n-1/2) + I omega(n-1/2)
changes by dt sum (x(n) x F(n) + T(n)) in the kick and not at all in the drift, since v x v = 0: it is the discrete angular
momentum that can be kept exactly. A contact adds dt [(x_i - x_j) x F + T_i + T_j] = dt (r - a_i - a_j) n x F_t to it, with the
torque arms a. Arms to the plane of contact add up to the distance r: nothing. Equation (10)'s arms, the radii, add up to
r + overlap: each contact adds -dt overlap n x F_t. Couples are equal and opposite: they add nothing.
"""

import numpy as np
import pytest
from impacts import BASIC_LAWS

import barchan as bc
from barchan.measure import contact_table

ROLLING = [bc.laws.hertz_mindlin_rolling, bc.laws.hertz_mindlin_constant_rolling]
ALL_LAWS = pytest.mark.parametrize("law", [*BASIC_LAWS, *ROLLING, bc.laws.dmt, bc.laws.jkr], ids=lambda law: law.name)

STEPS = 800


def cloud(law):
    """64 grains of radii 0.3 to 0.7 on a loose lattice, thrown inwards with random spins; two materials."""
    random = np.random.default_rng(7)
    cells = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) - 1.5
    position = 1.5 * cells + random.uniform(-0.04, 0.04, (64, 3)) + (7.0, 8.0, 9.0)
    velocity = -1.5 * cells + random.normal(0.0, 1.0, (64, 3)) + (0.3, 0.2, 0.1)
    if "youngs_modulus" in law.properties:
        elastic = {"youngs_modulus": 1e5, "poisson_ratio": 0.3, "restitution": 0.8}
        elastic |= {"work_of_adhesion": 3.0} if law.adhesive else {}
        elastic |= {"rolling_friction": 0.2, "twisting_friction": 0.1} if law in ROLLING else {}
    else:
        stiffness = 1e4 if law.name.startswith("linear") else 3e4
        elastic = {"kn": stiffness, "kt": 0.3 * stiffness, "gamma_n": 5.0, "gamma_t": 3.0}
    materials = [bc.Material(name, density=rho, friction=0.5, **elastic) for name, rho in (("light", 1.0), ("heavy", 3.0))]
    sim = bc.Simulation(bc.Box((-20.0, -20.0, -20.0), (40.0, 40.0, 40.0)), law, materials, 5e-4, threads=1)
    for number, name in enumerate(("light", "heavy")):
        rows = slice(number, None, 2)
        radius = random.uniform(0.3, 0.7, 32)
        sim.add_grains(position[rows], radius, name, velocity[rows], random.normal(0.0, 3.0, (32, 3)))
    return sim


def momentum(sim):
    """Momentum and the discrete angular momentum, and the sums of sizes that set the scale of rounding."""
    grains = sim.grains
    mass, inertia = grains.view("mass")[:, None], grains.view("inertia")[:, None]
    linear = mass * grains.view("velocity")
    angular = np.cross(grains.view("position"), linear) + inertia * grains.view("omega")
    return linear.sum(axis=0), angular.sum(axis=0), np.abs(linear).sum(), np.abs(angular).sum()


def expected_torque(sim):
    """What the contacts of this step add to L per time by equation (10)'s arms: sum of -overlap n x F; and their number."""
    table = contact_table(sim)
    position = sim.grains.sorted_by_id("position")
    branch = position[table["first"]] - position[table["second"]]
    normal = branch / np.sqrt((branch**2).sum(axis=1))[:, None]
    return -(table["overlap"][:, None] * np.cross(normal, table["force"])).sum(axis=0), len(table["first"])


@ALL_LAWS
def test_momentum_of_a_free_cloud(law):
    """800 steps of a cloud that collides with itself. Momentum stays to rounding. Angular momentum does too with arms to the
    plane of contact (``lens``); with equation (10)'s arms (``radius``) it drifts by the closed form above, step by step."""
    sim = cloud(law)
    sim.prepare()
    first_linear, before, _, _ = momentum(sim)
    first_angular, drift, contacts = before, np.zeros(3), 0
    for _ in range(STEPS):
        torque, touching = expected_torque(sim)
        sim.step()
        linear, angular, linear_scale, angular_scale = momentum(sim)
        change = sim.dt * torque if law.lever == "radius" else 0.0
        np.testing.assert_allclose(linear, first_linear, rtol=0.0, atol=1e-14 * linear_scale)
        np.testing.assert_allclose(angular - before, change, rtol=0.0, atol=1e-14 * angular_scale)
        before, drift, contacts = angular, drift + change, contacts + touching
    np.testing.assert_allclose(angular - first_angular, drift, rtol=0.0, atol=1e-13 * angular_scale)
    assert contacts > 2000, f"only {contacts} contacts in all steps"
    assert (law.lever == "lens") == (np.abs(drift).max() < 1e-9 * angular_scale)
