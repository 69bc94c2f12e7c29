"""Amounts spread over the points of a grid by a smooth kernel, and added up without an order.

An amount is cut into whole numbers of 2^0 and of 2^-32, which are added as integers: the sums are the same on any number of
ranks.
"""

import math
from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import helper, kernel

#: Amounts must be below 2^31: then both sums of a grid point have room for 2^32 of them.
LARGEST = 31

#: Worth of the second whole number.
FINE = 2.0**-32


class Lattice(NamedTuple):
    """The grid: its first corner and the edges of a cell, (3,) each [length]; number of cells and 1 where the box is periodic,
    (3,) each. An axis with one cell is averaged over: distances along it do not count."""

    low: np.ndarray
    cell: np.ndarray
    count: np.ndarray
    periodic: np.ndarray


class Stencil(NamedTuple):
    """Room for the grid points near a place: number along each axis or -1, squared distance, (3, most) each, and weight."""

    index: np.ndarray
    square: np.ndarray
    weight: np.ndarray


@kernel()
def spread(start, branch, amounts, width, lattice, stencil, sums):
    """Add amounts (k, columns) that lie evenly on straight lines from ``start`` to ``start - branch``, (k, 3) each, to ``sums``.

    A line is cut into pieces of at most an eighth of the width, which count in their middle. What lies outside the box counts at
    its face.

    Args:
        width: beyond it the weight is 0 [length].
        lattice: a ``Lattice``.
        stencil: a ``Stencil``, overwritten.
        sums: (cells, columns, 2) whole numbers; modified.
    """
    place, count = np.empty(3), lattice.count
    for k in range(start.shape[0]):
        length = math.sqrt(branch[k, 0] * branch[k, 0] + branch[k, 1] * branch[k, 1] + branch[k, 2] * branch[k, 2])
        pieces = 1 + int(8.0 * length / width)
        for piece in range(pieces):
            for axis in range(3):
                place[axis] = start[k, axis] - (piece + 0.5) / pieces * branch[k, axis]
            share = 1.0 / (pieces * weigh(place, width, lattice, stencil))
            for a, b, c in np.ndindex(stencil.weight.shape):
                weight = stencil.weight[a, b, c] * share
                if weight > 0.0:
                    i = (stencil.index[0, a] * count[1] + stencil.index[1, b]) * count[2] + stencil.index[2, c]
                    for column in range(amounts.shape[1]):
                        amount = amounts[k, column] * weight
                        whole = math.floor(amount)
                        sums[i, column, 0] += whole
                        sums[i, column, 1] += math.floor((amount - whole) / FINE)


@kernel()
def weigh(place, width, lattice, stencil):
    """Fill the ``stencil`` with Lucy's weights, (1 + 3 q) (1 - q)^3 with q = distance / width, and return their sum."""
    for axis in range(3):
        near(axis, place[axis], lattice, stencil)
    total = 0.0
    for a, b, c in np.ndindex(stencil.weight.shape):
        weight = 0.0
        if stencil.index[0, a] >= 0 and stencil.index[1, b] >= 0 and stencil.index[2, c] >= 0:
            weight = lucy(math.sqrt(stencil.square[0, a] + stencil.square[1, b] + stencil.square[2, c]) / width)
        stencil.weight[a, b, c] = weight
        total += weight
    return total


@kernel()
def near(axis, x, lattice, stencil):
    """Fill one axis of the ``stencil`` with the grid points on either side of the coordinate x."""
    count, cell, points = lattice.count[axis], lattice.cell[axis], stencil.weight.shape[axis]
    x = x - lattice.low[axis]
    if not lattice.periodic[axis]:
        x = min(max(x, 0.0), count * cell)
    middle = math.floor(x / cell)
    for o in range(points):
        i = middle + o - points // 2
        distance = (i + 0.5) * cell - x if count > 1 else 0.0
        stencil.square[axis, o] = distance * distance
        if count == 1 or lattice.periodic[axis]:
            i = i % count
        elif i < 0 or i >= count:
            i = -1
        stencil.index[axis, o] = i


@helper
def lucy(q):
    """Lucy's weight, not normalised."""
    if q >= 1.0:
        return 0.0
    rest = 1.0 - q
    return (1.0 + 3.0 * q) * (rest * rest * rest)
