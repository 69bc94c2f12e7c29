"""The block of grains, and the specimens that are cut from it, in memory: nothing is simulated here but how grains make room."""

from typing import NamedTuple

import numpy as np

from barchan.domain import Box
from barchan.experiments.rock.parameters import GRIP, SHOULDER, WAIST
from barchan.packing.scatter import scatter
from barchan.packing.sizes import Uniform


class Specimen(NamedTuple):
    """Grains of a specimen about its axis, x = y = 0; z from 0 to its height.

    ``position``: (k, 3) [m]. ``radius``: (k,) [m].
    """

    position: np.ndarray
    radius: np.ndarray

    @property
    def ends(self):
        """Where the lowest grain begins and the highest ends [m]."""
        return float((self.position[:, 2] - self.radius).min()), float((self.position[:, 2] + self.radius).max())


def specimens_of(scene):
    """Test -> ``Specimen``, of all tests of a ``Rock``, cut from one ``block``."""
    whole = block(scene)
    return {test: cut(scene, test, *whole) for test in scene.tests}


def block(scene):
    """Grains without order, which touch nobody, between floor and top; periodic along x and y.

    Returns:
        Positions (grains, 3), x and y about the middle, and radii (grains,) [m].

    Raises:
        RunError: they found no room.
    """
    smallest, largest = scene.radii
    radius = Uniform(2.0 * smallest, 2.0 * largest).radii(scene.seed, np.arange(scene.grains))
    x, y = 0.5 * scene.disc, 0.5 * scene.width
    packing = scatter(Box((-x, -y, 0.0), (x, y, scene.height), (True, True, False)), radius, scene.seed)
    return packing.position, packing.radius


def cut(scene, test, position, radius):
    """The specimen for a test, as a saw would cut it: grains whose centres lie inside.

    That for compression comes from one half of the block, that for tension, a dumbbell, from the other, the disc from the whole.
    The grains at floor and top are in, so that ends are flat.

    Args:
        position, radius: of the ``block``.

    Returns:
        ``Specimen``.
    """
    x, _, z = position.T
    if test == "brazilian":
        inside = np.hypot(x, z - 0.5 * scene.height) < 0.5 * scene.disc
        return Specimen(position[inside], radius[inside])
    moved = position + np.array([0.5 * scene.width if test == "compression" else -0.5 * scene.width, 0.0, 0.0])
    inside = np.abs(moved[:, :2]).max(axis=1) < 0.5 * scene.width * (outline(z / scene.height) if test == "tension" else 1.0)
    return Specimen(moved[inside], radius[inside])


def outline(z):
    """Width of the specimen for tension, relative to that of its ends, at heights (k,) relative to its own, (k,)."""
    share = np.clip((np.minimum(z, 1.0 - z) - GRIP) / (SHOULDER - GRIP), 0.0, 1.0)  # of the way from the grip to the waist
    return 1.0 - (1.0 - WAIST) * 0.5 * (1.0 - np.cos(np.pi * share))
