"""The grids of cells in which neighbours are searched: one for each size class, or one for all."""

import numpy as np

from barchan.kernels import cells


def grids_around(grains, bounds, box, classes, reach):
    """The grids of the ``SizeClasses``, around their grains and ghosts. Cells are those that two such grains span, or smaller.

    Args:
        bounds: low and high corner of this rank's part of space, in the ``Upright`` box.
        reach: how far apart the surfaces of neighbours may be [length].
    """
    largest = classes.largest
    above = np.append(-np.inf, largest[:-1])
    limits = zip(above, np.append(largest[:-1], np.inf), 2.0 * largest + reach, classes.edges(reach))
    place = box.upright.places(grains.block("place"))
    return cells.Grids.of([_around(place, bounds, box.upright, *limit) for limit in limits], largest)


def _around(place, bounds, box, above, most, cutoff, edge):
    """The grid of the grains with radii above ``above`` up to ``most``, neighbours of each other within ``cutoff``."""
    is_whole = np.array_equal(bounds, (box.low, box.high))
    margin = 0.0 if is_whole else cutoff  # for ghosts
    low, high = bounds[0] - margin, bounds[1] + margin
    *extents, _, count = cells.extents(place, above, most)
    if count:
        extents = np.array(extents)
        low = np.where(box.periodic, low, np.maximum(low, extents[::2] - margin))
        high = np.where(box.periodic, high, np.minimum(high, extents[1::2] + margin))
    low = np.where(box.periodic, low, np.maximum(low, box.low))  # ghosts are in the box, too
    high = np.where(box.periodic, high, np.minimum(high, box.high))
    if edge < cutoff:  # a wide stencil would meet the shared places of a sparse grid twice
        wide = high > low
        edge = max(edge, float(np.prod((high - low)[wide]) / (cells.DENSE * max(count, 1))) ** (1.0 / max(wide.sum(), 1)))
    return cells.make_grid(low, high, edge, count, box.frame)
