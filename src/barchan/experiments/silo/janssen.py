"""Stresses at the wall of a silo, and the law of Janssen (1895) beside them.

Each slice of sand is carried by the one below it and by friction at the wall. With a horizontal pressure K times the vertical one
and a friction mu times that, p(z) = rho_b g R / (2 mu) (1 - exp(-2 mu K z / R)) at a depth z in a silo of radius R.
"""

from typing import NamedTuple

import numpy as np


class Wall(NamedTuple):
    """Stresses over the depth below the surface, (rings,) each: ``depth`` [m], ``pressure`` on the wall, ``friction`` at it and
    ``vertical`` pressure in the sand [Pa]; their ratios ``k`` = pressure / vertical and ``mobilised`` = friction / pressure [1],
    and what Janssen says with these, ``janssen`` [Pa]."""

    depth: np.ndarray
    pressure: np.ndarray
    friction: np.ndarray
    vertical: np.ndarray
    k: float
    mobilised: float
    janssen: np.ndarray

    @property
    def miss(self):
        """Root mean square of pressure - janssen, relative to the mean pressure."""
        return float(np.sqrt(((self.pressure - self.janssen) ** 2).mean()) / self.pressure.mean())


def stresses(height, mass, pressing, friction, fill, scene):
    """The ``Wall`` of a silo, or of the mean of several.

    Args:
        height: (rings,) of the middle of each ring, ascending and evenly spaced [m].
        mass: (rings,) of the grains in each [kg].
        pressing, friction: (rings,) what grains do to each, outwards and downwards [N].
        fill: height of the surface [m].
        scene: a ``Silo``.
    """
    ring, radius = height[1] - height[0], 0.5 * scene.silo_diameter
    load = scene.gravity * mass - friction  # what a slice hands on to the one below
    above = np.cumsum(load[::-1])[::-1] - 0.5 * load
    inside = height < fill
    surface = 2.0 * np.pi * radius * ring
    depth, pressure = fill - height[inside], pressing[inside] / surface
    shear, vertical = friction[inside] / surface, above[inside] / scene.area
    k, mobilised = pressure.sum() / vertical.sum(), shear.sum() / pressure.sum()
    density = mass.sum() / (scene.area * fill)
    law = janssen(depth, density * scene.gravity, radius, k, mobilised)
    return Wall(depth, pressure, shear, vertical, float(k), float(mobilised), law)


def janssen(depth, unit_weight, radius, k, friction):
    """Pressure on the wall at a depth [Pa]; K times the weight above where there is no friction.

    Args:
        depth: [m]. unit_weight: rho_b g [N/m^3]. radius: of the silo [m]. k, friction: [1].
    """
    rate = 2.0 * friction * k / radius
    return k * unit_weight * (-np.expm1(-rate * depth) / rate if rate > 0.0 else depth)
