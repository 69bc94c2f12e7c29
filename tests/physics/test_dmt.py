"""Adhesion of Derjaguin, Muller and Toporov: pull-off, overlap at rest, friction of an unloaded contact, energy."""

from math import pi, sqrt

import numpy as np
import pytest
from impacts import Impacts

import barchan as bc

RADII, DENSITY, MODULUS, POISSON, FRICTION, WORK, DT = (0.3, 0.5), 1.0, 1e7, 0.3, 0.4, 50.0, 1e-5
RADIUS_EFF = RADII[0] * RADII[1] / sum(RADII)
MODULUS_EFF = MODULUS / (2.0 * (1.0 - POISSON**2))
PULL = 2.0 * pi * WORK * RADIUS_EFF

#: 4/3 E* sqrt(R*) d^1.5 = 2 pi w R*.
AT_REST = (3.0 * pi * WORK * sqrt(RADIUS_EFF) / (2.0 * MODULUS_EFF)) ** (2.0 / 3.0)


def material(**more):
    values = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "friction": FRICTION, "restitution": 0.5} | more
    return bc.Material("m", **{"density": DENSITY, "work_of_adhesion": WORK} | values)


def pair(overlap, **held):
    """Two grains along x that overlap; the first has the radius 0.3."""
    sim = bc.Simulation(bc.Box((-3.0,) * 3, (3.0,) * 3), bc.laws.dmt, material(), DT, threads=1)
    sim.add_grains([(0.0, 0.0, 0.0)], RADII[0], **held)
    sim.add_grains([(sum(RADII) - overlap, 0.0, 0.0)], RADII[1])
    return sim


def test_two_grains_come_to_rest_at_the_overlap_of_no_force():
    """Put together with no overlap to speak of: the pull draws them in; the dashpot takes the energy."""
    sim = pair(1e-9)
    sim.run(100000)
    distance = np.diff(sim.grains.sorted_by_id("position")[:, 0])[0]
    assert sum(RADII) - distance == pytest.approx(AT_REST, rel=1e-6)


def hangs(load):
    """Whether a grain of radius 0.3 hangs on a ceiling for 0.05 s under a weight of ``load`` times 2 pi w R, put where it
    would rest if the pull were a hundredth stronger."""
    mass, pull = 4.0 / 3.0 * pi * RADII[0] ** 3 * DENSITY, 2.0 * pi * WORK * RADII[0]
    law, stiffness = bc.laws.dmt, 4.0 / 3.0 * MODULUS_EFF * sqrt(RADII[0])
    sim = bc.Simulation(bc.Box((-3.0,) * 3, (3.0,) * 3), law, material(), DT, (0.0, 0.0, -load * pull / mass), threads=1)
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    overlap = ((1.01 - load) * pull / stiffness) ** (2.0 / 3.0)
    sim.add_grains([(0.0, 0.0, overlap - RADII[0])], RADII[0])
    sim.run(5000)
    return sim.touching == 1


def test_pull_off_force():
    """At a wall R* = R: 2 pi w R carries a load that is 0.5 % less, and not one that is 0.5 % more."""
    assert hangs(0.995) and not hangs(1.005)


def test_pull_and_pressure_in_closed_form():
    """4/3 E* sqrt(R* d) d - 2 pi w R* at any overlap, from the compiled loop."""
    for overlap in (1e-6, 0.5 * AT_REST, 3.0 * AT_REST):
        sim = pair(overlap)
        sim.prepare()
        expected = 4.0 / 3.0 * MODULUS_EFF * sqrt(RADIUS_EFF) * overlap**1.5 - PULL
        assert -sim.grains.sorted_by_id("force")[0, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * PULL)


def test_friction_of_an_unloaded_contact():
    """F_n = 0 at the overlap at rest: the contact still resists slip, by mu times 2 pi w R*."""
    law, one = bc.laws.dmt, material().properties
    values = dict.fromkeys(("tangential_velocity", "slip_velocity_half"), (0.0, 1e9, 0.0)) | {"shear": (0.0, 0.0, 0.0)}
    values |= {"overlap": AT_REST, "normal": (1.0, 0.0, 0.0), "normal_half": (1.0, 0.0, 0.0), "normal_velocity": 0.0}
    values |= {"radius_eff": RADIUS_EFF, "mass_eff": 1.0, "dt": DT}
    normal_force, force, _ = law(**values, **dict(zip(law.parameters, law.pair_parameters(one, one, "here"))))
    assert normal_force == pytest.approx(0.0, abs=1e-12 * PULL)
    assert force == pytest.approx((0.0, -FRICTION * PULL, 0.0), rel=1e-12)


def rebound(work, speed, restitution):
    """Speed of rebound of two spheres over that of approach."""
    second = {"radius": RADII[1], "material": "m", "velocity": (0.5 * speed, 0.0, 0.0)}
    made = [material(work_of_adhesion=work, restitution=restitution)]
    run = Impacts(bc.laws.dmt, made, DT, RADII[0], "m", [(-0.5 * speed, 0.0, 0.0)], second=second)
    run.run_until_apart(20000)
    return (run.get("velocity") - run.get("velocity", "second"))[0, 0] / speed


def test_elastic_impact_keeps_its_energy():
    """The pull gives on the way in what it takes on the way out, within its work over a step at each end: F v dt of m v^2 / 2;
    without adhesion the same within the error of the leap-frog."""
    mass = [4.0 / 3.0 * pi * r**3 * DENSITY for r in RADII]
    allowed = 2.0 * PULL * DT * 10.0 / (0.5 * mass[0] * mass[1] / sum(mass) * 100.0)
    assert rebound(0.0, 10.0, 1.0) == pytest.approx(1.0, abs=1e-5)
    assert rebound(WORK, 10.0, 1.0) ** 2 == pytest.approx(1.0, abs=allowed)
    assert allowed < 0.03


def test_adhesion_lowers_the_restitution_and_holds_slow_grains():
    assert rebound(WORK, 10.0, 0.7) < rebound(0.0, 10.0, 0.7) == pytest.approx(0.7, abs=2e-3)
    with pytest.raises(AssertionError, match="still touch"):
        rebound(WORK, 0.05, 0.7)
