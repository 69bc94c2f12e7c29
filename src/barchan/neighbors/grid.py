"""The grids of cells in which neighbours are searched: one for each size class."""

import numpy as np

from barchan.kernels import cells


def grids_around(grains, bounds, box, largest, reach):
    """A grid for each size class, around its grains and their ghosts, of cells that two such grains span.

    Args:
        bounds: low and high corner of this rank's part of space.
        largest: (classes,) radius of the largest grain of each on any rank, ascending [length].
        reach: how far apart the surfaces of neighbours may be [length].
    """
    above = np.append(-np.inf, largest[:-1])
    limits = zip(above, np.append(largest[:-1], np.inf), 2.0 * largest + reach)
    return cells.Grids.of([_around(grains, bounds, box, *limit) for limit in limits], largest)


def _around(grains, bounds, box, above, most, cutoff):
    """The grid of the grains with radii above ``above`` up to ``most``."""
    is_whole = np.array_equal(bounds, (box.low, box.high))
    margin = 0.0 if is_whole else cutoff  # for ghosts
    low, high = bounds[0] - margin, bounds[1] + margin
    *extents, _, count = cells.extents(grains.block("place"), above, most)
    if count:
        extents = np.array(extents)
        low = np.where(box.periodic, low, np.maximum(low, extents[::2] - margin))
        high = np.where(box.periodic, high, np.minimum(high, extents[1::2] + margin))
    low = np.where(box.periodic, low, np.maximum(low, box.low))  # ghosts are in the box, too
    high = np.where(box.periodic, high, np.minimum(high, box.high))
    return cells.make_grid(low, high, cutoff, count, box.frame)
