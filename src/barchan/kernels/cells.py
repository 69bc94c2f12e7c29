"""Sorts grains into cells, each size class into a grid of its own: the first half of the neighbour search.

(Ogarko & Luding 2012, Comp. Phys. Comm. 183, 931; Stratford et al. 2018, section 3.)
"""

from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import helper, kernel, prange

#: Rows of a grid's table, three numbers each (x, y, z): kernels take the table, since parallel loops take no nested tuple.
CENTRE, REACH, INVERSE, SHAPE, WRAPS, LENGTH, HALF, PERIOD, STRIP, FOLD = range(10)

#: Cells of a layer of a strip, about. Cells are numbered along x, then across a strip of lines, then upwards, then strip by
#: strip: what lies above a grain is then near in memory, in the second-level cache however wide the box is (measured at
#: 1,000,000 grains: a step 107 ms without strips, 100 with them).
LAYER = 1024.0


class Grid(NamedTuple):
    """Cells around the part of space that a rank sees.

    ``table``: (10, 3): centre, half the extent, 1 / cell size, number of cells, whether the grid spans a whole period so that
    its two ends touch, length and half length of the box, its period (infinite where it has none), how many lines a strip is
    wide, and ``n_cells``. A grain is binned at its image nearest to the centre.

    Where cells would outnumber grains by far, most of them empty, the grid is sparse: cell c is kept in place c modulo
    ``n_cells``, with others that are far away.
    """

    table: np.ndarray
    n_cells: int


class Grids(NamedTuple):
    """A grid for each size class, that of the smallest grains first.

    ``tables``: (classes, 10, 3) of the grids. ``first``: (classes + 1,) where their cells are numbered from; all cells of a class
    follow on one another. ``largest``: (classes,) radius of the largest grain of each [length].
    """

    tables: np.ndarray
    first: np.ndarray
    largest: np.ndarray

    @classmethod
    def of(cls, grids, largest):
        """One ``Grid`` for each of the ``largest`` radii, ascending."""
        first = np.cumsum([0, *(grid.n_cells for grid in grids)])
        return cls(np.array([grid.table for grid in grids]), first, np.array(largest, dtype=np.float64))


#: Cells for each grain, and at least, above which a grid is sparse; and what it then has.
DENSE, FEWEST, SPARSE = 8, 512, 2

#: Most cells along an axis: their numbers have to be exact as floating-point numbers.
MOST = float(1 << 17)


def make_grid(low, high, cell, count, frame):
    """Grid over ``low`` to ``high`` (3,) with cells of at least ``cell``, for ``count`` grains.

    Where the region reaches round a whole period it becomes the box itself, and wraps.
    """
    cell = cell or 1.0  # no grains, no skin: any will do
    wraps = np.isfinite(frame.half) & (high - low >= frame.length)
    low, high = np.where(wraps, frame.low, low), np.where(wraps, frame.low + frame.length, high)
    extent = np.maximum(high - low, 0.0)
    shape = np.clip(np.floor(extent / cell), 1.0, MOST)
    inverse = shape / np.maximum(extent, cell)
    frame_rows = (wraps, frame.length, frame.half, 2.0 * frame.half)
    n_cells, strip = int(np.prod(shape)), max(4.0, np.round(LAYER / shape[0]))
    places = _places(shape, max(SPARSE * count, FEWEST)) if n_cells > max(DENSE * count, FEWEST) else n_cells
    if places < n_cells:
        n_cells, strip = places, shape[1]
    table = np.array([0.5 * (low + high), 0.5 * extent, inverse, shape, *frame_rows, np.full(3, strip), np.full(3, n_cells)])
    return Grid(table, n_cells)


def _places(shape, least):
    """How many places a sparse grid has: at least ``least``, and so that no two of the cells around a cell share one."""
    nx, ny, nz = shape.astype(np.int64).tolist()
    ways = [np.array([*range(-2, 3), 1 - n, n - 1, 2 - n, n - 2], dtype=np.int64) for n in (nx, ny, nz)]
    apart = (ways[0][:, None, None] + nx * (ways[1][:, None] + ny * ways[2])).ravel()
    apart = apart[apart != 0]
    while (apart % least == 0).any():
        least += 1
    return least


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


@helper
def class_of(radius, largest):
    """Size class of a grain of this radius."""
    number = 0
    while number < largest.shape[0] - 1 and radius > largest[number]:
        number += 1
    return number


@helper
def is_sparse(grid):
    """Whether cells share places."""
    return grid[FOLD, 0] < grid[SHAPE, 0] * grid[SHAPE, 1] * grid[SHAPE, 2]


@helper
def cell_place(cell, grid):
    """Where a cell is kept, among those of its grid."""
    n_cells = int(grid[FOLD, 0])
    return cell if cell < n_cells else cell % n_cells


@kernel(parallel=True)
def find_cells(place, grids, begin, cell):
    """Write the cells of the grains from row ``begin`` on into ``cell``; ``grids`` are ``Grids``."""
    for k in prange(cell.shape[0]):
        i = begin + k
        number = class_of(place[i, 3], grids.largest)
        grid = grids.tables[number]
        cx = cell_coordinate(place[i, 0], 0, grid)
        cy = cell_coordinate(place[i, 1], 1, grid)
        cz = cell_coordinate(place[i, 2], 2, grid)
        cell[k] = grids.first[number] + cell_place(line_number(cy, cz, grid) * int(grid[SHAPE, 0]) + cx, grid)


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


def sorted_cells(place, begin, count, grids):
    """Where each cell of ``Grids`` begins among ``count`` grains from row ``begin`` on, and their rows in the order of cells."""
    cell, rows = np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32)
    start = np.empty(grids.first[-1] + 1, dtype=np.uint32)
    find_cells(place, grids, begin, cell)
    sort_by_cell(cell, begin, start, rows)
    return start, rows


@kernel(parallel=True)
def extents(place, above, most):
    """Smallest and largest coordinates of the grains with radii above ``above`` up to ``most``, their largest radius, and how
    many they are: (x, X, y, Y, z, Z, R, n); infinite and 0 if none."""
    west, south, bottom = np.inf, np.inf, np.inf
    east, north, top = -np.inf, -np.inf, -np.inf
    radius, count = 0.0, 0
    for i in prange(place.shape[0]):
        if above < place[i, 3] <= most:
            west, east = min(west, place[i, 0]), max(east, place[i, 0])
            south, north = min(south, place[i, 1]), max(north, place[i, 1])
            bottom, top = min(bottom, place[i, 2]), max(top, place[i, 2])
            radius = max(radius, place[i, 3])
            count += 1
    return west, east, south, north, bottom, top, radius, count
