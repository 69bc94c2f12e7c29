"""Adhesion of Johnson, Kendall & Roberts: soft grains that stick, and hold together beyond touching.

With the contact's radius a, overlap = a^2 / R* - c sqrt(a) and F_n = 4 E* a^3 / (3 R*) - 2 E* c a^(3/2), c = sqrt(2 pi w / E*),
w the work of adhesion: what it takes to part a unit of area, twice the surface energy of equal materials. It begins where the
grains touch, with a pull of 8/9 of the largest, 1.5 pi w R*, and lasts until they are 3/4 (pi^2 w^2 R* / E*^2)^(1/3) apart.
It suits large, soft grains (Tabor's number above about 5).

a is the square of the larger root s of s^4 - c R* s = R* overlap: four steps of Newton's method from a start that is near
everywhere are exact to rounding (1e-14; 1e-8 of s at the very end of the contact, where two roots meet), and processors have all
they need in vectors. Tsuji's dashpot takes away at most what pushes, and is a's; so is the stiffness of the shear force, 8 G* a.
Friction is at most mu (F_n + 3 pi w R*) (Thornton, J. Phys. D 24, 1942, 1991). Without adhesion this is ``hertz_mindlin``.
Sources: Johnson, Kendall & Roberts, Proc. R. Soc. A 324, 301, 1971; Marshall, J. Comput. Phys. 228, 1541, 2009.
"""

from math import pi, sqrt

from barchan.laws.dmt import ADHESION
from barchan.laws.friction import synchronised
from barchan.laws.hertz_mindlin import PROPERTIES, mindlin_shear, mix_with
from barchan.laws.law import law
from barchan.laws.vector import dot, scale

#: Least c R*: without adhesion there would be divisions by zero.
LEAST = 1e-60

CUBE_ROOT_OF_4 = 4.0 ** (1.0 / 3.0)


def mix(first, second):
    """Pair parameters of ``hertz_mindlin``, and c = sqrt(2 pi w / E*) [length^(1/2)]."""
    mixed = mix_with(ADHESION)(first, second)
    return mixed | {"adhesion": sqrt(2.0 * pi * mixed["work_of_adhesion"] / mixed["E_eff"])}


def cube_root(x):
    """Cube root of a number from 1e-60 to 1e60, by square roots and divisions alone.

    >>> cube_root(27.0)
    3.0
    """
    power = sqrt(sqrt(x))
    root = power
    for _ in range(4):  # x^(1/4 + 1/16 + 1/64 ...)
        power = sqrt(sqrt(power))
        root = root * power
    for _ in range(3):  # Halley's method
        cube = root * root * root
        root = root * (cube + 2.0 * x) / (2.0 * cube + x)
    return root


def last_root(radius_eff, adhesion):
    """s = sqrt(a) where the contact ends."""
    return cube_root(0.25 * max(adhesion * radius_eff, LEAST))


def reach(radius_eff, adhesion):
    """How far two surfaces are apart when the contact ends [length]."""
    return 3.0 * last_root(radius_eff, adhesion) ** 4 / radius_eff if adhesion > 0.0 else 0.0


def root_of_contact_radius(overlap, radius_eff, adhesion):
    """s = sqrt(a), the larger root of s^4 - c R* s = R* overlap."""
    linear, last = max(adhesion * radius_eff, LEAST), last_root(radius_eff, adhesion)
    farthest = 3.0 * last**4 / radius_eff
    overlap = max(overlap, -farthest)
    touching = CUBE_ROOT_OF_4 * linear * last  # s^4 of grains that just touch
    pressed = sqrt(sqrt(touching + max(overlap, 0.0) * radius_eff))
    pulled = last * (1.0 + sqrt(0.5 * (1.0 + min(overlap, 0.0) / farthest)))
    s = pressed if overlap > 0.0 else pulled
    for _ in range(4):
        cube = s * s * s
        s = s - (cube * s - linear * s - overlap * radius_eff) / max(4.0 * cube - linear, 1e-7 * linear)
    return s


def drawn(s, radius_eff, adhesion):
    """Integral of the normal force over the overlap, from s = 0, over E*."""
    cube, pull = s * s * s, adhesion * radius_eff
    return (8.0 / 15.0 * cube * cube * cube - 4.0 / 3.0 * pull * cube * cube + 0.5 * pull * pull * cube) * s / radius_eff**2


def energy(overlap, radius_eff, E_eff, G_eff, adhesion, shear):
    """Work of the normal force from overlap 0 on, and what a spring of the present stiffness stores."""
    s = root_of_contact_radius(overlap, radius_eff, adhesion)
    first = root_of_contact_radius(0.0, radius_eff, adhesion)
    work = E_eff * (drawn(s, radius_eff, adhesion) - drawn(first, radius_eff, adhesion))
    return work, dot(shear, shear) / (16.0 * G_eff * s * s)


@law(
    properties=PROPERTIES | ADHESION,
    history={"shear": 3},
    lever="lens",
    mix=mix,
    adhesive=True,
    reach=reach,
    energy=energy,
)
def jkr(
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
    adhesion,
    shear,
):
    """Hertz-Mindlin with the adhesion of Johnson, Kendall and Roberts."""
    s = root_of_contact_radius(overlap, radius_eff, adhesion)
    a = s * s
    eta = alpha * sqrt(mass_eff * 4.0 / 3.0 * E_eff * a)
    pushing = max(4.0 / 3.0 * E_eff * a * a * a / radius_eff - eta * normal_velocity, 0.0)
    normal_force = pushing - 2.0 * E_eff * adhesion * a * s
    shear = synchronised(shear, scale(-8.0 * G_eff * a, slip_velocity_half), normal_half, normal, dt)
    largest_pull = 0.75 * E_eff * adhesion * adhesion * radius_eff  # 1.5 pi w R*
    limit = friction * max(normal_force + 2.0 * largest_pull, 0.0)
    force, shear = mindlin_shear(limit, eta, tangential_velocity, shear)
    return normal_force, force, shear
