"""The parallel bond: a disc of elastic glue between two grains, which carries forces and moments and breaks.

The disc has the radius R_b = radius_factor min(R_i, R_j), the area A = pi R_b^2 and the moments I = pi R_b^4 / 4, J = 2 I. In
each step forces and moments grow by

    dF_n = -kn A stretch    dF_s = -ks A slip    dM_n = -ks J twist    dM_s = -kn I bend

and turn with the bond. At its edge they make the stresses

    sigma = -F_n / A + |M_s| R_b / I  (in tension; in compression F_n / A + |M_s| R_b / I)    tau = |F_s| / A + |M_n| R_b / J

and the bond breaks where one reaches its strength. If several do in one step, the one that exceeds its strength most gives the
mode; of a break in shear the larger part of tau does: that of the force (shear) or that of the moment (torsion). Source:
Potyondy & Cundall, Int. J. Rock Mech. Min. Sci. 41, 1329 (2004); Marketos 2013, whose strength in compression is that in tension.
"""

from math import pi

from barchan.laws.bond import bond
from barchan.laws.law import Property
from barchan.laws.vector import add, dot, norm, scale, sub

MODES = ("tension", "compression", "shear", "torsion")

PROPERTIES = {
    "kn": Property("force/length^3"),
    "ks": Property("force/length^3"),
    "tensile_strength": Property("force/length^2", above=True),
    "shear_strength": Property("force/length^2", above=True),
    "compressive_strength": Property("force/length^2", default=0.0),  # 0: it never breaks in compression
    "radius_factor": Property("1", above=True, default=1.0),
}

HISTORY = {"bond_normal_force": 1, "bond_shear_force": 3, "twisting_moment": 1, "bending_moment": 3}


def disc(radius_first, radius_second, radius_factor):
    """Radius [length], area [length^2], and moment of inertia about a diameter [length^4] of the disc."""
    radius = radius_factor * min(radius_first, radius_second)
    area = pi * radius * radius
    return radius, area, 0.25 * area * radius * radius


def edge_stresses(bond_normal_force, shear_force, twisting_moment, bending_moment, radius):
    """Stresses at the edge of the disc of a radius [force/length^2]: the largest in tension, in compression, and the two parts of
    that in shear, by the force and by the moment. Vectors come as their lengths."""
    per_radius = 1.0 / radius  # one division where four would do: they take a fifth of the loop
    per_area = per_radius * per_radius * (1.0 / pi)
    per_moment = 4.0 * per_area * per_radius  # R_b / I
    bent, pressure = bending_moment * per_moment, bond_normal_force * per_area
    return bent - pressure, bent + pressure, shear_force * per_area, 0.5 * abs(twisting_moment) * per_moment


def mode_of_break(stresses, tensile_strength, compressive_strength, shear_strength, strength):
    """The number of the mode in which a bond breaks, from 1 on as in ``MODES``, or 0.

    Args:
        stresses: as ``edge_stresses`` returns them.
        strength: of this bond, relative to the strengths given.
    """
    tension, compression, shear, torsion = stresses
    pulled, sheared = tension * (1.0 / tensile_strength), (shear + torsion) * (1.0 / shear_strength)
    pressed = compression * (1.0 / compressive_strength) if compressive_strength > 0.0 else 0.0
    most = max(pulled, pressed, sheared)
    in_shear = 3 if shear >= torsion else 4
    mode = in_shear if most == sheared else (1 if most == pulled else 2)
    return mode if most >= strength else 0


def energy(
    radius_first, radius_second, kn, ks, radius_factor, bond_normal_force, bond_shear_force, twisting_moment, bending_moment
):
    """What it stores: F_n^2 / (2 kn A) + F_s^2 / (2 ks A) + M_n^2 / (2 ks J) + M_s^2 / (2 kn I)."""
    _, area, inertia = disc(radius_first, radius_second, radius_factor)
    along = bond_normal_force * bond_normal_force / area + dot(bending_moment, bending_moment) / inertia
    across = dot(bond_shear_force, bond_shear_force) / area + 0.5 * twisting_moment * twisting_moment / inertia
    return (0.5 * along / kn if kn > 0.0 else 0.0) + (0.5 * across / ks if ks > 0.0 else 0.0)


@bond(properties=PROPERTIES, history=HISTORY, modes=MODES, energy=energy)
def parallel_bond(
    stretch,
    slip,
    twist,
    bend,
    normal,
    radius_first,
    radius_second,
    strength,
    kn,
    ks,
    tensile_strength,
    shear_strength,
    compressive_strength,
    radius_factor,
    bond_normal_force,
    bond_shear_force,
    twisting_moment,
    bending_moment,
):
    """The parallel bond of Potyondy & Cundall (2004)."""
    radius, area, inertia = disc(radius_first, radius_second, radius_factor)
    force = bond_normal_force - kn * area * stretch
    shear = sub(bond_shear_force, scale(ks * area, slip))
    twisting = twisting_moment - 2.0 * ks * inertia * twist
    bending = sub(bending_moment, scale(kn * inertia, bend))
    stresses = edge_stresses(force, norm(shear), twisting, norm(bending), radius)
    mode = mode_of_break(stresses, tensile_strength, compressive_strength, shear_strength, strength)
    return force, shear, add(scale(twisting, normal), bending), mode, force, shear, twisting, bending
