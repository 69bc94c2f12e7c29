"""The eight cases of Chung & Ooi, Granular Matter 13, 643 (2011), with the law hertz_mindlin.

Two kinds of reference. Closed forms: Hertz' peak force and overlap, restitution, gross sliding, no slip. And the paper's own
DEM and finite element points and Kharaz' experiment, as digitised in Kratos (DEMApplication, basic_benchmarks/paper_data).
The paper's DEM is not this law: in micro-slip its points are those of a total tangential displacement, F_t = -k_t(d) s, without
tangential dashpot. So where sticking matters, the law is checked against ``mindlin_impact``, which integrates the documented
equations a second time, and the digitised points that it meets (within 0.02, or 3 %) and misses are both listed.

A rigid wall is 1000 times stiffer than the sphere. e = 0 cannot be given (a restitution must be > 0); 0.01 stands for it.
"""

import numpy as np
import pytest
from analytic import (
    effective_modulus,
    hertz_peak,
    mindlin_impact,
    slides_throughout,
    sliding_impact,
    weighted_overlap,
)
from impacts import Impacts

import barchan as bc

LAW = bc.laws.hertz_mindlin

#: Name -> Young's modulus [Pa], Poisson ratio, density [kg/m^3].
ELASTIC = {
    "glass": (4.8e10, 0.20, 2800.0),
    "limestone": (2.0e10, 0.25, 2500.0),
    "al_alloy_2": (7.0e10, 0.30, 2699.0),
    "mg_alloy": (4.0e10, 0.35, 1800.0),
    "al_oxide": (3.8e11, 0.23, 4000.0),
    "cast_iron": (1.0e11, 0.25, 7000.0),
    "al_alloy": (7.0e10, 0.33, 2700.0),
    "steel": (2.08e11, 0.30, 7850.0),
    "polyethylene": (1.0e9, 0.40, 1400.0),
    "nylon": (2.5e9, 0.40, 1000.0),
    "copper": (1.2e11, 0.35, 8900.0),
}


def material(kind, name=None, stiffer=1.0, **properties):
    modulus, poisson, density = ELASTIC[kind]
    return bc.Material(name or kind, density=density, youngs_modulus=stiffer * modulus, poisson_ratio=poisson, **properties)


def sphere_mass(kind, radius):
    return 4.0 / 3.0 * np.pi * radius**3 * ELASTIC[kind][2]


def moduli_at_wall(kind):
    """E* and G* of a sphere at a wall that is 1000 times stiffer."""
    modulus, poisson, _ = ELASTIC[kind]
    shear_compliance = 2.0 * (2.0 - poisson) * (1.0 + poisson) / modulus
    return effective_modulus(modulus, poisson, 1000.0 * modulus, poisson), 1.0 / (1.001 * shear_compliance)


def at_wall(kind, dt, radius, velocity, omega=0.0, **properties):
    """Impacts of spheres of one kind on a rigid wall."""
    materials = [material(kind, **properties), material(kind, "wall", 1000.0, **properties)]
    return Impacts(LAW, materials, dt, radius, kind, velocity, omega, wall="wall")


def meets(value, reference, absolute, relative):
    """Where a value is within ``absolute`` or ``relative`` of a reference."""
    value, reference = np.asarray(value), np.asarray(reference)
    return np.abs(value - reference) <= np.maximum(absolute, relative * np.abs(reference))


# -- 1, 2: elastic head-on impact ----------------------------------------------------------------------------------------------


def test_1_two_equal_spheres_reach_hertz_peak():
    """Case 1: spheres of 10 mm at 10 m/s each, elastic. Peak overlap and force by Hertz' energy balance, within 0.1 %."""
    kinds, radius = ["glass", "limestone"], 0.01
    impacts = Impacts(
        LAW,
        [material(kind, friction=0.35) for kind in kinds],
        dt=5e-8,
        radius=radius,
        material=kinds,
        velocity=[(-10.0, 0.0, 0.0)] * 2,
        second={"radius": radius, "material": kinds, "velocity": (10.0, 0.0, 0.0)},
    )
    overlap, force = impacts.peaks(1150)
    masses = np.array([0.5 * sphere_mass(kind, radius) for kind in kinds])
    moduli = np.array([effective_modulus(*ELASTIC[kind][:2], *ELASTIC[kind][:2]) for kind in kinds])
    expected_overlap, expected_force = hertz_peak(20.0, masses, moduli, 0.5 * radius)
    np.testing.assert_allclose(expected_force, [1.069689e4, 7.108241e3], rtol=1e-5)  # as the paper's curves
    np.testing.assert_allclose(overlap, expected_overlap, rtol=1e-3)
    np.testing.assert_allclose(force, expected_force, rtol=1e-3)
    np.testing.assert_allclose(impacts.get("velocity"), [(10.0, 0.0, 0.0)] * 2, atol=1e-4)


