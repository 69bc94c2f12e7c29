"""Finds pairs in one grid of small cells for grains of all sizes: the larger a grain, the more cells it looks at.

(In 't Veld, Plimpton & Grest 2008, Comp. Phys. Comm. 179, 320; "multi" in Stratford et al. 2018, section 2.1. It is here to be
compared with a grid for each size class.)
"""

import numpy as np

from barchan.kernels.cells import PERIOD
from barchan.kernels.compiler import kernel, prange, widest_lanes
from barchan.kernels.larger import ROUNDING, box_around, box_of_cells, piece_of_line
from barchan.kernels.pairs import add_run, keep_pairs, look


@kernel(parallel=True)
def find_pairs_widely(number, parts, bounds, search, rooms, first, second, counts, ends, needed):
    """The same as ``pairs.find_pairs`` for the only class, whatever the size of its cells. Thread p does the rows ``parts[p]`` to
    ``parts[p + 1]``; the grid is not sparse."""
    grid, base, n_owned = search.tables[number], search.first[number], counts.shape[0]
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        runs, looked, larger, places, box = rooms.runs[p], rooms.looked[p], rooms.larger[p], rooms.places[p], rooms.box[p]
        end, last, length, none = bounds[p], bounds[np.uint64(p + 1)], np.uint64(0), np.uint64(0)
        for i in range(parts[p], parts[np.uint64(p + 1)]):
            counts[i] = 0
            box_around(i, i + np.uint64(1), search.seen, grid, box)
            far = (search.seen[3, i] + search.largest[number] + search.reach) * (1.0 + ROUNDING)
            cells = box_of_cells(box, far, grid)
            for k in range(cells[4] * cells[5]):
                done = 0
                while done < cells[3]:
                    one, width = piece_of_line(k, done, cells, grid)
                    over, done = base + one + width - 1, done + width
                    n_runs = add_run(base + one, over, search.start, i, 0, runs, none)
                    n_runs = add_run(base + one, over, search.ghost_start, 0, n_owned, runs, n_runs)
                    nearby = runs, n_runs, larger, places, none
                    period = grid[PERIOD, 0], grid[PERIOD, 1], grid[PERIOD, 2]
                    end, length = look(i, *nearby, search, period, looked, length, first, second, end, last, counts)
        ends[p] = keep_pairs(length, looked, search.ghost_rows, search.frozen, search.ids, first, second, end, last, counts)
        needed[p] = 0
