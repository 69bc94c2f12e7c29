"""What was computed, counted in one way for all codes, from positions and velocities alone."""

from itertools import product
from typing import NamedTuple

import numpy as np

#: Grains whose neighbours are looked up at a time; bounds the memory.
BATCH = 50_000

#: Neighbouring cells, a cell with itself in the middle: from there on, each pair of cells comes once.
_OFFSETS = list(product((-1, 0, 1), repeat=3))


def kinetic_energy(case, seen):
    """Kinetic energy of all grains, translation and rotation [force length].

    Args:
        case: a ``Case``.
        seen: {"position", "velocity", "omega"}, (n, 3) each.
    """
    grains = case.grains
    mass = 4.0 / 3.0 * np.pi * grains.radius**3 * grains.density
    squared = [(seen[name] ** 2).sum(axis=1) for name in ("velocity", "omega")]
    return float(0.5 * (mass * squared[0] + 0.4 * mass * grains.radius**2 * squared[1]).sum())


def count_contacts(case, seen):
    """How many contacts touch: pairs of grains, at least one of which moves, and grains on the floor. Takes what
    ``kinetic_energy`` does."""
    radius, periodic = case.grains.radius, np.array(case.periodic)
    low, length = np.array(case.low), np.subtract(case.high, case.low)
    position = np.where(periodic, (seen["position"] - low) % length, seen["position"] - low)
    origin = np.where(periodic, 0.0, position.min(axis=0))
    extent = np.where(periodic, length, np.ptp(position, axis=0) + case.diameter)
    level, touching = np.frexp(radius)[1], 0
    for number in np.unique(level):  # sizes within a factor of two; smaller grains look for these
        diameter = 2.0 * radius[level == number].max()
        cells = np.maximum((extent / diameter).astype(int), 1)
        if (cells[periodic] < 3).any():
            raise ValueError("a period must be at least three diameters, or pairs of cells are met twice")
        place = np.minimum(((position - origin) / (extent / cells)).astype(int), cells - 1)
        targets = _Sorted.of(np.flatnonzero(level == number), place, cells)
        smaller = np.flatnonzero(level < number)
        for begin in range(0, len(targets.rows), BATCH):
            rows = targets.rows[begin : begin + BATCH]
            for offset in _OFFSETS[len(_OFFSETS) // 2 :]:
                i, j = _candidates(rows, place, offset, cells, periodic, targets)
                if offset == (0, 0, 0):
                    i, j = i[i < j], j[i < j]
                touching += _touch(case, position, i, j)
        for begin in range(0, len(smaller), BATCH):
            rows = smaller[begin : begin + BATCH]
            touching += sum(_touch(case, position, *_candidates(rows, place, o, cells, periodic, targets)) for o in _OFFSETS)
    if case.floor is not None:
        touching += int((seen["position"][:, 2] - case.floor < radius)[~case.grains.frozen].sum())
    return touching


class _Sorted(NamedTuple):
    """Some grains, ``rows``, in ascending order of the ``numbers`` of their cells."""

    rows: np.ndarray
    numbers: np.ndarray

    @classmethod
    def of(cls, rows, place, cells):
        number = np.ravel_multi_index(place[rows].T, cells)
        order = np.argsort(number, kind="stable")
        return cls(rows[order], number[order])


def _touch(case, position, i, j):
    """How many of the pairs (i, j) touch, frozen ones apart."""
    radius, frozen, length = case.grains.radius, case.grains.frozen, np.subtract(case.high, case.low)
    apart = position[i] - position[j]
    apart -= np.where(case.periodic, length * np.round(apart / length), 0.0)
    near = (apart**2).sum(axis=1) < (radius[i] + radius[j]) ** 2
    return int((near & ~(frozen[i] & frozen[j])).sum())


def _candidates(rows, place, offset, cells, periodic, targets):
    """Pairs (i, j) of the grains ``rows`` with those of the ``targets`` in the cell ``offset`` from their own."""
    there = place[rows] + offset
    inside = (periodic | ((there >= 0) & (there < cells))).all(axis=1)
    rows, there = rows[inside], there[inside] % cells
    number = np.ravel_multi_index(there.T, cells)
    first, last = (np.searchsorted(targets.numbers, number, side=side) for side in ("left", "right"))
    found = last - first
    slot = np.arange(found.sum()) - np.repeat(np.cumsum(found) - found, found)
    return np.repeat(rows, found), targets.rows[np.repeat(first, found) + slot]
