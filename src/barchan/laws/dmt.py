"""Adhesion of Derjaguin, Muller & Toporov: ``hertz_mindlin``, and a pull of 2 pi w R* as long as the grains touch.

F_n = Hertz-Mindlin's - 2 pi w R*, w the work of adhesion: what it takes to part a unit of area, twice the surface energy of equal
materials. The largest pull, 2 pi w R*, is at overlap 0, where the contact ends. It suits small, stiff grains (Tabor's number
below about 0.1), whose adhesion does not deform them. Friction follows Derjaguin (Z. Phys. 88, 661, 1934): at most
mu (F_n + 2 pi w R*), mu times the elastic part, since adhesion presses as a load does. Source: Derjaguin, Muller & Toporov,
J. Colloid Interface Sci. 53, 314, 1975.
"""

from math import pi

from barchan.laws.hertz_mindlin import PROPERTIES, energy, hertz_mindlin, mix_with
from barchan.laws.law import Property, law

ADHESION = {"work_of_adhesion": Property("force/length", default=0.0)}


def energy_with_pull(overlap, radius_eff, E_eff, G_eff, work_of_adhesion, shear):
    """That of ``hertz_mindlin``, less the work of the pull."""
    normal, tangential = energy(overlap, radius_eff, E_eff, G_eff, shear)
    return normal - 2.0 * pi * work_of_adhesion * radius_eff * overlap, tangential


@law(
    properties=PROPERTIES | ADHESION,
    history={"shear": 3},
    lever="lens",
    mix=mix_with(ADHESION),
    adhesive=True,
    energy=energy_with_pull,
)
def dmt(
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
    work_of_adhesion,
    shear,
):
    """Hertz-Mindlin with the adhesion of Derjaguin, Muller and Toporov."""
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
    return normal_force - 2.0 * pi * work_of_adhesion * radius_eff, force, shear
