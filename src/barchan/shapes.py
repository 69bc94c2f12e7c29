"""Shapes of grains: what mass and moment of inertia follow from radius and density."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.words import shown


class Shape(NamedTuple):
    """A shape of grains.

    ``name``: what users call it. ``dimension``: of what it fills, 3 of a volume, 2 of an area. ``gyration``: I/(m r^2).
    """

    name: str
    dimension: int
    gyration: float

    def mass(self, radius, density):
        """Masses [mass], of a density by volume, or of discs by area."""
        return (4.0 / 3.0 * np.pi * radius**3 if self.dimension == 3 else np.pi * radius**2) * density

    def inertia(self, mass, radius):
        """Moments of inertia [mass length^2], of spheres about any axis, of discs about their own."""
        return self.gyration * mass * radius**2


SPHERE, DISC = Shape("sphere", 3, 0.4), Shape("disc", 2, 0.5)


def shape_named(name, box):
    """The ``Shape`` that a user names, for grains in a box.

    Raises:
        SceneError: there is none of that name, or it has no place in this box.
    """
    if name not in (SPHERE.name, DISC.name):
        raise SceneError(f"shape = {shown(name)} must be 'sphere' or 'disc'")
    if name == DISC.name and box.dimension == 3:
        raise SceneError("shape = 'disc' needs a box of two dimensions, such as barchan.Box((0, 0), (2, 1)); this one has three")
    return SPHERE if name == SPHERE.name else DISC
