"""Finds the pairs of grains that may touch before the next rebuild: the second half of the neighbour search."""

from typing import NamedTuple

import numpy as np

from barchan.kernels.cells import FOLD, PERIOD, SHAPE, WRAPS, cell_coordinate, line_number, line_place
from barchan.kernels.compiler import helper, kernel, prange, widest_lanes
from barchan.kernels.integrate import nearest_image
from barchan.kernels.lanes import LANES, list_near
from barchan.kernels.larger import TOGETHER, list_larger

#: Pairs of rows that are found before they are written into the list.
FOUND = 1024

#: Most lines around a line of cells, and runs of rows around a cell: of owned grains and of ghosts, in a sparse grid one a cell.
LINES, RUNS = 9, 54


class Rooms(NamedTuple):
    """Room to work in, of each thread: ``lines`` (2, LINES) and ``runs`` (2, RUNS) around a cell, of owned grains and of ghosts;
    ``looked`` (2, FOUND), pairs of a row and a place; ``larger`` (4, ...) and ``places``, larger grains listed; ``box`` (7,)."""

    lines: np.ndarray
    runs: np.ndarray
    looked: np.ndarray
    larger: np.ndarray
    places: np.ndarray
    box: np.ndarray

    @classmethod
    def of(cls, threads, listed):
        """Rooms for so many threads, and larger grains that are listed at a time."""
        lines = np.empty((threads, 2, LINES), np.int64)
        runs, looked = (np.empty((threads, 2, count), np.uint32) for count in (RUNS, FOUND))
        larger, places = np.zeros((threads, 4, listed + LANES)), np.empty((threads, listed), np.uint32)
        return cls(lines, runs, looked, larger, places, np.empty((threads, 7)))


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
def list_lines(line, start, least, base, grid, lines):
    """Write the first cells of the lines around a line, and of itself, into ``lines``, if they hold rows from ``least`` on;
    returns how many do. The cells of the grid are numbered from ``base`` on."""
    nx, ny, nz = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2])
    cy, cz = line_place(line, grid)
    y0, y1 = neighbour_range(cy, ny, grid[WRAPS, 1])
    z0, z1 = neighbour_range(cz, nz, grid[WRAPS, 2])
    count = 0
    for sz in range(z0, z1 + 1):
        for sy in range(y0, y1 + 1):
            first = base + line_number(wrapped(cy + sy, ny), wrapped(cz + sz, nz), grid) * nx
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
def list_runs_sparsely(cx, cy, cz, start, least, shift, base, grid, runs, count):
    """The same around a cell of a sparse grid."""
    nx, ny, nz, n_cells = int(grid[SHAPE, 0]), int(grid[SHAPE, 1]), int(grid[SHAPE, 2]), int(grid[FOLD, 0])
    x0, x1 = neighbour_range(cx, nx, grid[WRAPS, 0])
    y0, y1 = neighbour_range(cy, ny, grid[WRAPS, 1])
    z0, z1 = neighbour_range(cz, nz, grid[WRAPS, 2])
    for sz in range(z0, z1 + 1):
        for sy in range(y0, y1 + 1):
            line = line_number(wrapped(cy + sy, ny), wrapped(cz + sz, nz), grid) * nx
            for sx in range(x0, x1 + 1):
                c = base + (line + wrapped(cx + sx, nx)) % n_cells
                count = add_run(c, c, start, least, shift, runs, count)
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


@helper
def look(i, runs, n_runs, larger, places, n_larger, search, period, looked, length, first, second, end, last, counts):
    """Pairs of grain ``i`` with those of a higher row in the ``runs`` around it, and with ``n_larger`` listed larger ones. What
    is near waits in ``looked``; returns the new (end, length)."""
    seen, full = search.seen, np.uint64(FOUND - LANES)
    at = seen[0, i], seen[1, i], seen[2, i], seen[3, i] + search.reach
    for q in range(n_runs):
        begin, over = max(np.uint64(runs[0, q]), i + np.uint64(1)), np.uint64(runs[1, q])
        while begin < over:
            length = list_near(seen, begin, over, at, period, i, looked, length)
            begin += np.uint64(LANES)
            if length > full:
                end = keep_pairs(length, looked, search.ghost_rows, search.frozen, search.ids, first, second, end, last, counts)
                length = np.uint64(0)
    begin = np.uint64(0)
    while begin < n_larger:
        before = length
        length = list_near(larger, begin, n_larger, at, period, i, looked, length)
        begin += np.uint64(LANES)
        for b in range(before, length):
            looked[1, b] = places[looked[1, b]]
        if length > full:
            end = keep_pairs(length, looked, search.ghost_rows, search.frozen, search.ids, first, second, end, last, counts)
            length = np.uint64(0)
    return end, length


