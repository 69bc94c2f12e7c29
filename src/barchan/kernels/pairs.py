"""Finds the pairs of grains that may touch before the next rebuild: the second half of the neighbour search."""

import numpy as np

from barchan.kernels.cells import PERIOD, SHAPE, WRAPS
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
def wrapped(c, n):
    """Cell ``c`` of a period of ``n``, from -1 to n; a division would cost more than all the rest of a line of cells."""
    c = c + n if c < 0 else c
    return c - n if c >= n else c


@helper
def near(place, i, j, skin, grid):
    """True if the surfaces of two grains are closer than ``skin``."""
    dx = abs(place[i, 0] - place[j, 0])
    dy = abs(place[i, 1] - place[j, 1])
    dz = abs(place[i, 2] - place[j, 2])
    dx = min(dx, grid[PERIOD, 0] - dx)
    dy = min(dy, grid[PERIOD, 1] - dy)
    dz = min(dz, grid[PERIOD, 2] - dz)
    reach = place[i, 3] + place[j, 3] + skin
    return dx * dx + dy * dy + dz * dz < reach * reach


@helper
def scan(i, begin, end, place, frozen, skin, grid, found, count):
    """Append the rows in ``begin`` to ``end`` that are near row ``i`` to ``found[i]``; returns their new number, which may
    exceed the room there is: its last place takes what does not count. No branch: five of six candidates are not near, which
    a processor cannot foresee. All indices are unsigned: a signed one may count from the end (measured: a quarter slower)."""
    room = np.uint64(found.shape[1] - 1)
    for j in range(begin, end):
        found[i, min(count, room)] = j
        count += np.uint64(near(place, i, j, skin, grid) & ((frozen[i] & frozen[j]) == 0))
    return count


@helper
def scan_listed(i, begin, end, rows, place, frozen, skin, grid, found, count):
    """The same for rows that are given by a list."""
    room = np.uint64(found.shape[1] - 1)
    for q in range(begin, end):
        j = rows[q]
        found[i, min(count, room)] = j
        count += np.uint64(near(place, i, j, skin, grid) & ((frozen[i] & frozen[j]) == 0))
    return count


