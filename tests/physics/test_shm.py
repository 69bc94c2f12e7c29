"""Hertz-Mindlin without a dashpot: the formulas of Marketos et al. 2013, and the very bits of ``hertz_mindlin``."""

from math import sqrt

import numpy as np
import pytest

import barchan as bc

SHEAR, POISSON, FRICTION = 1e7, 0.2, 0.4
ELASTIC = {"shear_modulus": SHEAR, "poisson_ratio": POISSON, "friction": FRICTION}
RADIUS_EFF, OVERLAP, DT = 0.3, 1e-3, 1e-4
A = sqrt(RADIUS_EFF * OVERLAP)


def contact(slip, shear=(0.0, 0.0, 0.0)):
    """The law on a contact of one material that slips along y."""
    law = bc.laws.shm
    parameters = bc.Material("m", **ELASTIC).properties
    values = {
        "overlap": OVERLAP,
        "normal": (1.0, 0.0, 0.0),
        "normal_half": (1.0, 0.0, 0.0),
        "normal_velocity": -0.3,
        "tangential_velocity": (0.0, slip, 0.0),
        "slip_velocity_half": (0.0, slip, 0.0),
        "radius_eff": RADIUS_EFF,
        "mass_eff": 2.0,
        "dt": DT,
        "shear": shear,
    }
    return law(**values, **dict(zip(law.parameters, law.pair_parameters(parameters, parameters, "here"))))


def test_forces_are_those_of_the_source():
    """F_n = 4 G / (3 (1 - nu)) a overlap whatever the velocity; dF_s = -4 G / (2 - nu) a u dt, and at most mu F_n."""
    normal_force = 4.0 * SHEAR / (3.0 * (1.0 - POISSON)) * A * OVERLAP
    increment = -4.0 * SHEAR / (2.0 - POISSON) * A * 0.1 * DT
    pressing, tangential, shear = contact(slip=0.1, shear=(0.0, 1.0, 0.5))
    assert pressing == pytest.approx(normal_force, rel=1e-14)
    assert tangential == shear == pytest.approx((0.0, 1.0 + increment, 0.5), rel=1e-14)
    _, sliding, shear = contact(slip=1e6)
    assert sliding == shear == pytest.approx((0.0, -FRICTION * normal_force, 0.0), rel=1e-14)


def collide(law, **more):
    """State after an oblique collision of three grains of two materials with each other and a wall."""
    materials = [bc.Material(n, density=d, **ELASTIC, **more) for n, d in (("a", 1000.0), ("b", 2500.0))]
    sim = bc.Simulation(bc.Box((-2.0, -2.0, 0.0), (2.0, 2.0, 4.0)), law, materials, DT, threads=1)
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), material="b"))
    sim.add_grains([(0.0, 0.0, 0.301), (0.55, 0.0, 0.7)], 0.3, "a", velocity=[(0.5, 0.2, -1.0), (-0.5, 0.3, -0.4)])
    sim.add_grains([(-0.4, 0.2, 0.8)], 0.4, "b", omega=[(1.0, 5.0, -3.0)])
    touched = 0
    sim.prepare()
    for _ in range(1500):
        sim.step()
        touched += sim.touching
    assert touched > 500
    return [sim.grains.sorted_by_id(name) for name in ("position", "velocity", "omega", "force", "torque")]


def test_bits_are_those_of_hertz_mindlin_with_restitution_one():
    for own, other in zip(collide(bc.laws.shm), collide(bc.laws.hertz_mindlin, restitution=1.0)):
        np.testing.assert_array_equal(own, other)


def test_there_is_no_restitution_to_give():
    with pytest.raises(bc.BarchanError, match="law 'shm' knows no property 'restitution'"):
        collide(bc.laws.shm, restitution=1.0)