@kernel(parallel=True)
def find_pairs(number, parts, bounds, search, rooms, first, second, counts, ends, needed):
    """Pairs that may touch of each owned grain of class ``number``: with owned ones of a higher row in its class, with ghosts of
    its class, and with all of larger classes.

    Thread p does the cells ``parts[p]`` to ``parts[p + 1]`` of the class and writes its pairs into ``first`` and ``second`` from
    ``bounds[p]`` on, the smaller id first, whoever owns it. Owned rows are sorted by class and cell, so cell c holds the rows
    ``start[c]`` to ``start[c + 1]``; ghosts are listed by cell in ``ghost_rows``.

    Args:
        search, rooms: ``larger.Search``, ``Rooms``.
        counts: (owned,) becomes how many each grain found.
        ends: (threads,) becomes where the pairs of each end; above ``bounds[p + 1]`` - ``FOUND`` some may be missing.
        needed: (threads,) becomes the most larger grains that were listed at a time; if there was no room, pairs are missing.
            (What a parallel loop writes stands in no tuple: Numba would lose it.)
    """
    grid, base, start, ghost_start = search.tables[number], search.first[number], search.start, search.ghost_start
    nx, n_owned = np.uint64(grid[SHAPE, 0]), counts.shape[0]
    period = grid[PERIOD, 0], grid[PERIOD, 1], grid[PERIOD, 2]
    is_last = number + 1 == search.largest.shape[0]
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        lines, runs, looked, larger, places = rooms.lines[p], rooms.runs[p], rooms.looked[p], rooms.larger[p], rooms.places[p]
        end, last, length, n_larger, most = bounds[p], bounds[np.uint64(p + 1)], np.uint64(0), np.uint64(0), 0
        begin_cell, over_cell = parts[p], parts[np.uint64(p + 1)]
        for line in range(begin_cell // nx, (over_cell + nx - np.uint64(1)) // nx):
            here, over_line = np.uint64(base) + line * nx, min((line + np.uint64(1)) * nx, over_cell) + np.uint64(base)
            n_lines = list_lines(np.int64(line), start, start[here], base, grid, lines[0])
            n_ghost_lines = list_lines(np.int64(line), ghost_start, 0, base, grid, lines[1])
            together = np.uint64(0)
            for c in range(max(here, begin_cell + np.uint64(base)), over_line):
                own, above, n_runs = np.uint64(start[c]), np.uint64(start[c + np.uint64(1)]), np.uint64(0)
                if own < above:
                    cx = np.int64(c - here)
                    n_runs = list_runs(cx, lines[0], n_lines, start, start[c], 0, grid, runs, n_runs)
                    n_runs = list_runs(cx, lines[1], n_ghost_lines, ghost_start, 0, n_owned, grid, runs, n_runs)
                    if c >= together and not is_last:
                        together = min(c + np.uint64(TOGETHER), over_line)
                        count = list_larger(number, own, start[together], search, True, rooms.box[p], larger, places)
                        most, n_larger = max(most, count), np.uint64(min(count, places.shape[0]))
                for i in range(own, above):
                    counts[i] = 0
                    nearby = runs, n_runs, larger, places, n_larger
                    end, length = look(i, *nearby, search, period, looked, length, first, second, end, last, counts)
        ends[p] = keep_pairs(length, looked, search.ghost_rows, search.frozen, search.ids, first, second, end, last, counts)
        needed[p] = most


@kernel(parallel=True)
def find_pairs_sparsely(number, parts, bounds, search, rooms, first, second, counts, ends, needed):
    """The same as ``find_pairs`` in a sparse grid, of which only cells that hold grains are visited. Thread p does the rows
    ``parts[p]`` to ``parts[p + 1]``."""
    grid, base = search.tables[number], search.first[number]
    period = grid[PERIOD, 0], grid[PERIOD, 1], grid[PERIOD, 2]
    is_last = number + 1 == search.largest.shape[0]
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        runs, looked, larger, places = rooms.runs[p], rooms.looked[p], rooms.larger[p], rooms.places[p]
        end, last, length, n_larger, most = bounds[p], bounds[np.uint64(p + 1)], np.uint64(0), np.uint64(0), 0
        n_runs, before = np.uint64(0), -1
        for i in range(parts[p], parts[np.uint64(p + 1)]):
            cx = cell_coordinate(search.seen[0, i], 0, grid)
            cy = cell_coordinate(search.seen[1, i], 1, grid)
            cz = cell_coordinate(search.seen[2, i], 2, grid)
            cell = line_number(cy, cz, grid) * int(grid[SHAPE, 0]) + cx
            if cell != before:
                before = cell
                n_runs = list_runs_sparsely(cx, cy, cz, search.start, i, 0, base, grid, runs, np.uint64(0))
                n_runs = list_runs_sparsely(cx, cy, cz, search.ghost_start, 0, counts.shape[0], base, grid, runs, n_runs)
            if not is_last:
                count = list_larger(number, i, i + np.uint64(1), search, True, rooms.box[p], larger, places)
                most, n_larger = max(most, count), np.uint64(min(count, places.shape[0]))
            counts[i] = 0
            nearby = runs, n_runs, larger, places, n_larger
            end, length = look(i, *nearby, search, period, looked, length, first, second, end, last, counts)
        ends[p] = keep_pairs(length, looked, search.ghost_rows, search.frozen, search.ids, first, second, end, last, counts)
        needed[p] = most


@kernel()
def keep_near(first, second, counts, place, reach, length, half, tilt):
    """Keep the pairs whose surfaces are closer than ``reach`` in a box that tilts, of those that are so in the ``Upright`` one.
    ``first`` and ``second``, pairs of one grain after another, and how many each has, ``counts``, are modified. Returns how many
    there are."""
    begin, end = 0, 0
    for i in range(counts.shape[0]):
        over, counts[i] = begin + counts[i], 0
        for k in range(begin, over):
            a, b = first[k], second[k]
            dx, dy, dz = place[a, 0] - place[b, 0], place[a, 1] - place[b, 1], place[a, 2] - place[b, 2]
            dx, dy, dz = nearest_image(dx, dy, dz, length, half, tilt)
            far = place[a, 3] + place[b, 3] + reach
            if dx * dx + dy * dy + dz * dz < far * far:
                first[end], second[end] = a, b
                counts[i] += 1
                end += 1
        begin = over
    return end


@kernel()
def inner_first(first, second, offsets, one, other):
    """Bring pairs of two owned grains before those with ghosts, both in the order in which they were; ``one`` and ``other`` are
    room.

    Args:
        offsets: (2 or more, owned + 1) where the pairs begin that each grain found, in line 0; modified: those of both kinds, in
            lines 0 and 1.

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
