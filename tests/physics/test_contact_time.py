"""Head-on impacts: peaks, and the order of the time integration: second for elastic contacts, first with a dashpot.

The leap-frog knows velocities at n-1/2 where the dashpot's force at n is needed: an error of dt/2 times the acceleration.
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from analytic import (
    effective,
    effective_modulus,
    hertz_contact_time,
    leap_frog_contact_time,
    linear_contact_time,
    linear_restitution,
)
from impacts import BASIC_LAWS, Impacts

import barchan as bc

RADIUS, DENSITY, SPEED, KN, MODULUS, POISSON = 0.5, 1.0, 1.0, 1e5, 1e7, 0.3
MASS_EFF = 0.5 * 4.0 / 3.0 * pi * RADIUS**3 * DENSITY

#: Steps in a contact; not whole, so that its end falls anywhere in a step.
RESOLUTIONS = np.array([50.3, 100.7, 201.1, 402.9, 805.3])


def material(law, name, restitution):
    """A material without friction."""
    if law is bc.laws.hertz_mindlin:
        elastic = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "restitution": restitution}
    else:
        elastic = {"kn": KN, "kt": KN, "gamma_n": rate(restitution)}
    return bc.Material(name, density=DENSITY, friction=0.0, **elastic)


def rate(restitution):
    """gamma_n of the linear law for a restitution."""
    damping = -log(restitution) / sqrt(pi**2 + log(restitution) ** 2)
    return 2.0 * damping * sqrt(KN / MASS_EFF)


def head_on(law, restitution, dt):
    """Contact time, by linear interpolation of the overlap between the last two steps, and restitution of two equal spheres."""
    second = {"radius": RADIUS, "material": "b", "velocity": (0.5 * SPEED, 0.0, 0.0)}
    materials = [material(law, name, restitution) for name in "ab"]
    impacts = Impacts(law, materials, dt, RADIUS, ["a"], [(-0.5 * SPEED, 0.0, 0.0)], second=second)
    before, now = 0.0, np.inf
    while now > 0.0:
        before = impacts.overlap()[0]
        impacts.sim.step()
        now = impacts.overlap()[0]
    duration = (impacts.sim.step_number - 1 + before / (before - now)) * dt
    impacts.run_apart(1)
    return duration, (impacts.get("velocity") - impacts.get("velocity", "second"))[0, 0] / SPEED


def order(errors):
    """Orders seen between successive resolutions."""
    return np.log(errors[:-1] / errors[1:]) / np.log(RESOLUTIONS[1:] / RESOLUTIONS[:-1])


def elastic_time(law):
    if law is bc.laws.linear:
        return linear_contact_time(KN, MASS_EFF)
    return hertz_contact_time(SPEED, MASS_EFF, MODULUS / (2.0 * (1.0 - POISSON**2)), 0.5 * RADIUS)


@pytest.mark.parametrize("law", BASIC_LAWS, ids=lambda law: law.name)
def test_peak_of_unequal_spheres(law):
    """Elastic impact at 1 m/s of spheres of radius 0.3 and 0.5, of two materials. F = K d^p has its peak at
    d^(p+1) = (p+1) m* v^2 / (2 K): overlap and force within 0.01 %. K: k_n (linear); k_n / sqrt(R_i + R_j) (the paper's);
    k_n sqrt(R*) (hertz); 4/3 E* sqrt(R*) (Hertz-Mindlin). k_n of the pair is the geometric mean."""
    radii, densities, stiffnesses, moduli = (0.3, 0.5), (1.0, 2.0), (1e5, 3e5), (1e7, 3e7)
    incremental = law.name.startswith("hertz_mindlin")
    materials = [
        bc.Material(
            name,
            density=density,
            friction=0.0,
            **({"youngs_modulus": modulus, "poisson_ratio": nu} if incremental else {"kn": stiffness, "kt": stiffness}),
        )
        for name, density, stiffness, modulus, nu in zip("ab", densities, stiffnesses, moduli, (0.2, 0.4))
    ]
    second = {"radius": radii[1], "material": "b", "velocity": (0.5, 0.0, 0.0)}
    overlap, force = Impacts(law, materials, 2e-6, radii[0], ["a"], [(-0.5, 0.0, 0.0)], second=second).peaks(8000)
    masses = [4.0 / 3.0 * pi * radius**3 * density for radius, density in zip(radii, densities)]
    mass_eff, radius_eff = effective(*masses), effective(*radii)
    stiffness = sqrt(stiffnesses[0] * stiffnesses[1])
    factor, power = {
        "linear": (stiffness, 1.0),
        "silbert": (stiffness / sqrt(sum(radii)), 1.5),
        "hertz": (stiffness * sqrt(radius_eff), 1.5),
        "hertz_mindlin": (4.0 / 3.0 * effective_modulus(moduli[0], 0.2, moduli[1], 0.4) * sqrt(radius_eff), 1.5),
    }[law.name.removesuffix("_standard")]
    peak = ((power + 1.0) * mass_eff / (2.0 * factor)) ** (1.0 / (power + 1.0))
    np.testing.assert_allclose(overlap, peak, rtol=1e-4)
    np.testing.assert_allclose(force, factor * peak**power, rtol=1e-4)


@pytest.mark.parametrize("law", [bc.laws.linear, bc.laws.hertz_mindlin], ids=lambda law: law.name)
def test_elastic_contact_time_is_second_order(law):
    """50 to 805 steps in an elastic contact: the error of its duration falls with dt^2 (orders 1.85 to 2.15 between
    resolutions), and for the linear contact it is within 3 % of the leap-frog's own closed form, 2 asin(w dt / 2)."""
    exact = elastic_time(law)
    durations = np.array([head_on(law, 1.0, exact / n)[0] for n in RESOLUTIONS])
    errors = np.abs(durations / exact - 1.0)
    seen = order(errors)
    assert (np.abs(seen - 2.0) < 0.15).all(), f"orders {seen}, errors {errors}"
    if law is bc.laws.linear:
        predicted = np.array([leap_frog_contact_time(KN, MASS_EFF, exact / n) for n in RESOLUTIONS])
        np.testing.assert_allclose(durations - exact, predicted - exact, rtol=0.03)


def test_damped_contact_time_is_first_order():
    """Linear spring and dashpot, restitution 0.5, 50 to 805 steps in a contact: the error of its duration falls with dt (orders
    0.95 to 1.05). That of the restitution is first order too, but scatters, since the force jumps from 0 and to 0 at both ends,
    which fall anywhere in a step: below 2 dt / t_c."""
    exact = linear_contact_time(KN, MASS_EFF, rate(0.5))
    assert linear_restitution(KN, MASS_EFF, rate(0.5)) == pytest.approx(0.5, rel=1e-12)
    durations, restitutions = np.array([head_on(bc.laws.linear, 0.5, exact / n) for n in RESOLUTIONS]).T
    seen = order(np.abs(durations / exact - 1.0))
    assert (np.abs(seen - 1.0) < 0.05).all(), f"orders {seen}"
    assert (np.abs(restitutions / 0.5 - 1.0) < 2.0 / RESOLUTIONS).all(), restitutions


def test_damped_restitution_of_hertz_mindlin():
    """Hertz-Mindlin, restitution 0.5: the error of the restitution, of changing sign, stays below 0.2 dt / t_c."""
    exact = elastic_time(bc.laws.hertz_mindlin)
    seen = np.array([head_on(bc.laws.hertz_mindlin, 0.5, exact / n)[1] for n in RESOLUTIONS])
    assert (np.abs(seen / 0.5 - 1.0) < 0.2 / RESOLUTIONS).all(), seen
