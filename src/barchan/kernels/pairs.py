"""Finds the pairs of grains that may touch before the next rebuild: the second half of the neighbour search."""

import numpy as np

from barchan.kernels.cells import HALF, LENGTH, SHAPE, WRAPS
from barchan.kernels.compiler import helper, kernel, prange


@helper
def neighbour_range(c, n, wraps):
    """First and last neighbour cell along one axis, relative to ``c``; each cell of a short period is met once."""
    if wraps != 0.0:
        if n >= 3:
            return -1, 1
        if n == 2:
            return 0, 1
        return 0, 0
    return (-1 if c > 0 else 0), (1 if c < n - 1 else 0)


@helper
def near(place, i, j, skin, grid):
    """True if the surfaces of two grains are closer than ``skin``."""
    square = 0.0
    for c in range(3):
        d = place[i, c] - place[j, c]
        if d > grid[HALF, c]:
            d -= grid[LENGTH, c]
        if d < -grid[HALF, c]:
            d += grid[LENGTH, c]
        square += d * d
    reach = place[i, 3] + place[j, 3] + skin
    return square < reach * reach


@helper
def search(i, n_owned, place, frozen, cell, start, rows, grid, skin, found, offset):
    """Neighbours of grain ``i`` that are its to list: owned ones of a higher row, and ghosts. Writes them to ``found``
    from ``offset`` on unless ``offset`` is negative; returns their number."""
    count = 0
    nx, ny, nz = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2])
    own = np.int64(cell[i])
    cx = own % nx
    cy = (own // nx) % ny
    cz = own // (nx * ny)
    x0, x1 = neighbour_range(cx, nx, grid[WRAPS, 0])
    y0, y1 = neighbour_range(cy, ny, grid[WRAPS, 1])
    z0, z1 = neighbour_range(cz, nz, grid[WRAPS, 2])
    for sz in range(z0, z1 + 1):
        for sy in range(y0, y1 + 1):
            for sx in range(x0, x1 + 1):
                c = (((cz + sz + nz) % nz) * ny + (cy + sy + ny) % ny) * nx + (cx + sx + nx) % nx
                for q in range(start[c], start[c + 1]):
                    j = rows[q]
                    if j <= i and j < n_owned:
                        continue
                    if frozen[i] != 0 and frozen[j] != 0:
                        continue
                    if near(place, i, j, skin, grid):
                        if offset >= 0:
                            found[offset + count] = j
                        count += 1
    return count


@kernel(parallel=True)
def count_pairs(n_owned, place, frozen, cell, start, rows, grid, skin, counts):
    """Write the number of listed neighbours of each owned grain into ``counts``."""
    for i in prange(n_owned):
        counts[i] = search(np.int64(i), n_owned, place, frozen, cell, start, rows, grid, skin, rows, -1)


@kernel(parallel=True)
def fill_pairs(n_owned, place, frozen, ids, cell, start, rows, grid, skin, offsets, first, second):
    """Write the pairs into ``first`` and ``second``: the grain with the smaller id first, whoever owns it."""
    for i in prange(n_owned):
        begin = offsets[i]
        count = search(np.int64(i), n_owned, place, frozen, cell, start, rows, grid, skin, second, begin)
        for k in range(begin, begin + count):
            j = second[k]
            if ids[i] < ids[j]:
                first[k] = i
            else:
                first[k] = j
                second[k] = i


@kernel()
def count_incidence(n_owned, first, second, wall_grain, start):
    """Write into ``start`` (n_owned + 1,) where the contacts of each owned grain begin."""
    start[:] = 0
    for k in range(wall_grain.shape[0]):
        start[wall_grain[k] + 1] += 1
    for k in range(first.shape[0]):
        if first[k] < n_owned:
            start[first[k] + 1] += 1
        if second[k] < n_owned:
            start[second[k] + 1] += 1
    for i in range(n_owned):
        start[i + 1] += start[i]


@kernel()
def fill_incidence(n_owned, first, second, wall_grain, start, incidence):
    """Write each contact, as 2 * contact + side, to its owned grains; wall contacts are numbered after the pairs.
    ``incidence`` is modified; ``start`` is left as it was."""
    n_pairs = first.shape[0]
    for k in range(wall_grain.shape[0]):
        i = wall_grain[k]
        incidence[start[i]] = 2 * (n_pairs + k)
        start[i] += 1
    for k in range(n_pairs):
        i = first[k]
        if i < n_owned:
            incidence[start[i]] = 2 * k
            start[i] += 1
        j = second[k]
        if j < n_owned:
            incidence[start[j]] = 2 * k + 1
            start[j] += 1
    for i in range(n_owned, 0, -1):
        start[i] = start[i - 1]
    start[0] = 0


@helper
def partner_key(entry, first, second, ids, wall_key):
    """Key of the partner in a contact: the id of a grain, or the negative key of a wall."""
    k = entry >> 1
    if k >= first.shape[0]:
        return wall_key[k - first.shape[0]]
    return ids[first[k]] if entry & 1 else ids[second[k]]


@kernel(parallel=True)
def sort_incidence(n_owned, first, second, ids, wall_key, start, incidence):
    """Bring the contacts of each grain into ascending order of the partner's key. ``incidence`` is modified."""
    for i in prange(n_owned):
        for q in range(start[i] + 1, start[i + 1]):
            entry = incidence[q]
            key = partner_key(entry, first, second, ids, wall_key)
            p = q
            while p > start[i] and partner_key(incidence[p - 1], first, second, ids, wall_key) > key:
                incidence[p] = incidence[p - 1]
                p -= 1
            incidence[p] = entry
