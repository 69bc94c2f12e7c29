"""How well grains of two colours are mixed: the index of Lacey (1954, J. Appl. Chem. 4, 257).

M = (s0^2 - s^2) / (s0^2 - sr^2): s^2 is the variance of the share p of one colour among the cells of a grid, s0^2 = p (1 - p)
that of colours apart, sr^2 = p (1 - p) / n that of grains put at random, n to a cell. Cells count by their grains, so that with k
cells and N grains the mean of 1 / n is k / N.
"""

import numpy as np


def lacey(coloured, grains):
    """The index: 0 of colours apart, 1, but for chance, of grains at random; NaN where it has no meaning.

    Args:
        coloured, grains: (cells,) how many grains of one colour, and how many in all.

    >>> lacey([2, 0], [2, 2])
    0.0
    >>> lacey([2, 3, 1], [4, 6, 2])
    1.3333333333333333
    """
    coloured, grains = np.asarray(coloured, dtype=float), np.asarray(grains, dtype=float)
    coloured, grains = coloured[grains > 0], grains[grains > 0]
    total = grains.sum()
    share = coloured.sum() / total
    apart = share * (1.0 - share)
    random = apart * len(grains) / total
    if apart <= random:
        return float("nan")
    variance = (grains * (coloured / grains - share) ** 2).sum() / total
    return float((apart - variance) / (apart - random))
