"""Finds the pairs of grains that may touch before the next rebuild: the second half of the neighbour search."""

import numpy as np

from barchan.kernels.cells import PERIOD, SHAPE, WRAPS, line_number, line_place
from barchan.kernels.compiler import helper, kernel, prange, widest_lanes
from barchan.kernels.lanes import LANES, list_near

#: Pairs of rows that are found before they are written into the list.
FOUND = 1024

#: Most lines around a line of cells, and runs of rows around a cell: of owned grains and of ghosts, in two parts where a period
#: ends.
LINES, RUNS = 9, 36


@helper
def neighbour_range(c, n, wraps):
    """First and last neighbour cell along one axis, relative to ``c``; each cell of a short period is met once."""
    if wraps != 0.0 and n > 2:
        return -1, 1
    if wraps != 0.0:
        return -c, n - 1 - c
    return max(-1, -c), min(1, n - 1 - c)


@helper
def wrapped(c, n):
    """Cell ``c`` of a period of ``n``, from -1 to n."""
    c = c + n if c < 0 else c
    return c - n if c >= n else c


@helper
def list_lines(line, start, least, grid, lines):
    """Write the first cells of the lines around a line, and of itself, into ``lines``, if they hold rows from ``least`` on;
    returns how many do."""
    nx, ny, nz = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2])
    cy, cz = line_place(line, grid)
    y0, y1 = neighbour_range(cy, ny, grid[WRAPS, 1])
    z0, z1 = neighbour_range(cz, nz, grid[WRAPS, 2])
    count = 0
    for sz in range(z0, z1 + 1):
        for sy in range(y0, y1 + 1):
            first = line_number(wrapped(cy + sy, ny), wrapped(cz + sz, nz), grid) * nx
            lines[count] = first
            count += start[first + nx] > max(start[first], least)
    return count


@helper
def add_run(c, last, start, least, shift, runs, count):
    """Append the rows of the cells ``c`` to ``last``, from ``least`` on, to the ``runs``, unless there are none. A row's place is
    ``shift`` more."""
    runs[0, count] = max(start[c], least) + shift
    runs[1, count] = start[last + 1] + shift
    return count + np.uint64(runs[0, count] < runs[1, count])


@helper
def list_runs(cx, lines, n_lines, start, least, shift, grid, runs, count):
    """Append the runs of places around the cell ``cx`` of a line to ``runs``, first and last + 1; returns how many there are now.
    Cells in a line hold one run of rows; what lies beyond one end is at the other end of the period."""
    nx = int(grid[SHAPE, 0])
    x0, x1 = neighbour_range(cx, nx, grid[WRAPS, 0])
    for q in range(n_lines):
        line = lines[q]
        count = add_run(line + max(cx + x0, 0), line + min(cx + x1, nx - 1), start, least, shift, runs, count)
        if cx + x0 < 0:
            count = add_run(line + nx - 1, line + nx - 1, start, least, shift, runs, count)
        if cx + x1 >= nx:
            count = add_run(line, line, start, least, shift, runs, count)
    return count


@helper
def keep_pairs(length, looked, ghost_rows, frozen, ids, first, second, end, last, counts):
    """Write the ``length`` pairs of a row and a place in ``looked`` into ``first`` and ``second`` from ``end`` on, the smaller id
    first, and count them in ``counts``; pairs of frozen grains are left out. Returns the new end. Nothing is written if there
    may not be room below ``last``."""
    n_owned, fits = np.uint32(counts.shape[0]), end + length <= last
    for b in range(length):
        i, place = looked[0, b], looked[1, b]
        j = place if place < n_owned else ghost_rows[place - n_owned]
        in_order = ids[i] < ids[j]
        if fits:
            first[end] = i if in_order else j
            second[end] = j if in_order else i
        moves = (frozen[i] & frozen[j]) ^ 1
        counts[i] += moves
        end += np.uint64(moves)
    return end


