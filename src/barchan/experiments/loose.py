"""Loose sand, as experiments start with it: on a lattice with some room, irregular by as much; and what sand and walls are of."""

from math import ceil

import numpy as np

from barchan.chance import uniform
from barchan.materials import Material
from barchan.packing.lattice import lattice

#: Distance of neighbours on the lattice, in largest diameters: some room to stand irregularly.
SPACING = 1.04

#: Solid fraction that no sand at rest falls below: random loose packing is 0.55, and walls cost some of it.
LOOSEST = 0.5


def cell_edge(radius_max):
    """Edge of a cell of the lattice, body-centred: neighbours stand along half its diagonal [length]."""
    return 2.0 * radius_max * SPACING / (0.5 * 3.0**0.5)


def room(radius_max):
    """How far places are from walls, so that a shifted grain of any size touches none [length]."""
    return SPACING * radius_max


def places(count, low, high, bottom, radius_max, inside):
    """The lowest ``count`` places of the lattice over a base, (count, 3) [length].

    Args:
        low, high: corners of the brick around the base, x and y [length].
        bottom: height of its floor [length].
        inside: function of points (k, 3) that says which are within the base, (k,) booleans.
    """
    edge = cell_edge(radius_max)
    low = (*low, bottom)
    across = [ceil((b - a) / edge) for a, b in zip(low, high)]
    in_a_layer = int(inside(lattice("bcc", edge, low, (*across, 1))).sum())
    points = lattice("bcc", edge, low, (*across, count // in_a_layer + 1))
    points = points[inside(points)]
    return points[np.argsort(points[:, 2], kind="stable")][:count]


def places_in_tube(count, tube_radius, bottom, radius_max):
    """The same in a tube about the z axis."""
    corner = (tube_radius, tube_radius)
    within = tube_radius - room(radius_max)
    return places(count, (-corner[0], -corner[1]), corner, bottom, radius_max, lambda p: np.hypot(p[:, 0], p[:, 1]) < within)


def disc_floor(radius, diameter):
    """Places of grains glued to a round floor, one on each square of a diameter, in the plane z = 0, (k, 3) [length]."""
    x = diameter * (np.arange(ceil(radius / diameter)) + 0.5)
    x = np.concatenate([-x[::-1], x])
    points = np.stack(np.meshgrid(x, x, 0.0, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[np.hypot(points[:, 0], points[:, 1]) <= radius]


def glued(scene, stream, points):
    """The same at irregular places: each is shifted across by at most a quarter of a diameter."""
    return points + irregular(scene, stream, points.shape, 0.25 * scene.diameter) * (1.0, 1.0, 0.0)


def shifts(scene, stream, count):
    """Random shifts that take grains of the lattice to no other one, (count, 3) [length]."""
    return irregular(scene, stream, (count, 3), (SPACING - 1.0) * scene.radius_max / 3.0**0.5)


def radii(scene, stream, count):
    """Random radii, uniform between the smallest and the largest of the scene, (count,) [length]."""
    return scene.radius_min + (scene.radius_max - scene.radius_min) * _draw(scene, stream, count)


def irregular(scene, stream, shape, most):
    """Random shifts of at most ``most`` along each axis [length].

    Args:
        stream: number of the row of random numbers: one for each thing they are drawn for.
    """
    return most * (2.0 * _draw(scene, stream, shape[0] * shape[1]).reshape(shape) - 1.0)


def _draw(scene, stream, count):
    """Random numbers by their own number: every rank draws the same."""
    return uniform(scene.seed + (stream << 64), np.arange(count))


def materials(scene, **frictions):
    """Sand, and walls of the same stiffness: name of a wall's material -> its friction."""
    elastic = {name: getattr(scene, name) for name in ("youngs_modulus", "poisson_ratio", "restitution")}
    walls = [Material(name, friction=friction, **elastic) for name, friction in frictions.items()]
    return [Material("sand", scene.density, friction=scene.friction, **elastic), *walls]
