"""Resistance to rolling and twisting: couples that any law may return beside its forces.

omega is the angular velocity of the first grain relative to the second. Its part in the plane of the contact is rolling, that
along the normal twisting. A couple opposes it, up to the limit mu R* F_n: mu is the arm, in units of R*, at which the resultant
of the pressure on the contact may act. Two kinds:

- constant: the limit itself, against the rotation, from the first motion on (model A of Ai, Chen, Rotter & Ooi, Powder Technology
  206, 269, 2011). Slower than the limit could stop within a step, it is proportional to omega, so that it brings to rest and does
  not turn round.
- spring, dashpot and slider (model C of the same): a spring that winds up, k = 9/4 k_n (mu R*)^2, and a dashpot of a given
  damping ratio, together at most the limit. What is at rest stays so, under a couple below the limit.

The spring's couple is the memory. It is turned with the contact and shortened when it slips, as friction is (``friction.py``).
Sources: Iwashita & Oda, J. Eng. Mech. 124, 285, 1998 and Ai et al. 2011 for the spring; Luding, Granular Matter 10, 235, 2008 and
Marshall, J. Comput. Phys. 228, 1541, 2009 for rolling and twisting alike with slider and memory.
"""

from math import sqrt

from barchan.laws.friction import sliding_ratio, synchronised
from barchan.laws.law import Property
from barchan.laws.vector import add, dot, norm, project, scale, sub

#: What a material needs for them. At zero friction the couple is zero.
CONSTANT = {name: Property("1", default=0.0) for name in ("rolling_friction", "twisting_friction")}
SPRING = CONSTANT | {"rolling_damping": Property("1", default=0.3)}

#: Moments of inertia of a sphere of mass and radius 1: about its centre, in twisting; about the contact, in rolling.
ABOUT_CENTRE, ABOUT_CONTACT = 0.4, 1.4


def against(rotation, limit, inertia, dt):
    """The couple ``limit`` against a rotation, less where it would turn it round within a step.

    Args:
        rotation: part of the relative angular velocity, a vector [1/time].
        limit: largest couple [force length].
        inertia: what turns at least [mass length^2].
    """
    slowest = max(norm(rotation), limit * dt / inertia)
    share = limit / slowest if slowest > 0.0 else 0.0
    return scale(-share, rotation)


def constant_couple(relative_omega, normal, normal_force, radius_eff, mass_eff, dt, rolling_friction, twisting_friction):
    """Constant resistance to rolling and twisting: the couple on the first grain [force length].

    Args:
        normal_force: without what it has from adhesion [force].
    """
    most, inertia = radius_eff * normal_force, ABOUT_CENTRE * mass_eff * radius_eff * radius_eff
    twisting = scale(dot(relative_omega, normal), normal)
    return add(
        against(sub(relative_omega, twisting), rolling_friction * most, inertia, dt),
        against(twisting, twisting_friction * most, inertia, dt),
    )


def spring_and_dashpot(stiffness_n, arm, inertia, damping):
    """Stiffness 9/4 k_n arm^2 [force length] and damping constant [force length time] of the spring that resists a rotation."""
    stiffness = 2.25 * stiffness_n * arm * arm
    return stiffness, 2.0 * damping * sqrt(inertia * stiffness)


def heaviness(radius_first, radius_second, mass_eff):
    """m* R^2 with the smaller radius: times 2/5 or 7/5 the moment of inertia of both grains for twisting and rolling. Exact for
    equal grains, at a flat wall, and for a small grain at a large one."""
    radius = min(radius_first, radius_second)
    return mass_eff * radius * radius


def rolling_couple(rolled, relative_omega, normal, normal_half, dt, limit, stiffness, damping):
    """The couple against rolling, and the memory of it.

    Args:
        rolled: couple of the spring, a vector in the plane of the contact [force length].
        limit: largest couple [force length].
        stiffness, damping: of ``spring_and_dashpot``.

    Returns:
        (couple on the first grain, new ``rolled``).
    """
    rate = scale(-stiffness, project(relative_omega, normal_half))
    rolled = synchronised(rolled, rate, normal_half, normal, dt)
    viscous = scale(damping, project(relative_omega, normal))
    trial = sub(rolled, viscous)
    ratio = sliding_ratio(trial, limit)
    couple = scale(ratio, trial)
    if ratio < 1.0:
        rolled = add(couple, viscous)
    return couple, rolled


def twisting_couple(twisted, relative_omega, normal, normal_half, dt, limit, stiffness, damping):
    """The couple against twisting, and the memory of it: as ``rolling_couple``, with a number for what lies along the normal.

    Returns:
        (couple on the first grain, a vector; new ``twisted``).
    """
    twisted = twisted - stiffness * dt * dot(relative_omega, normal_half)
    rate = dot(relative_omega, normal)
    trial = twisted - damping * rate
    couple = min(max(trial, -limit), limit)
    if couple != trial:
        twisted = couple + damping * rate
    return scale(couple, normal), twisted
