"""Lattices: regular starting states with a wanted void fraction."""

from math import pi

import numpy as np

from barchan.errors import SceneError

#: Grains per cubic cell, and the distance of nearest neighbours relative to the cell's edge.
_LATTICES = {
    "bcc": (((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)), 0.5 * 3.0**0.5),
    "fcc": (((0.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5)), 0.5 * 2.0**0.5),
    "sc": (((0.0, 0.0, 0.0),), 1.0),
}


def per_cell(kind):
    """Grains in a cubic cell of a lattice.

    >>> per_cell("bcc")
    2
    """
    return len(_LATTICES[kind][0])


def mean_volume(radius_min, radius_max):
    """Mean volume of spheres with uniformly distributed radii [length^3].

    >>> round(mean_volume(1.0, 1.0) / (4 / 3 * pi), 12)
    1.0
    """
    return pi / 3.0 * (radius_min + radius_max) * (radius_min**2 + radius_max**2)


def cell_edge(kind, void_fraction, radius_min, radius_max):
    """Edge of the cubic cell of a lattice with the wanted void fraction [length].

    Raises:
        SceneError: no such lattice, or the largest grains would overlap on it.
    """
    if kind not in _LATTICES:
        raise SceneError(f"lattice = {kind!r} is unknown; there are: {', '.join(_LATTICES)}")
    basis, nearest = _LATTICES[kind]
    edge = (len(basis) * mean_volume(radius_min, radius_max) / (1.0 - void_fraction)) ** (1.0 / 3.0)
    if edge * nearest < 2.0 * radius_max:
        raise SceneError(
            f"lattice = '{kind}' with void fraction {void_fraction:g} puts neighbours {edge * nearest:.6g} apart, less than the "
            f"largest diameter {2.0 * radius_max:.6g} [length]: they would overlap. Use bcc or fcc, or a larger void fraction"
        )
    return edge


def lattice(kind, edge, low, cells):
    """Points of a lattice of ``cells`` (3,) cubic cells from the corner ``low`` on, (k, 3) [length].

    The first point lies a quarter of an edge inside the corner, so that layers are spaced evenly across periodic faces.
    """
    return lattice_within(kind, edge, low, cells, (np.full(3, -np.inf), np.full(3, np.inf)))[1]


def lattice_within(kind, edge, low, cells, space):
    """The points of a ``lattice`` in the cells that reach into a part of space.

    Args:
        space: its low and high corner [length].

    Returns:
        (number of each among all points of the lattice, ascending; the points, (k, 3) [length]).
    """
    basis, cells = np.array(_LATTICES[kind][0]) + 0.25, np.asarray(cells, dtype=np.int64)
    first, last = (np.clip((np.asarray(corner) - low) / edge, 0, cells) for corner in space)
    ranges = [np.arange(int(np.floor(a)), int(np.ceil(b)), dtype=np.int64) for a, b in zip(first, last)]
    corners = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    number = (corners[:, 0] * cells[1] + corners[:, 1]) * cells[2] + corners[:, 2]
    points = np.asarray(low) + edge * (corners[:, None] + basis).reshape(-1, 3)
    return (number[:, None] * len(basis) + np.arange(len(basis))).ravel(), points