@kernel(parallel=True)
def find_pairs(
    parts,
    bounds,
    start,
    ghost_start,
    ghost_rows,
    seen,
    frozen,
    ids,
    reach,
    grid,
    lines,
    runs,
    looked,
    first,
    second,
    counts,
    ends,
):
    """Pairs that may touch: of each owned grain with owned ones of a higher row, and with ghosts.

    Thread p does the cells ``parts[p]`` to ``parts[p + 1]`` and writes its pairs into ``first`` and ``second`` from
    ``bounds[p]`` on, the smaller id first, whoever owns it. Owned rows are sorted by cell, so cell c holds the rows ``start[c]``
    to ``start[c + 1]``; ghosts are listed by cell in ``ghost_rows``. ``seen`` is what ``see_places`` wrote.

    ``counts``, how many pairs each grain found, and ``ends``, where those of each thread end, are modified; an end above
    ``bounds[p + 1]`` - ``FOUND`` means that pairs may be missing and the room must grow. ``lines`` (threads, 2, LINES),
    ``runs`` (threads, 2, RUNS) and ``looked`` (threads, 2, FOUND) are room to work in."""
    nx = np.uint64(grid[SHAPE, 0])
    period = grid[PERIOD, 0], grid[PERIOD, 1], grid[PERIOD, 2]
    full = np.uint64(looked.shape[2] - LANES)
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        end, last, length = bounds[p], bounds[np.uint64(p + 1)], np.uint64(0)
        begin_cell, over_cell = parts[p], parts[np.uint64(p + 1)]
        for line in range(begin_cell // nx, (over_cell + nx - np.uint64(1)) // nx):
            n_lines = list_lines(np.int64(line), start, start[line * nx], grid, lines[p, 0])
            n_ghost_lines = list_lines(np.int64(line), ghost_start, 0, grid, lines[p, 1])
            for c in range(max(line * nx, begin_cell), min((line + np.uint64(1)) * nx, over_cell)):
                own, above, n_runs = np.uint64(start[c]), np.uint64(start[c + np.uint64(1)]), np.uint64(0)
                if own < above:
                    cx = np.int64(c - line * nx)
                    n_runs = list_runs(cx, lines[p, 0], n_lines, start, start[c], 0, grid, runs[p], n_runs)
                    n_runs = list_runs(cx, lines[p, 1], n_ghost_lines, ghost_start, 0, counts.shape[0], grid, runs[p], n_runs)
                for i in range(own, above):
                    counts[i] = 0
                    at = seen[0, i], seen[1, i], seen[2, i], seen[3, i] + reach
                    for q in range(n_runs):
                        begin, over = max(np.uint64(runs[p, 0, q]), i + np.uint64(1)), np.uint64(runs[p, 1, q])
                        while begin < over:
                            length = list_near(seen, begin, over, at, period, i, looked[p], length)
                            begin += np.uint64(LANES)
                            if length > full:
                                end = keep_pairs(length, looked[p], ghost_rows, frozen, ids, first, second, end, last, counts)
                                length = np.uint64(0)
        ends[p] = keep_pairs(length, looked[p], ghost_rows, frozen, ids, first, second, end, last, counts)


@kernel()
def inner_first(first, second, offsets, one, other):
    """Bring pairs of two owned grains before those with ghosts, both in the order in which they were; ``one`` and ``other`` are
    room.

    Args:
        offsets: (2, owned + 1) where the pairs begin that each grain found, in line 0; modified: those of both kinds.

    Returns:
        How many there are of two owned grains.
    """
    n_owned, inner, border, begin = offsets.shape[1] - 1, 0, 0, 0
    for found_by in range(n_owned):
        end = offsets[0, found_by + 1]
        offsets[0, found_by], offsets[1, found_by] = inner, border
        for k in range(begin, end):
            i, j = first[k], second[k]
            both = i < n_owned and j < n_owned
            first[inner], second[inner] = i, j
            one[border], other[border] = i, j
            inner += both
            border += not both
        begin = end
    for k in range(border):
        first[inner + k], second[inner + k] = one[k], other[k]
    for found_by in range(n_owned):
        offsets[1, found_by] += inner
    offsets[0, n_owned], offsets[1, n_owned] = inner, inner + border
    return inner


@kernel(parallel=True)
def see_places(place, ghost_rows, seen):
    """Coordinates and radii of the owned grains, and then of the ghosts in the order of ``ghost_rows``, as rows of ``seen``."""
    n_owned = place.shape[0] - ghost_rows.shape[0]
    for i in prange(n_owned):
        seen[0, i], seen[1, i], seen[2, i], seen[3, i] = place[i, 0], place[i, 1], place[i, 2], place[i, 3]
    for q in range(ghost_rows.shape[0]):
        for c in range(4):
            seen[c, n_owned + q] = place[ghost_rows[q], c]


def rooms(threads):
    """Room to work in for ``find_pairs``: lines, runs, looked."""
    lines = np.empty((threads, 2, LINES), np.int64)
    return lines, *(np.empty((threads, 2, count), np.uint32) for count in (RUNS, FOUND))
