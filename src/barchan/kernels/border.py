"""Pairs of a small and a larger grain that have different owners, and which ghosts are in a pair at all.

The owner of the small one finds the pair as it finds any. The owner of the larger one must get the small one as a ghost, however
deep it lies in the other's part of space; then that ghost looks for larger owned grains.
"""

import numpy as np

from barchan.kernels.cells import PERIOD, class_of, is_sparse
from barchan.kernels.compiler import helper, kernel
from barchan.kernels.lanes import LANES, list_near
from barchan.kernels.larger import ROUNDING, TOGETHER, box_of_cells, list_larger, nearest, piece_of_line


@helper
def _square_between(a, i, b, j, grid):
    """Square of the distance of two places, over the nearest periodic image."""
    square = 0.0
    for c in range(3):
        d = nearest(a[i, c] - b[j, c], c, grid)
        square += d * d
    return square


@kernel()
def find_touching(ghosts, ranks, place, start, grids, reach, rows, to):
    """Write owned grains that come within ``reach`` of larger ones of other ranks into ``rows``, and whose these are into ``to``.

    Args:
        ghosts, ranks: (k, 4), (k,) places and owners of grains that are not of the smallest class.
        place, start: (n, 4) of the owned grains, sorted into the cells of ``grids``.

    Returns:
        How many were found, even if there was no room for all.
    """
    count, box = 0, np.zeros(7)
    for g in range(ghosts.shape[0]):
        box[:3] = ghosts[g, :3]
        for number in range(class_of(ghosts[g, 3], grids.largest)):
            grid, base = grids.tables[number], grids.first[number]
            far = (ghosts[g, 3] + grids.largest[number] + reach) * (1.0 + ROUNDING)
            cells = box_of_cells(box, far, grid)
            for k in range(cells[4] * cells[5]):
                done = 0
                while done < cells[3]:
                    first, length = piece_of_line(k, done, cells, grid)
                    done += length
                    for i in range(start[base + first], start[base + first + length]):
                        near = (place[i, 3] + ghosts[g, 3] + reach) * (1.0 + ROUNDING)
                        if _square_between(place, i, ghosts, g, grid) < near * near:
                            if count < rows.shape[0]:
                                rows[count], to[count] = i, ranks[g]
                            count += 1
    return count


@kernel()
def find_pairs_of_ghosts(number, search, rooms, owned, ghost):
    """Pairs of the ghosts of class ``number`` with owned grains of larger classes, as rows into ``owned`` and ``ghost``.

    Args:
        search, rooms: as ``pairs.find_pairs`` has them; the rooms of one thread are used.

    Returns:
        (pairs, the most larger grains that were listed at a time), even if there was no room for all.
    """
    grid, n_owned, count, most = search.tables[number], int(search.start[search.start.shape[0] - 1]), 0, 0
    period = grid[PERIOD, 0], grid[PERIOD, 1], grid[PERIOD, 2]
    larger, places, looked = rooms.larger[0], rooms.places[0], rooms.looked[0]
    over_class = search.first[number + 1]
    for c in range(search.first[number], over_class, TOGETHER):
        begin, over = search.ghost_start[c] + n_owned, search.ghost_start[min(c + TOGETHER, over_class)] + n_owned
        together = 1 if is_sparse(grid) else max(over - begin, 1)  # in a sparse grid they are anywhere
        for one_of_them in range(begin, over, together):
            last = one_of_them + together
            listed = list_larger(number, one_of_them, last, search, False, rooms.box[0], larger, places)
            most, listed = max(most, listed), np.uint64(min(listed, places.shape[0]))
            for i in range(one_of_them, last):
                at = search.seen[0, i], search.seen[1, i], search.seen[2, i], search.seen[3, i] + search.reach
                one = np.uint64(0)
                while one < listed:
                    near = list_near(larger, one, listed, at, period, np.uint64(i), looked, np.uint64(0))
                    one += np.uint64(LANES)
                    for b in range(near):
                        if count < owned.shape[0]:
                            owned[count], ghost[count] = places[looked[1, b]], search.ghost_rows[i - n_owned]
                        count += 1
    return count, most


@kernel()
def number_met(n_owned, first, second, met, number):
    """Mark the ghosts that are in a pair, and number the rows of pairs as if there were no others.

    Args:
        first, second: rows of pairs with a ghost; modified.
        met: (ghosts,) True of those that are needed anyway; becomes True of those, too.
        number: (ghosts,) becomes the row of each of them.
    """
    for rows in (first, second):
        for row in rows:
            if row >= n_owned:
                met[row - n_owned] = True
    count = n_owned
    for ghost in range(met.shape[0]):
        number[ghost] = count
        count += met[ghost]
    for rows in (first, second):
        for k in range(rows.shape[0]):
            if rows[k] >= n_owned:
                rows[k] = number[rows[k] - n_owned]
