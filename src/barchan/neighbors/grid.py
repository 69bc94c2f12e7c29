"""The grid of cells in which neighbours are searched."""

import numpy as np

from barchan.kernels import cells


def grid_around(grains, bounds, box, cutoff):
    """Cells of at least ``cutoff`` [length] around the grains and their ghosts.

    Args:
        bounds: low and high corner of this rank's part of space.
    """
    is_whole = np.array_equal(bounds, (box.low, box.high))
    margin = 0.0 if is_whole else cutoff  # for ghosts
    low, high = bounds[0] - margin, bounds[1] + margin
    if grains.n:
        extents = np.array(cells.extents(grains.block("place"))[:6])
        low = np.where(box.periodic, low, np.maximum(low, extents[::2] - margin))
        high = np.where(box.periodic, high, np.minimum(high, extents[1::2] + margin))
    return cells.make_grid(low, high, cutoff, 2.0 * grains.n + 64.0, box.frame)
