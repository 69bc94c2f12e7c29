"""What was computed, counted in one way for all codes, from positions and velocities alone."""

import numpy as np

#: Grains whose neighbours are looked up at a time; bounds the memory.
BATCH = 50_000

#: Neighbouring cells, each pair of cells once, and a cell with itself.
_OFFSETS = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) >= (0, 0, 0)]


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
    cells = np.maximum((extent / case.diameter).astype(int), 1)
    if (cells[periodic] < 3).any():
        raise ValueError("a period must be at least three diameters, or pairs of cells are met twice")
    place = np.minimum(((position - origin) / (extent / cells)).astype(int), cells - 1)
    number = np.ravel_multi_index(place.T, cells)
    order = np.argsort(number, kind="stable")
    touching = 0
    for begin in range(0, len(order), BATCH):
        rows = order[begin : begin + BATCH]
        for offset in _OFFSETS:
            i, j = _candidates(rows, place, offset, cells, periodic, number[order], order)
            if offset == (0, 0, 0):
                i, j = i[i < j], j[i < j]
            apart = position[i] - position[j]
            apart -= np.where(periodic, length * np.round(apart / length), 0.0)
            near = (apart**2).sum(axis=1) < (radius[i] + radius[j]) ** 2
            touching += int((near & ~(case.grains.frozen[i] & case.grains.frozen[j])).sum())
    if case.floor is not None:
        touching += int((seen["position"][:, 2] - case.floor < radius)[~case.grains.frozen].sum())
    return touching


def _candidates(rows, place, offset, cells, periodic, sorted_numbers, order):
    """Pairs (i, j) of the grains ``rows`` with those in the cell ``offset`` from their own."""
    there = place[rows] + offset
    inside = (periodic | ((there >= 0) & (there < cells))).all(axis=1)
    rows, there = rows[inside], there[inside] % cells
    number = np.ravel_multi_index(there.T, cells)
    first, last = (np.searchsorted(sorted_numbers, number, side=side) for side in ("left", "right"))
    found = last - first
    slot = np.arange(found.sum()) - np.repeat(np.cumsum(found) - found, found)
    return np.repeat(rows, found), order[np.repeat(first, found) + slot]
