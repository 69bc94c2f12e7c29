"""Finds the pairs of grains that may touch before the next rebuild: the second half of the neighbour search."""

import numpy as np

from barchan.kernels.cells import PERIOD, SHAPE, STENCIL, WRAPS
from barchan.kernels.compiler import helper, kernel, prange, widest_lanes

#: Pairs of rows that are looked at together, and those of a run that are written at a time.
BLOCK, AT_A_TIME = 1024, np.uint64(8)

#: Most runs of rows around a cell: 9 lines, each in two parts where a period ends, of owned grains and of ghosts.
RUNS = 36


@helper
def neighbour_range(c, n, reach, wraps):
    """First and last neighbour cell along one axis, relative to ``c``; each cell of a short period is met once."""
    if wraps != 0.0 and n > 2 * reach:
        return -reach, reach
    if wraps != 0.0:
        return -c, n - 1 - c
    return max(-reach, -c), min(reach, n - 1 - c)


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
def keep_near(length, looked, kept, place, frozen, ids, skin, grid, first, second, end, last, counts):
    """Of the ``length`` pairs of rows in ``looked``, (3, BLOCK), write those that have to be listed into ``first`` and ``second``
    from ``end`` on, as long as it is below ``last``, the smaller id first, and count them in ``counts``. Returns their new end,
    which may exceed ``last``.

    A vectorised loop finds the distances, a scalar one without branches lists what is near: three of four are not, which a
    processor cannot foresee."""
    for b in range(length):
        looked[2, b] = 1 if near(place, looked[0, b], looked[1, b], skin, grid) else 0
    count = np.uint64(0)
    for b in range(length):
        i, j = looked[0, b], looked[1, b]
        kept[0, count] = i
        kept[1, count] = j
        count += np.uint64(looked[2, b] & ((frozen[i] & frozen[j]) ^ 1))
    for b in range(min(count, last - end) if end < last else np.uint64(0)):
        i, j = kept[0, b], kept[1, b]
        in_order = ids[i] < ids[j]
        first[end + b] = i if in_order else j
        second[end + b] = j if in_order else i
    for b in range(count):
        counts[kept[0, b]] += 1
    return end + count


@helper
def add_run(c, last, start, least, listed, runs, count):
    """Append the rows of the cells ``c`` to ``last``, from ``least`` on, to the ``runs``, unless there are none."""
    runs[0, count] = max(start[c], least)
    runs[1, count] = start[last + 1]
    runs[2, count] = listed
    return count + np.uint64(runs[0, count] < runs[1, count])


@helper
def add_line(line, x0, x1, nx, start, least, listed, runs, count):
    """Append the rows of the cells ``x0`` to ``x1`` of a line of ``nx`` cells that begins with cell ``line``. What lies beyond
    one end is at the other end of the period."""
    count = add_run(line + max(x0, 0), line + min(x1, nx - 1), start, least, listed, runs, count)
    if x0 < 0:
        count = add_run(line + x0 + nx, line + nx - 1, start, least, listed, runs, count)
    if x1 >= nx:
        count = add_run(line, line + x1 - nx, start, least, listed, runs, count)
    return count


@helper
def list_runs(c, start, ghost_start, has_ghosts, grid, runs):
    """Write the runs of rows around cell ``c`` that come after its first row, and those of ghosts, into ``runs``: first row, last
    row + 1, whether they are ghosts; returns how many there are. Cells in a line along x hold one run of rows."""
    nx, ny, nz = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2])
    cx, cy, cz = c % nx, (c // nx) % ny, c // (nx * ny)
    x0, x1 = neighbour_range(cx, nx, int(grid[STENCIL, 0]), grid[WRAPS, 0])
    y0, y1 = neighbour_range(cy, ny, int(grid[STENCIL, 1]), grid[WRAPS, 1])
    z0, z1 = neighbour_range(cz, nz, int(grid[STENCIL, 2]), grid[WRAPS, 2])
    count = np.uint64(0)
    for sz in range(z0, z1 + 1):
        for sy in range(y0, y1 + 1):
            line = (wrapped(cz + sz, nz) * ny + wrapped(cy + sy, ny)) * nx
            count = add_line(line, cx + x0, cx + x1, nx, start, start[c], 0, runs, count)
            if has_ghosts:
                count = add_line(line, cx + x0, cx + x1, nx, ghost_start, ghost_start[0], 1, runs, count)
    return count


@kernel(parallel=True)
def find_pairs(
    parts, bounds, start, ghost_start, ghost_rows, place, frozen, ids, skin, grid, runs, looked, kept, first, second, counts, ends
):
    """Pairs that may touch: of each owned grain with owned ones of a higher row, and with ghosts.

    Thread p does the cells ``parts[p]`` to ``parts[p + 1]`` and writes its pairs into ``first`` and ``second`` from
    ``bounds[p]`` on, the smaller id first, whoever owns it. Owned rows are sorted by cell, so cell c holds the rows ``start[c]``
    to ``start[c + 1]``. Ghosts are listed by cell in ``ghost_rows``.

    ``counts``, how many pairs each grain found, and ``ends``, where those of each thread end, are modified; an end above
    ``bounds[p + 1]`` means that the room must grow. ``runs`` (threads, 3, RUNS), ``looked`` and ``kept`` (threads, 3, BLOCK)
    are room to work in."""
    has_ghosts = ghost_rows.shape[0] > 0
    full = np.uint64(looked.shape[2]) - AT_A_TIME
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        end, last, length = bounds[p], bounds[np.uint64(p + 1)], np.uint64(0)
        for c in range(parts[p], parts[np.uint64(p + 1)]):
            own, above = np.uint64(start[c]), np.uint64(start[c + np.uint64(1)])
            n_runs = list_runs(np.int64(c), start, ghost_start, has_ghosts, grid, runs[p]) if own < above else np.uint64(0)
            for i in range(own, above):
                counts[i] = 0
                for q in range(n_runs):
                    listed, over = runs[p, 2, q] != 0, np.uint64(runs[p, 1, q])
                    begin = np.uint64(runs[p, 0, q]) if listed else max(np.uint64(runs[p, 0, q]), i + np.uint64(1))
                    while begin < over:
                        for b in range(AT_A_TIME):  # more than needed, which costs less than to count
                            looked[p, 0, length + b] = i
                            looked[p, 1, length + b] = begin + b
                        if listed:
                            for b in range(min(over - begin, AT_A_TIME)):
                                looked[p, 1, length + b] = ghost_rows[begin + b]
                        length += min(over - begin, AT_A_TIME)
                        begin += AT_A_TIME
                        if length > full:
                            end = keep_near(
                                length, looked[p], kept[p], place, frozen, ids, skin, grid, first, second, end, last, counts
                            )
                            length = np.uint64(0)
        ends[p] = keep_near(length, looked[p], kept[p], place, frozen, ids, skin, grid, first, second, end, last, counts)


def rooms(threads):
    """Room to work in for ``find_pairs``: runs, looked, kept."""
    return np.empty((threads, 3, RUNS), np.uint32), *np.empty((2, threads, 3, BLOCK), np.uint32)
