"""Is there room for new grains? Overlaps of trial grains with those that are there, and among themselves."""

from barchan.kernels.cells import SHAPE, WRAPS, cell_coordinate, cell_place, line_number
from barchan.kernels.compiler import helper, kernel


@helper
def _overlap(a, i, b, j, length, half):
    """Whether grain i of ``a`` and grain j of ``b`` overlap, over the nearest periodic image."""
    square = 0.0
    for c in range(3):
        d = a[i, c] - b[j, c]
        if d > half[c]:
            d -= length[c]
        if d < -half[c]:
            d += length[c]
        square += d * d
    reach = a[i, 3] + b[j, 3]
    return square < reach * reach


@helper
def _neighbour(coordinate, step, axis, grid):
    """The cell beside a cell along an axis, round the period where the grid wraps; -1 if there is none."""
    cells = int(grid[SHAPE, axis])
    there = coordinate + step
    if grid[WRAPS, axis] != 0.0:
        return (there + cells) % cells
    return there if there < cells else -1


@kernel()
def find_blocked(trial, place, start, rows, grid, length, half, blocked):
    """Set ``blocked`` (k,) where a trial grain (k, 4: position, radius) overlaps one of ``place``, sorted into the cells of
    ``grid``, whose edges are at least the sum of the two largest radii."""
    for i in range(trial.shape[0]):
        x = cell_coordinate(trial[i, 0], 0, grid)
        y = cell_coordinate(trial[i, 1], 1, grid)
        z = cell_coordinate(trial[i, 2], 2, grid)
        for number in range(27):
            cx = _neighbour(x, number % 3 - 1, 0, grid)
            cy = _neighbour(y, number // 3 % 3 - 1, 1, grid)
            cz = _neighbour(z, number // 9 - 1, 2, grid)
            if min(cx, cy, cz) >= 0 and blocked[i] == 0:
                cell = cell_place(line_number(cy, cz, grid) * int(grid[SHAPE, 0]) + cx, grid)
                for k in range(start[cell], start[cell + 1]):
                    if _overlap(trial, i, place, rows[k], length, half):
                        blocked[i] = 1
                        break


@kernel()
def first_come(trial, taken, length, half, free):
    """Clear ``free`` (k,) where a trial grain overlaps one of ``taken``, or one before it that is free."""
    for i in range(trial.shape[0]):
        for j in range(taken.shape[0]):
            if free[i] and _overlap(trial, i, taken, j, length, half):
                free[i] = False
        for j in range(i):
            if free[i] and free[j] and _overlap(trial, i, trial, j, length, half):
                free[i] = False