def test_2_sphere_on_rigid_wall_reaches_hertz_peak():
    """Case 2: spheres of 0.1 m at 0.2 m/s on a wall, elastic, no friction. Peaks of a truly rigid wall, within 0.1 %."""
    kinds, radius = ["al_alloy_2", "mg_alloy"], 0.1
    materials = [material(kind, friction=0.0) for kind in kinds] + [material("al_alloy_2", "wall", 1000.0, friction=0.0)]
    impacts = Impacts(LAW, materials, 1e-6, radius, kinds, [(-0.2, 0.0, 0.0)] * 2, wall="wall")
    overlap, force = impacts.peaks(800)
    masses = np.array([sphere_mass(kind, radius) for kind in kinds])
    moduli = np.array([ELASTIC[kind][0] / (1.0 - ELASTIC[kind][1] ** 2) for kind in kinds])
    expected_overlap, expected_force = hertz_peak(0.2, masses, moduli, radius)
    np.testing.assert_allclose(expected_overlap, [4.971718e-5, 5.212329e-5], rtol=1e-5)
    np.testing.assert_allclose(overlap, expected_overlap, rtol=1e-3)
    np.testing.assert_allclose(force, expected_force, rtol=1e-3)


# -- 3: restitution ------------------------------------------------------------------------------------------------------------


def damped_impacts(kinds, restitutions, dt):
    names = [f"{kind} {e}" for e in restitutions for kind in kinds]
    inputs = np.repeat(restitutions, len(kinds))
    materials = [material(name.split()[0], name, friction=0.0) for name in names]
    materials.append(material("al_oxide", "wall", 1000.0, friction=0.0))
    pairs = {(name, "wall"): {"restitution": e} for name, e in zip(names, inputs)}
    return inputs, Impacts(LAW, materials, dt, 0.0025, names, [(-3.9, 0.0, 0.0)] * len(names), wall="wall", pairs=pairs)


def test_3_restitution_seen_is_restitution_given():
    """Case 3: spheres of 2.5 mm at 3.9 m/s on a wall, e = 0.2, 0.4, ... 1 within 0.1 % (dt about contact time / 3000)."""
    inputs, impacts = damped_impacts(["al_oxide", "cast_iron"], [0.2, 0.4, 0.6, 0.8, 1.0], 2e-9)
    seen = impacts.run_apart(20000).get("velocity")[:, 0] / 3.9
    np.testing.assert_allclose(seen, inputs, rtol=1e-3)


def test_3_nearly_plastic_impact():
    """Case 3, e = 0.01 in place of the paper's 0: within 0.1 % of the speed, and 1 % of itself at dt = contact time / 15000.

    The dashpot's half-step velocity makes the error first order in dt; it is largest here, where nearly all is dashpot.
    """
    inputs, impacts = damped_impacts(["al_oxide"], [0.01], 4e-10)
    impacts.sim.run(60000)
    assert (impacts.get("force")[:, 0] == 0.0).all(), "the contact still pushes"
    seen = impacts.get("velocity")[:, 0] / 3.9
    np.testing.assert_allclose(seen, inputs, atol=1e-3)
    np.testing.assert_allclose(seen, inputs, rtol=0.01)


# -- 4: oblique impact at fixed speed ------------------------------------------------------------------------------------------

ANGLES_4 = np.array([5.0, 10.0, 15.0, 20.0, 20.2, 25.0, 30.0, 30.4, 35.0, 39.5, 40.0, 49.6, 50.0, 60.0, 70.0, 71.1, 80.0, 85.0])

#: The paper's DEM points below gross sliding: angle -> e_t, spin [1/s], angle of the contact point's rebound [degrees].
PAPER_4 = {
    5.0: (0.948, 19.3, 3.76),
    10.0: (0.687, 213.0, -1.56),
    15.0: (0.624, 378.0, -5.54),
    20.0: (0.616, 511.0, -7.54),
    25.0: (0.634, 599.0, -7.54),
    30.0: (0.684, 617.0, -3.55),
}