@kernel(parallel=True)
def find_pairs(cell, start, ghost_start, ghost_rows, place, frozen, skin, grid, found, counts):
    """Neighbours that each owned grain has to list: owned ones of a higher row, and ghosts.

    Owned rows are sorted by cell, so cell c holds the rows ``start[c]`` to ``start[c + 1]``, and three cells in a line along
    x hold one run of rows. Ghosts are listed by cell in ``ghost_rows``.

    ``found`` (n, room + 1) and ``counts`` (n,) are modified; a count above the room means that the room must grow.
    """
    nx, ny, nz = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2])
    has_ghosts = ghost_rows.shape[0] > 0
    for i in prange(cell.shape[0]):
        own = np.int64(cell[i])
        cx, cy, cz = own % nx, (own // nx) % ny, own // (nx * ny)
        x0, x1 = neighbour_range(cx, nx, grid[WRAPS, 0])
        y0, y1 = neighbour_range(cy, ny, grid[WRAPS, 1])
        z0, z1 = neighbour_range(cz, nz, grid[WRAPS, 2])
        in_line = cx + x0 >= 0 and cx + x1 < nx
        runs = 1 if in_line else x1 - x0 + 1
        width = x1 - x0 if in_line else 0
        above = np.uint64(i + 1)
        count = np.uint64(0)
        for sz in range(z0, z1 + 1):
            for sy in range(y0, y1 + 1):
                line = (wrapped(cz + sz, nz) * ny + wrapped(cy + sy, ny)) * nx
                for run in range(runs):
                    c = line + wrapped(cx + x0 + run, nx)
                    begin, end = max(np.uint64(start[c]), above), np.uint64(start[c + width + 1])
                    count = scan(i, begin, end, place, frozen, skin, grid, found, count)
                    if has_ghosts:
                        begin, end = np.uint64(ghost_start[c]), np.uint64(ghost_start[c + width + 1])
                        count = scan_listed(i, begin, end, ghost_rows, place, frozen, skin, grid, found, count)
        counts[i] = count


@kernel(parallel=True)
def orient_pairs(found, offsets, ids, first, second):
    """Write the pairs into ``first`` and ``second``: the grain with the smaller id first, whoever owns it."""
    for i in prange(found.shape[0]):
        begin = offsets[i]
        for k in range(offsets[i + 1] - begin):
            j = found[i, k]
            if ids[i] < ids[j]:
                first[begin + k] = i
                second[begin + k] = j
            else:
                first[begin + k] = j
                second[begin + k] = i


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
def fill_incidence(n_owned, first, second, wall_grain, slot, touched, start, incidence):
    """Write each contact without a column, as 2 * contact + side, to its owned grains, after the ``touched[i]`` that are there
    already; wall contacts are numbered after the pairs. ``incidence`` is modified; ``start`` is left as it was."""
    n_pairs = first.shape[0]
    for i in range(n_owned):
        start[i] += touched[i]
    for k in range(wall_grain.shape[0]):
        if slot[n_pairs + k] == 0:
            i = wall_grain[k]
            incidence[start[i]] = 2 * (n_pairs + k)
            start[i] += 1
    for k in range(n_pairs):
        if slot[k] == 0:
            i, j = first[k], second[k]
            if i < n_owned:
                incidence[start[i]] = 2 * k
                start[i] += 1
            if j < n_owned:
                incidence[start[j]] = 2 * k + 1
                start[j] += 1
    for i in range(n_owned, 0, -1):
        start[i] = start[i - 1]
    start[0] = 0


@helper
def partner_key(i, entry, first, second, ids, wall_key):
    """Key of the partner of row ``i`` in a contact: the id of a grain, or the negative key of a wall."""
    k = entry >> 1
    if k >= first.shape[0]:
        return wall_key[k - first.shape[0]]
    return ids[first[k] ^ second[k] ^ np.uint32(i)]  # the other of the two, whichever it is, without a branch


@helper
def touching_first(begin, end, incidence, slot):
    """Bring the entries of contacts that have a column before the others, in place; returns where the others begin."""
    last = begin
    for q in range(begin, end):
        entry = incidence[q]
        if slot[entry >> 1] != 0:
            incidence[q] = incidence[last]
            incidence[last] = entry
            last += 1
    return last


@helper
def sort_by_insertion(i, begin, end, incidence, first, second, ids, wall_key):
    """Bring the entries of row ``i`` into ascending order of the partner's key, in place."""
    for q in range(begin, end):
        entry = incidence[q]
        key = partner_key(i, entry, first, second, ids, wall_key)
        p = q
        while p > begin and partner_key(i, incidence[p - 1], first, second, ids, wall_key) > key:
            incidence[p] = incidence[p - 1]
            p -= 1
        incidence[p] = entry


@helper
def sort_by_rank(i, begin, end, incidence, first, second, ids, wall_key, room):
    """The same: an entry goes to the place that is the number of smaller keys. More comparisons than an insertion makes, but
    none that a processor has to foresee (measured on 8 entries a grain: a third of the time)."""
    count = end - begin
    for a in range(count):
        entry = incidence[begin + a]
        room[0, a] = partner_key(i, entry, first, second, ids, wall_key)
        room[1, a] = entry
    for a in range(count):
        place = begin
        for b in range(count):
            place += room[0, b] < room[0, a]
        incidence[place] = room[1, a]


@kernel(parallel=True)
def order_incidence(parts, changed, first, second, ids, wall_key, slot, start, touched, incidence, room):
    """For grains whose contacts began or ended: those that touch, first and in ascending order of the partner's key.

    Thread p does the grains ``parts[p]`` to ``parts[p + 1]`` with ``room[p]``, (2, entries that are sorted by rank).
    ``incidence``, ``touched`` and ``changed``, which is cleared, are modified."""
    for p in prange(parts.shape[0] - 1):
        for i in range(parts[p], parts[p + 1]):
            if changed[i] != 0:
                begin = start[i]
                end = touching_first(begin, start[i + 1], incidence, slot)
                if end - begin <= room.shape[2]:
                    sort_by_rank(i, begin, end, incidence, first, second, ids, wall_key, room[p])
                else:
                    sort_by_insertion(i, begin, end, incidence, first, second, ids, wall_key)
                touched[i] = end - begin
                changed[i] = 0
