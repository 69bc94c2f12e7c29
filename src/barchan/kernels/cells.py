"""Sorts grains into cells: the first half of the neighbour search."""

from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import helper, kernel, prange

#: Rows of a grid's table, three numbers each (x, y, z): kernels take the table, since parallel loops take no nested tuple.
CENTRE, REACH, INVERSE, SHAPE, WRAPS, LENGTH, HALF, PERIOD, STRIP = range(9)

#: Cells of a layer of a strip, about. Cells are numbered along x, then across a strip of lines, then upwards, then strip by
#: strip: what lies above a grain is then near in memory, in the second-level cache however wide the box is (measured at
#: 1,000,000 grains: a step 107 ms without strips, 100 with them).
LAYER = 1024.0


class Grid(NamedTuple):
    """Cells around the part of space that a rank sees.

    ``table``: (9, 3): centre, half the extent, 1 / cell size, number of cells, whether the grid spans a whole period so that
    its two ends touch, length and half length of the box, its period (infinite where it has none), and how many
    lines a strip is wide. A grain is binned at its image nearest to the centre.
    """

    table: np.ndarray
    n_cells: int


def make_grid(low, high, cell, max_cells, frame):
    """Grid over ``low`` to ``high`` (3,) with cells of at least ``cell``, and at most about ``max_cells`` of them.

    Where the region reaches round a whole period it becomes the box itself, and wraps.
    """
    cell = cell or 1.0  # no grains, no skin: any will do
    wraps = np.isfinite(frame.half) & (high - low >= frame.length)
    low, high = np.where(wraps, frame.low, low), np.where(wraps, frame.low + frame.length, high)
    extent = np.maximum(high - low, 0.0)
    size = max(cell, (np.prod(np.maximum(extent, cell)) / max_cells) ** (1.0 / 3.0))
    shape = np.maximum(1.0, np.floor(extent / size))
    inverse = shape / np.maximum(extent, cell)
    frame_rows = (wraps, frame.length, frame.half, 2.0 * frame.half)
    strip = np.full(3, max(4.0, np.round(LAYER / shape[0])))
    table = np.array([0.5 * (low + high), 0.5 * extent, inverse, shape, *frame_rows, strip])
    return Grid(table, int(np.prod(shape)))


@helper
def cell_coordinate(x, c, grid):
    """Cell of the coordinate ``x`` along axis ``c``, clamped to the grid."""
    d = x - grid[CENTRE, c]
    if d > grid[HALF, c]:
        d -= grid[LENGTH, c]
    if d < -grid[HALF, c]:
        d += grid[LENGTH, c]
    return int(min(max(np.floor((d + grid[REACH, c]) * grid[INVERSE, c]), 0.0), grid[SHAPE, c] - 1.0))


@helper
def line_number(cy, cz, grid):
    """Number of the line of cells along x that lies at ``cy`` and ``cz``. Its first cell is that number times the cells of a
    line."""
    strip = grid[STRIP, 1]
    first = np.floor((cy + 0.5) / strip) * strip  # whole numbers would be divided one by one
    return int(first * grid[SHAPE, 2] + cz * min(strip, grid[SHAPE, 1] - first) + cy - first)


@helper
def line_place(line, grid):
    """``cy`` and ``cz`` of a line."""
    ny, nz, strip = int(grid[SHAPE, 1]), int(grid[SHAPE, 2]), int(grid[STRIP, 1])
    first = line // (strip * nz) * strip
    width = min(strip, ny - first)
    return first + (line - first * nz) % width, (line - first * nz) // width


@kernel(parallel=True)
def find_cells(place, grid, begin, cell):
    """Write the cells of the grains from row ``begin`` on into ``cell``."""
    for k in prange(cell.shape[0]):
        i = begin + k
        cx = cell_coordinate(place[i, 0], 0, grid)
        cy = cell_coordinate(place[i, 1], 1, grid)
        cz = cell_coordinate(place[i, 2], 2, grid)
        cell[k] = line_number(cy, cz, grid) * int(grid[SHAPE, 0]) + cx


@kernel()
def sort_by_cell(cell, begin, start, rows):
    """Counting sort of the grains from row ``begin`` on. ``start`` (cells + 1,) and ``rows`` are modified: the grains of cell
    c, in ascending order, are ``rows[start[c]:start[c + 1]]``."""
    start[:] = 0
    for i in range(cell.shape[0]):
        start[cell[i] + 1] += 1
    for c in range(start.shape[0] - 1):
        start[c + 1] += start[c]
    for i in range(cell.shape[0]):
        c = cell[i]
        rows[start[c]] = begin + i
        start[c] += 1
    for c in range(start.shape[0] - 1, 0, -1):
        start[c] = start[c - 1]
    start[0] = 0


def sorted_cells(place, begin, count, grid):
    """Where each cell begins among ``count`` grains from row ``begin`` on, and their rows in the order of cells."""
    cell, rows = np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32)
    start = np.empty(grid.n_cells + 1, dtype=np.uint32)
    find_cells(place, grid.table, begin, cell)
    sort_by_cell(cell, begin, start, rows)
    return start, rows


@kernel(parallel=True)
def extents(place):
    """Smallest and largest coordinates of all grains, and the largest radius: (x, X, y, Y, z, Z, R); infinite and 0 if none."""
    west, south, bottom = np.inf, np.inf, np.inf
    east, north, top = -np.inf, -np.inf, -np.inf
    radius = 0.0
    for i in prange(place.shape[0]):
        west, east = min(west, place[i, 0]), max(east, place[i, 0])
        south, north = min(south, place[i, 1]), max(north, place[i, 1])
        bottom, top = min(bottom, place[i, 2]), max(top, place[i, 2])
        radius = max(radius, place[i, 3])
    return west, east, south, north, bottom, top, radius
