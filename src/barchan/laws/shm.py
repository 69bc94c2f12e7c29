"""Hertz-Mindlin without a dashpot, as codes of soil mechanics have it ("simplified Hertz-Mindlin").

F_n = 4 G / (3 (1 - nu)) a overlap, dF_s = -4 G / (2 - nu) a v_t dt turned with the contact, |F_s| <= mu F_n, with
a = sqrt(R* overlap): for two grains of one material these are the 4/3 E* and 8 G* of ``hertz_mindlin``, whose restitution is 1
here. Energy leaves by friction, or by a damping of the grains. Source: Marketos et al. 2013.
"""

from barchan.laws.hertz_mindlin import PROPERTIES, energy, hertz_mindlin, mix
from barchan.laws.law import law

ELASTIC = {name: PROPERTIES[name] for name in ("youngs_modulus", "poisson_ratio", "friction")}


def mix_elastic(first, second):
    """Pair parameters of ``hertz_mindlin`` with restitution 1, whose alpha is 0."""
    return mix(first | {"restitution": 1.0}, second | {"restitution": 1.0})


@law(properties=ELASTIC, history={"shear": 3}, lever="lens", mix=mix_elastic, energy=energy)
def shm(
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
):
    """Hertz-Mindlin, incremental, without dashpot."""
    return hertz_mindlin(
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
