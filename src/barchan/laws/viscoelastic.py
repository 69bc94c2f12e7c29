"""Spring and dashpot, normal and tangential, with the elastic tangential displacement as memory.

F_n = f (k_n overlap - gamma_n m_eff v_n),  F_t = f (-k_t u - gamma_t m_eff v_t),  |F_t| <= mu |F_n|: equations (5) to (8)
of Walther & Sbalzarini 2009, after Silbert et al. 2001. The laws differ only in the factor f:

- ``linear``: f = 1 (LAMMPS ``gran/hooke/history``);
- ``silbert``: f = sqrt(overlap / (R_i + R_j)), the paper's;
- ``hertz``: f = sqrt(overlap R_eff), k in force/length^2 (LAMMPS ``gran/hertz/history``).

The ones whose name ends in ``_standard`` carry the displacement as most codes do (``laws/friction.py``).
"""

from math import sqrt

from barchan.laws.friction import sliding_ratio, standard, synchronised
from barchan.laws.law import Property, law
from barchan.laws.vector import add, dot, scale, sub


def _properties(stiffness, rate):
    return {
        "kn": Property(stiffness, above=True),
        "kt": Property(stiffness, above=True),
        "gamma_n": Property(rate, default=0.0),
        "gamma_t": Property(rate, default=0.0),
        "friction": Property("1"),
    }


PER_LENGTH = _properties("force/length", "1/time")
PER_AREA = _properties("force/length^2", "1/(length time)")


def viscoelastic(f, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip):
    """Equations (5) to (8) with the factor ``f``."""
    normal_force = f * (kn * overlap - gamma_n * mass_eff * normal_velocity)
    viscous = scale(gamma_t * mass_eff, tangential_velocity)
    pull = add(scale(kt, slip), viscous)
    ratio = sliding_ratio(scale(f, pull), friction * abs(normal_force))
    if ratio < 1.0:
        slip = scale(1.0 / kt, sub(scale(ratio, pull), viscous))
    return normal_force, scale(-f * ratio, pull), slip


def linear_energy(overlap, kn, kt, slip):
    """What springs of constant stiffness store."""
    return 0.5 * kn * overlap * overlap, 0.5 * kt * dot(slip, slip)


def silbert_energy(overlap, radius_first, radius_second, kn, kt, slip):
    """f k_n overlap, integrated, and the tangential spring at the present f."""
    f = sqrt(overlap / (radius_first + radius_second))
    return 0.4 * f * kn * overlap * overlap, 0.5 * f * kt * dot(slip, slip)


def hertz_energy(overlap, radius_eff, kn, kt, slip):
    """f k_n overlap, integrated, and the tangential spring at the present f."""
    f = sqrt(overlap * radius_eff)
    return 0.4 * f * kn * overlap * overlap, 0.5 * f * kt * dot(slip, slip)


@law(properties=PER_LENGTH, history={"slip": 3}, energy=linear_energy)
def linear(
    overlap,
    normal,
    normal_half,
    normal_velocity,
    tangential_velocity,
    slip_velocity_half,
    mass_eff,
    dt,
    kn,
    kt,
    gamma_n,
    gamma_t,
    friction,
    slip,
):
    """Linear spring and dashpot."""
    slip = synchronised(slip, slip_velocity_half, normal_half, normal, dt)
    return viscoelastic(1.0, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)


@law(properties=PER_LENGTH, history={"slip": 3}, energy=linear_energy)
def linear_standard(
    overlap, normal, normal_velocity, tangential_velocity, mass_eff, dt, kn, kt, gamma_n, gamma_t, friction, slip
):
    """Linear spring and dashpot, standard scheme."""
    slip = standard(slip, tangential_velocity, normal, dt)
    return viscoelastic(1.0, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)


@law(properties=PER_LENGTH, history={"slip": 3}, energy=silbert_energy)
def silbert(
    overlap,
    normal,
    normal_half,
    normal_velocity,
    tangential_velocity,
    slip_velocity_half,
    radius_first,
    radius_second,
    mass_eff,
    dt,
    kn,
    kt,
    gamma_n,
    gamma_t,
    friction,
    slip,
):
    """The paper's law: Hertzian form of Silbert et al., for unequal radii."""
    slip = synchronised(slip, slip_velocity_half, normal_half, normal, dt)
    f = sqrt(overlap / (radius_first + radius_second))
    return viscoelastic(f, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)


@law(properties=PER_LENGTH, history={"slip": 3}, energy=silbert_energy)
def silbert_standard(
    overlap,
    normal,
    normal_velocity,
    tangential_velocity,
    radius_first,
    radius_second,
    mass_eff,
    dt,
    kn,
    kt,
    gamma_n,
    gamma_t,
    friction,
    slip,
):
    """The paper's law, standard scheme."""
    slip = standard(slip, tangential_velocity, normal, dt)
    f = sqrt(overlap / (radius_first + radius_second))
    return viscoelastic(f, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)


@law(properties=PER_AREA, history={"slip": 3}, energy=hertz_energy)
def hertz(
    overlap,
    normal,
    normal_half,
    normal_velocity,
    tangential_velocity,
    slip_velocity_half,
    radius_eff,
    mass_eff,
    dt,
    kn,
    kt,
    gamma_n,
    gamma_t,
    friction,
    slip,
):
    """LAMMPS' ``hertz/history`` form."""
    slip = synchronised(slip, slip_velocity_half, normal_half, normal, dt)
    f = sqrt(overlap * radius_eff)
    return viscoelastic(f, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)


@law(properties=PER_AREA, history={"slip": 3}, energy=hertz_energy)
def hertz_standard(
    overlap, normal, normal_velocity, tangential_velocity, radius_eff, mass_eff, dt, kn, kt, gamma_n, gamma_t, friction, slip
):
    """LAMMPS' ``hertz/history`` form, standard scheme: what LAMMPS computes."""
    slip = standard(slip, tangential_velocity, normal, dt)
    f = sqrt(overlap * radius_eff)
    return viscoelastic(f, overlap, normal_velocity, tangential_velocity, mass_eff, kn, kt, gamma_n, gamma_t, friction, slip)
