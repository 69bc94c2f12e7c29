"""Hertz-Mindlin with resistance to rolling and twisting: ``hertz_mindlin`` and the couples of ``rolling.py``.

Without rolling and twisting friction they have the bits of ``hertz_mindlin``.
"""

from math import sqrt

from barchan.laws.hertz_mindlin import PROPERTIES, energy, hertz_mindlin, mix_with
from barchan.laws.law import law
from barchan.laws.rolling import (
    ABOUT_CENTRE,
    ABOUT_CONTACT,
    CONSTANT,
    SPRING,
    constant_couple,
    heaviness,
    rolling_couple,
    spring_and_dashpot,
    twisting_couple,
)
from barchan.laws.vector import add, dot


def energy_with_springs(overlap, radius_eff, E_eff, G_eff, rolling_friction, twisting_friction, shear, rolled, twisted):
    """That of ``hertz_mindlin``, and of the springs against rolling and twisting."""
    normal, tangential = energy(overlap, radius_eff, E_eff, G_eff, shear)
    stiffness_n = 4.0 / 3.0 * E_eff * sqrt(radius_eff * overlap)
    for friction, wound in ((rolling_friction, dot(rolled, rolled)), (twisting_friction, twisted * twisted)):
        arm = friction * radius_eff
        if arm > 0.0:
            tangential += wound / (4.5 * stiffness_n * arm * arm)
    return normal, tangential


@law(
    properties=PROPERTIES | SPRING,
    history={"shear": 3, "rolled": 3, "twisted": 1},
    lever="lens",
    mix=mix_with(SPRING),
    couple=True,
    energy=energy_with_springs,
)
def hertz_mindlin_rolling(
    overlap,
    normal,
    normal_half,
    normal_velocity,
    tangential_velocity,
    slip_velocity_half,
    relative_omega,
    radius_first,
    radius_second,
    radius_eff,
    mass_eff,
    dt,
    E_eff,
    G_eff,
    friction,
    alpha,
    rolling_friction,
    twisting_friction,
    rolling_damping,
    shear,
    rolled,
    twisted,
):
    """Hertz-Mindlin with springs and dashpots against rolling and twisting."""
    normal_force, force, shear = hertz_mindlin(
        overlap,
        normal,
        normal_half,
        normal_velocity,
        tangential_velocity,
        slip_velocity_half,
        radius_eff,
        mass_eff,
        dt,
        E_eff,
        G_eff,
        friction,
        alpha,
        shear,
    )
    stiffness_n, heavy = 4.0 / 3.0 * E_eff * sqrt(radius_eff * overlap), heaviness(radius_first, radius_second, mass_eff)
    arm = rolling_friction * radius_eff
    k, c = spring_and_dashpot(stiffness_n, arm, ABOUT_CONTACT * heavy, rolling_damping)
    rolling, rolled = rolling_couple(rolled, relative_omega, normal, normal_half, dt, arm * normal_force, k, c)
    arm = twisting_friction * radius_eff
    k, c = spring_and_dashpot(stiffness_n, arm, ABOUT_CENTRE * heavy, rolling_damping)
    twisting, twisted = twisting_couple(twisted, relative_omega, normal, normal_half, dt, arm * normal_force, k, c)
    return normal_force, force, add(rolling, twisting), shear, rolled, twisted


@law(properties=PROPERTIES | CONSTANT, history={"shear": 3}, lever="lens", mix=mix_with(CONSTANT), couple=True, energy=energy)
def hertz_mindlin_constant_rolling(
    overlap,
    normal,
    normal_half,
    normal_velocity,
    tangential_velocity,
    slip_velocity_half,
    relative_omega,
    radius_eff,
    mass_eff,
    dt,
    E_eff,
    G_eff,
    friction,
    alpha,
    rolling_friction,
    twisting_friction,
    shear,
):
    """Hertz-Mindlin with constant couples against rolling and twisting."""
    normal_force, force, shear = hertz_mindlin(
        overlap,
        normal,
        normal_half,
        normal_velocity,
        tangential_velocity,
        slip_velocity_half,
        radius_eff,
        mass_eff,
        dt,
        E_eff,
        G_eff,
        friction,
        alpha,
        shear,
    )
    couple = constant_couple(relative_omega, normal, normal_force, radius_eff, mass_eff, dt, rolling_friction, twisting_friction)
    return normal_force, force, couple, shear