#: Those that this law misses, with what it gives: nearly sticking impacts, where the paper's total displacement differs.
MISSED_4 = {5.0: (0.888, 38.0, 3.11), 10.0: (0.715, 192.6, 0.04)}

#: Kharaz, Gorham & Salman 2001: angle -> e_t.
EXPERIMENT_4 = {20.2: 0.599, 30.4: 0.690, 39.5: 0.774, 49.6: 0.848, 71.1: 0.937}

RADIUS_4, SPEED_4, FRICTION_4, RESTITUTION_4 = 0.0025, 3.9, 0.092, 0.98


def oblique_4(kind):
    """Case 4: (normal and tangential speed before, velocity and spin after) at ``ANGLES_4``."""
    normal, tangential = SPEED_4 * np.cos(np.radians(ANGLES_4)), SPEED_4 * np.sin(np.radians(ANGLES_4))
    velocity = np.stack([-normal, tangential, 0.0 * normal], axis=1)
    impacts = at_wall(kind, 5e-9, RADIUS_4, velocity, friction=FRICTION_4, restitution=RESTITUTION_4).run_apart(4500)
    return normal, tangential, impacts.get("velocity"), impacts.get("omega")[:, 2]


@pytest.mark.parametrize("kind", ["al_oxide", "al_alloy"])
def test_4_oblique_impact(kind):
    """Case 4: 3.9 m/s at 5 to 85 degrees from the normal, mu 0.092, e 0.98.

    Gross sliding (above 32.5 degrees) is the rigid body's impulse, within 0.5 %; all angles agree with the direct integration
    within 0.5 % of the speed of rebound; normal restitution is the input within 0.1 %.
    """
    normal, tangential, velocity, spin = oblique_4(kind)
    np.testing.assert_allclose(velocity[:, 0] / normal, RESTITUTION_4, rtol=1e-3)
    sliding = slides_throughout(tangential, normal, FRICTION_4, RESTITUTION_4)
    assert sliding.sum() == (ANGLES_4 > 32.52).sum()
    after, e_t, spin_after, _ = sliding_impact(tangential, normal, FRICTION_4, RESTITUTION_4, RADIUS_4)
    np.testing.assert_allclose(velocity[sliding, 1], after[sliding], rtol=5e-3)
    np.testing.assert_allclose(velocity[sliding, 1] / tangential[sliding], e_t[sliding], rtol=5e-3)
    np.testing.assert_allclose(spin[sliding], spin_after[sliding], rtol=5e-3)
    slip, slip_after = velocity[:, 1] - RADIUS_4 * spin, after - RADIUS_4 * spin_after
    np.testing.assert_allclose(slip[sliding], slip_after[sliding], atol=5e-3 * SPEED_4)
    _, reference, spin_reference = mindlin_impact(
        normal, tangential, 0.0, RADIUS_4, sphere_mass(kind, RADIUS_4), *moduli_at_wall(kind), FRICTION_4, RESTITUTION_4
    )
    np.testing.assert_allclose(velocity[:, 1], reference, atol=1e-3 * SPEED_4)
    np.testing.assert_allclose(RADIUS_4 * spin, RADIUS_4 * spin_reference, atol=1e-3 * SPEED_4)


def test_4_paper_and_experiment():
    """Case 4, aluminium oxide, against digitised points: e_t within 0.02 or 3 %, spin within 3 %, angle within 0.02 rad.

    Met at 15 to 30 degrees and at all angles of the experiment; missed at 5 and 10 degrees (``MISSED_4``).
    """
    _, tangential, velocity, spin = oblique_4("al_oxide")
    e_t, angle = velocity[:, 1] / tangential, np.degrees(np.arctan2(velocity[:, 1] - RADIUS_4 * spin, velocity[:, 0]))
    seen = {a: values for a, *values in zip(ANGLES_4, e_t, spin, angle)}
    for incidence, e_t_measured in EXPERIMENT_4.items():
        assert meets(seen[incidence][0], e_t_measured, 0.02, 0.0), f"experiment at {incidence}: {seen[incidence][0]}"
    for incidence, (paper_e_t, paper_spin, paper_angle) in PAPER_4.items():
        met = (
            meets(seen[incidence][0], paper_e_t, 0.02, 0.03)
            and meets(seen[incidence][1], paper_spin, 0.0, 0.03)
            and meets(np.radians(seen[incidence][2]), np.radians(paper_angle), 0.02, 0.03)
        )
        assert met == (incidence not in MISSED_4), f"{incidence} degrees: {seen[incidence]}, paper {PAPER_4[incidence]}"
    for incidence, recorded in MISSED_4.items():
        np.testing.assert_allclose(seen[incidence], recorded, rtol=0.01, atol=0.02)


