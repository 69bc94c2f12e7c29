"""Energy in single impacts, at every angle, of grains with grains and with a plane.

An impact may not create kinetic energy. Whether a law keeps that promise when the contact sticks depends on how its tangential
spring and its normal force share a potential energy; the bands below record where the shipped laws do not.
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from impacts import BASIC_LAWS, Impacts

import barchan as bc

ANGLES = np.radians(np.arange(5.0, 86.0, 5.0))
RADIUS, DENSITY, SPEED, KN, MODULUS, DT = 0.5, 1.0, 1.0, 1e5, 1e7, 1e-5
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY
FRICTIONS, RESTITUTIONS = (0.1, 0.5, 10.0), (1.0, 0.7)

#: k_t / k_n of the paper's law. With it 7/2 k_t = k_n: slip and overlap then swing alike.
PAPER_RATIO = 2.0 / 7.0

TOTAL_DISPLACEMENT = ("silbert", "hertz", "silbert_standard", "hertz_standard")


def material(law, name, friction, restitution=1.0, ratio=PAPER_RATIO, poisson=0.3, partner="plane"):
    """A material; the rate of the viscoelastic dashpot is that which gives a linear contact the restitution."""
    if law.name.startswith("hertz_mindlin"):
        elastic = {"youngs_modulus": MODULUS, "poisson_ratio": poisson, "restitution": restitution}
    else:
        damping = -log(restitution) / sqrt(pi**2 + log(restitution) ** 2)
        mass_eff = MASS if partner == "plane" else 0.5 * MASS
        elastic = {"kn": KN, "kt": ratio * KN, "gamma_n": 2.0 * damping * sqrt(KN / mass_eff)}
    return bc.Material(name, density=DENSITY, friction=friction, **elastic)


def energy_change(law, materials, partner, dt=DT):
    """Relative change of the kinetic energy, (materials, angles), at one relative speed."""
    names = np.repeat([m.name for m in materials], len(ANGLES))
    approach = np.stack([-np.cos(ANGLES), np.sin(ANGLES), 0.0 * ANGLES], axis=1)
    velocity = SPEED * np.tile(approach, (len(materials), 1))
    if partner == "plane":
        wall = bc.Material("wall", **materials[0].given)
        pairs = {(m.name, "wall"): dict(m.given) for m in materials}
        impacts = Impacts(law, [*materials, wall], dt, RADIUS, names, velocity, wall="wall", pairs=pairs)
    else:
        second = {"radius": RADIUS, "material": names, "velocity": -0.5 * velocity}
        impacts = Impacts(law, materials, dt, RADIUS, names, 0.5 * velocity, second=second)
    before = impacts.kinetic_energy()
    impacts.run_until_apart(round(0.1 / dt))
    return (impacts.kinetic_energy() / before - 1.0).reshape(len(materials), len(ANGLES))


@pytest.mark.parametrize("partner", ["plane", "grain"])
@pytest.mark.parametrize("law", BASIC_LAWS, ids=lambda law: law.name)
def test_impact_creates_no_energy(law, partner):
    """Impacts at 5 to 85 degrees, mu 0.1, 0.5, 10, e 1 and 0.7: no kinetic energy is gained, beyond 1e-9 and the leap-frog's
    error (w dt)^2 / 2 = 2e-5, w the frequency of the stiffest (linear) contact.

    Held by all laws, at k_t = 2/7 k_n for those with springs and nu = 0.3 for Hertz-Mindlin. For other values see the figures
    recorded below. Elastic impacts that slide lose what friction takes, those with e = 0.7 at least their normal part.
    """
    materials = [material(law, f"{mu} {e}", mu, e, partner=partner) for mu in FRICTIONS for e in RESTITUTIONS]
    change = energy_change(law, materials, partner)
    allowed = 1e-9 + 0.5 * (DT * sqrt(KN / (0.5 * MASS))) ** 2
    assert change.max() <= allowed, f"gains {change.max():.2e} at mu, e = {materials[change.max(axis=1).argmax()].name}"
    assert (change[1::2, 0] < -0.05).all(), "the dashpot takes nothing"
    assert change[0].min() < -0.02, "friction takes nothing"


@pytest.mark.parametrize("partner", ["plane", "grain"])
def test_linear_law_creates_no_energy_at_any_stiffness_ratio(partner):
    """Linear law, e = 1, mu = 10, k_t / k_n from 0.1 to 2: a constant spring has a potential, which is lost when the contact
    ends and never gained."""
    law = bc.laws.linear
    change = energy_change(law, [material(law, f"{x}", 10.0, ratio=x) for x in (0.1, 0.2, 0.35, 0.5, 0.8, 1.2, 2.0)], partner)
    assert change.max() <= 1e-9


#: Elastic sticking impacts (e = 1, mu = 10): largest gain and largest loss over all angles, relative to the energy before.
#: k_t / k_n -> (gain, loss) at a plane, the same for silbert and hertz.
TOTAL_DISPLACEMENT_FIGURES = {
    0.2: (-9.3e-4, -0.126),
    0.3: (1.15e-2, 0.0),
    0.35: (3.19e-2, 0.0),
    0.4: (2.64e-2, 0.0),
    0.5: (-5.1e-4, -0.0545),
    0.8: (-2.17e-3, -0.272),
    1.2: (-3.6e-4, -0.231),
    1.5: (3.40e-2, -0.110),
}

#: Poisson's ratio -> (gain, loss) of hertz_mindlin between equal grains.
INCREMENTAL_FIGURES = {
    0.0: (1.35e-2, -0.119),
    0.1: (1.03e-2, -0.156),
    0.2: (7.5e-4, -0.196),
    0.25: (-3.7e-5, -0.217),
    0.3: (-2.4e-4, -0.238),
    0.4: (-8.2e-4, -0.271),
    0.5: (-1.56e-3, -0.284),
}


def check_figures(law, materials, partner, figures):
    change = energy_change(law, materials, partner)
    gain, loss = np.array(list(figures.values())).T
    np.testing.assert_allclose(change.max(axis=1), gain, rtol=0.05, atol=3e-5)
    np.testing.assert_allclose(np.minimum(change.min(axis=1), 0.0), loss, rtol=0.02, atol=3e-5)


@pytest.mark.parametrize("name", TOTAL_DISPLACEMENT)
def test_figures_of_total_displacement(name):
    """The paper's law and LAMMPS' hertz form, F_t = -k_t(overlap) s, in elastic sticking impacts at a plane: recorded figures.

    The force has no potential together with the Hertz force, so energy comes and goes by up to 3.4 % and 27 %, but at the
    paper's k_t = 2/7 k_n slip and overlap are proportional at all times and energy is kept to the error of the leap-frog.
    """
    law = bc.laws.SHIPPED[name]
    kept = energy_change(law, [material(law, "paper", 10.0)], "plane")
    assert np.abs(kept).max() <= 1e-7
    figures = TOTAL_DISPLACEMENT_FIGURES
    check_figures(law, [material(law, f"{x}", 10.0, ratio=x) for x in figures], "plane", figures)


def test_figures_of_incremental_hertz_mindlin():
    """Incremental Hertz-Mindlin, dF_s = -8 G* a v_t dt, in elastic sticking impacts of equal grains: recorded figures.

    Energy within 1e-4, which was asked for, is out of reach of this form (and of LAMMPS' ``mindlin/force``): while the contact
    unloads, its stiffness falls but the stored force stays, which adds F^2 / 2 d(1/k). From nu = 0.25 on nothing is gained at any
    angle; below, up to 1.35 %. What the last, sliding moments take is a loss of up to 28 %.
    """
    law = bc.laws.hertz_mindlin
    materials = [material(law, f"{nu}", 10.0, poisson=nu) for nu in INCREMENTAL_FIGURES]
    check_figures(law, materials, "grain", INCREMENTAL_FIGURES)
