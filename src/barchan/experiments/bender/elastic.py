"""Speeds of waves that theory knows: of a crystal exactly, of a random packing if all grains moved with the sample.

Contacts of equal grains have the stiffnesses of Hertz and Mindlin, kn = 2 E* a and kt = 8 G* a with a^3 = 3 F R* / (4 E*).
"""

from math import pi, sqrt
from typing import NamedTuple

#: dt <= SAFE sqrt(m/k), as for any scene.
SAFE = 0.17

#: The largest force in a pressed sample over pressure times diameter squared: 8 were found in samples of 8,700 grains.
LARGEST = 8.0


class Contact(NamedTuple):
    """Of two equal grains under a force: overlap [m], normal and tangential stiffness [N/m]."""

    overlap: float
    kn: float
    kt: float


class Speeds(NamedTuple):
    """Of shear and compression waves [m/s]."""

    shear: float
    compression: float

    def of(self, kind):
        """By the kind of a ``Shot``."""
        return self.shear if kind == "S" else self.compression


def contact(scene, force):
    """The ``Contact`` of two grains of the mean diameter under a normal force [N]."""
    modulus, radius = 0.5 * scene.youngs_modulus / (1.0 - scene.poisson_ratio**2), 0.25 * scene.diameter
    a = (0.75 * force * radius / modulus) ** (1.0 / 3.0)
    shear = scene.youngs_modulus / (4.0 * (2.0 - scene.poisson_ratio) * (1.0 + scene.poisson_ratio))
    return Contact(a * a / radius, 2.0 * modulus * a, 8.0 * shear * a)


def crystal_contact(scene):
    """The ``Contact`` in a face-centred cubic crystal under the pressure of the scene: F = p d^2 / (2 sqrt2), with the distance d
    of neighbours."""
    distance = scene.diameter
    for _ in range(50):  # it depends on the force, hardly
        found = contact(scene, scene.pressure * distance**2 / (2.0 * sqrt(2.0)))
        distance = scene.diameter - found.overlap
    return found


def stable_step(scene, found):
    """Longest time step for the lightest grain where no ``Contact`` is stiffer than ``found`` [s]."""
    radius = scene.radius_min if scene.packing == "random" else 0.5 * scene.diameter
    return SAFE * sqrt(scene.density * 4.0 / 3.0 * pi * radius**3 / found.kn)


def stiffest_contact(scene):
    """The ``Contact`` that bears most in a sample under the pressure of the scene, as far as that is known before."""
    if scene.packing == "fcc":
        return crystal_contact(scene)
    return contact(scene, LARGEST * scene.pressure * scene.diameter**2)


def crystal_speeds(scene):
    """``Speeds`` along [001] of that crystal: C11 = sqrt2 (kn + kt)/d, C44 half of it, density sqrt2 m/d^3, of long waves."""
    found = crystal_contact(scene)
    fast = (scene.diameter - found.overlap) * sqrt((found.kn + found.kt) / scene.grain_mass)
    return Speeds(fast / sqrt(2.0), fast)


def affine_speeds(scene, solid_fraction, coordination, pressure):
    """``Speeds`` of a random packing if all its grains moved with the sample and bore alike: no real one is faster.

    G = z phi (kn + 3/2 kt) / (5 pi d), K = z phi kn / (3 pi d), at the mean force F = pi d^2 p / (z phi). Source: Walton, J.
    Mech. Phys. Solids 35, 213 (1987), rough spheres.

    Args:
        coordination: contacts of a grain, of all grains.
        pressure: mean stress [Pa].
    """
    density = solid_fraction * coordination
    found = contact(scene, pi * scene.diameter**2 * pressure / density)
    shear = density * (found.kn + 1.5 * found.kt) / (5.0 * pi * scene.diameter)
    bulk = density * found.kn / (3.0 * pi * scene.diameter)
    mass = scene.density * solid_fraction
    return Speeds(sqrt(shear / mass), sqrt((bulk + 4.0 / 3.0 * shear) / mass))