def test_4_points_missed_are_those_of_a_total_displacement():
    """The two points of case 4 that hertz_mindlin misses are met, within 0.02 in e_t, by the law ``hertz``, F_t = -k_t(d) s, with
    the same stiffness, k_n = 4/3 E*, k_t = 8 G* (its e is 1 instead of 0.98)."""
    angles = np.radians([5.0, 10.0])
    velocity = SPEED_4 * np.stack([-np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    modulus, shear = moduli_at_wall("al_oxide")
    properties = {"kn": 4.0 / 3.0 * modulus, "kt": 8.0 * shear, "friction": FRICTION_4}
    materials = [bc.Material(name, density=4000.0, **properties) for name in ("sphere", "wall")]
    impacts = Impacts(bc.laws.hertz, materials, 5e-9, RADIUS_4, "sphere", velocity, wall="wall").run_apart(2000)
    e_t = impacts.get("velocity")[:, 1] / velocity[:, 1]
    assert meets(e_t, [PAPER_4[5.0][0], PAPER_4[10.0][0]], 0.02, 0.0).all(), e_t


# -- 5: oblique impact at fixed normal speed -----------------------------------------------------------------------------------

INCIDENCE_5 = np.array([0.33, 1.0, 2.0, 2.31, 3.32, 3.34, 4.0, 4.755, 5.0, 5.758, 6.0, 7.124, 8.0, 9.118, 9.988, 12.356, 12.961])
RADIUS_5, NORMAL_5, FRICTION_5 = 1e-5, 5.0, 0.3

#: Points of the paper: x -> slip velocity / (mu V_n) after the impact; steel by DEM, and by finite elements.
PAPER_5 = {0.33: -0.28, 1.0: -0.75, 2.0: -1.53, 3.34: -2.69, 4.0: -2.79, 5.0: -2.0, 9.988: 3.0133, 12.961: 6.0133}
ELEMENTS_5 = {2.31: -0.95, 3.32: -1.52, 4.755: -1.7067, 5.758: -1.2, 7.124: 0.1333, 9.118: 2.1467, 12.356: 5.4267, 12.961: 6.0133}

#: Those that this law misses, with what it gives for steel.
MISSED_5 = {0.33: 0.26, 1.0: 0.48, 2.0: -0.21, 3.34: -1.30, 4.0: -1.59, 5.0: -1.64}
MISSED_ELEMENTS_5 = {2.31: -0.51, 3.32: -1.29}


def oblique_5(kind, dt, steps):
    velocity = NORMAL_5 * np.stack([-1.0 + 0.0 * INCIDENCE_5, FRICTION_5 * INCIDENCE_5, 0.0 * INCIDENCE_5], axis=1)
    impacts = at_wall(kind, dt, RADIUS_5, velocity, friction=FRICTION_5).run_apart(steps)
    after, spin = impacts.get("velocity"), impacts.get("omega")[:, 2]
    unit = FRICTION_5 * NORMAL_5
    return (after[:, 1] - RADIUS_5 * spin) / unit, RADIUS_5 * spin / unit


@pytest.mark.parametrize(("kind", "dt", "steps"), [("steel", 2e-11, 2400), ("polyethylene", 1.5e-10, 1700)])
def test_5_oblique_impact_at_fixed_normal_speed(kind, dt, steps):
    """Case 5: spheres of 10 um, 5 m/s normal, x = V_t / (mu V_n) from 0.33 to 13, e = 1.

    Gross sliding (x > 7): slip x - 7 and spin 5 in units of mu V_n, where the lens arm R - d makes the 5 (and so the 7) smaller
    by the force-weighted overlap, 0.53 % for steel and 2.2 % for soft polyethylene: within 0.1 % of that, and for steel within
    0.5 % of 7 of the plain form. All x within 0.5 % of 7 of the direct integration.
    """
    slip, spin = oblique_5(kind, dt, steps)
    mass, moduli = sphere_mass(kind, RADIUS_5), moduli_at_wall(kind)
    shorter = 1.0 - weighted_overlap(hertz_peak(NORMAL_5, mass, moduli[0], RADIUS_5)[0]) / RADIUS_5
    sliding = INCIDENCE_5 > 7.0
    np.testing.assert_allclose(spin[sliding], 5.0 * shorter, rtol=1e-3)
    np.testing.assert_allclose(slip[sliding], INCIDENCE_5[sliding] - 2.0 - 5.0 * shorter, atol=7e-3)
    if kind == "steel":
        np.testing.assert_allclose(slip[sliding], INCIDENCE_5[sliding] - 7.0, atol=5e-3 * 7.0)
    unit = FRICTION_5 * NORMAL_5
    _, after, spin_after = mindlin_impact(NORMAL_5, unit * INCIDENCE_5, 0.0, RADIUS_5, mass, *moduli, FRICTION_5, 1.0)
    np.testing.assert_allclose(spin, RADIUS_5 * spin_after / unit, atol=5e-3 * 7.0)
    np.testing.assert_allclose(slip, (after - RADIUS_5 * spin_after) / unit, atol=5e-3 * 7.0)


def test_5_paper():
    """Case 5, steel, against digitised points, within 0.02 or 3 %: gross sliding and the finite elements from x = 4.76 on are
    met; the paper's DEM below x = 5 and the elements at x = 2.31 and 3.32 are not (``MISSED_5``): sticking depends on the law."""
    slip, _ = oblique_5("steel", 2e-11, 2400)
    seen = dict(zip(INCIDENCE_5, slip))
    for paper, missed in ((PAPER_5, MISSED_5), (ELEMENTS_5, MISSED_ELEMENTS_5)):
        for x, point in paper.items():
            assert meets(seen[x], point, 0.02, 0.03) == (x not in missed), f"x = {x}: {seen[x]}, paper {point}"
        np.testing.assert_allclose([seen[x] for x in missed], list(missed.values()), atol=0.02)


# -- 6, 8: impact with spin ----------------------------------------------------------------------------------------------------

RATIO_6 = np.array([0.3, 0.5, 0.7, 0.9, 1.19, 1.45, 2.09, 3.0, 5.75, 11.9, 24.0])
RADIUS_6, SPEED_6, FRICTION_6, RESTITUTION_6 = 0.1, 0.2, 0.4, 0.5

#: Digitised: x -> beta, the reversal of slip.
PAPER_6 = {
    "al_alloy": {1.19: 0.097, 1.45: 0.119, 2.09: 0.058, 3.0: -0.050, 5.75: -0.175, 11.9: -0.258, 24.0: -0.342},
    "nylon": {5.75: -0.159, 11.9: -0.113, 24.0: -0.116},
}
PAPER_8 = {
    "al_alloy": {1.19: 0.096, 1.45: 0.111, 2.09: 0.058, 3.0: -0.049, 5.75: -0.162, 11.9: -0.248, 24.0: -0.318},
    "nylon": {5.75: -0.162, 11.9: -0.108, 24.0: -0.106},
}

#: What this law gives where it misses them: it sticks to the end there, and its tangential dashpot takes nearly all slip.
MISSED_6 = {
    "al_alloy": {3.0: 0.038, 5.75: -0.002, 11.9: -0.005, 24.0: -0.006},
    "nylon": {5.75: 0.0145, 11.9: 0.011, 24.0: 0.010},
}


def spinning(kind, large=None):
    """Cases 6 and 8: reversal of slip, tangential velocity after, and the reference's, for initial slips x = ``RATIO_6``."""
    slip = 3.5 * FRICTION_6 * (1.0 + RESTITUTION_6) * SPEED_6 / RATIO_6
    velocity, omega = np.zeros((len(slip), 3)), np.zeros((len(slip), 3))
    velocity[:, 0], omega[:, 2] = -SPEED_6, -slip / RADIUS_6
    properties = {"friction": FRICTION_6, "restitution": RESTITUTION_6}
    dt, steps = {"al_alloy": (5e-7, 4000), "nylon": (1.5e-6, 5000)}[kind]
    if large is None:
        impacts = at_wall(kind, dt, RADIUS_6, velocity, omega, **properties)
    else:
        materials = [material(kind, **properties), material(kind, "ball", 1000.0, **properties)]
        ball = {"radius": large, "material": "ball", "frozen": True}
        impacts = Impacts(LAW, materials, dt, RADIUS_6, kind, velocity, omega, second=ball)
    impacts.run_apart(steps)
    after, spin = impacts.get("velocity"), impacts.get("omega")[:, 2]
    np.testing.assert_allclose(after[:, 0] / SPEED_6, RESTITUTION_6, rtol=1e-3)
    share = 1.0 if large is None else large / (large + RADIUS_6)
    _, expected, spin_expected = mindlin_impact(
        SPEED_6,
        0.0 * slip,
        -slip / RADIUS_6,
        RADIUS_6,
        sphere_mass(kind, RADIUS_6),
        *moduli_at_wall(kind),
        FRICTION_6,
        RESTITUTION_6,
        share,
    )
    np.testing.assert_allclose(after[:, 1], expected, rtol=5e-3, atol=1e-5)
    np.testing.assert_allclose(RADIUS_6 * spin, RADIUS_6 * spin_expected, rtol=5e-3, atol=1e-5)
    return -(after[:, 1] - RADIUS_6 * spin) / slip, after[:, 1]


@pytest.mark.parametrize("kind", ["al_alloy", "nylon"])
@pytest.mark.parametrize("case", [6, 8])
def test_6_and_8_spinning_sphere(kind, case):
    """Case 6: sphere of 0.1 m that spins about an axis in the wall, 0.2 m/s normal, mu 0.4, e 0.5; case 8: the same on a large
    sphere of 0.5 m, immobile and 1000 times stiffer. x = 3.5 mu (1+e) V_n / slip.

    x < 1 slides throughout: beta = x - 1 and V_t' = mu (1+e) V_n, within 0.5 %. All x agree with the direct integration
    within 0.5 %. Digitised points are met within 0.02 up to x = 2.09, and missed where the contact sticks (``MISSED_6``).
    """
    beta, tangential = spinning(kind, large=None if case == 6 else 0.5)
    sliding = RATIO_6 < 1.0
    np.testing.assert_allclose(beta[sliding], RATIO_6[sliding] - 1.0, atol=5e-3)
    np.testing.assert_allclose(tangential[sliding], -FRICTION_6 * (1.0 + RESTITUTION_6) * SPEED_6, rtol=5e-3)
    seen = dict(zip(RATIO_6, beta))
    for x, point in (PAPER_6 if case == 6 else PAPER_8)[kind].items():
        assert meets(seen[x], point, 0.02, 0.03) == (x not in MISSED_6[kind]), f"x = {x}: {seen[x]}, paper {point}"
    np.testing.assert_allclose([seen[x] for x in MISSED_6[kind]], list(MISSED_6[kind].values()), atol=0.005)


# -- 7: two spheres with opposite spins ----------------------------------------------------------------------------------------


def test_7_opposite_spins_stay_as_they_are():
    """Case 7: equal spheres meet head-on with opposite spins, 0.175 to 22.86 1/s: their surfaces move alike, nothing slips, so
    spins stay and no tangential velocity appears, to rounding. Normal restitution 0.5 within 0.1 %."""
    spins = np.array([0.175, 1.0, 5.0, 22.86])
    kinds = ["al_alloy"] * 4 + ["copper"] * 4
    spin = np.zeros((8, 3))
    spin[:, 2] = np.tile(spins, 2)
    velocity = np.array([(-0.2, 0.0, 0.0)] * 8)
    materials = [material(kind, friction=0.4, restitution=0.5) for kind in ("al_alloy", "copper")]
    second = {"radius": 0.1, "material": kinds, "velocity": -velocity, "omega": -spin}
    impacts = Impacts(LAW, materials, 5e-7, 0.1, kinds, velocity, spin, second=second).run_apart(5000)
    for body, sign in (("first", 1.0), ("second", -1.0)):
        np.testing.assert_allclose(impacts.get("omega", body), sign * spin, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(impacts.get("velocity", body)[:, 1:], 0.0, atol=1e-13)
        np.testing.assert_allclose(impacts.get("velocity", body)[:, 0], sign * 0.1, rtol=1e-3)
