"""Sums over all grains, many at once and by bins. They are exact (``kernels/exact_sum.py``): what is printed has the same
bits for any order of the grains, any number of threads and ranks."""

import math
from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.exact_sum import LIMBS, accumulate, carry, value_of

#: So that the number of a bin fits into 16 bits, which NumPy sorts in linear time.
_MOST_BINS = 65_535


class Bins(NamedTuple):
    """``count`` bins of width ``cell`` along an axis, the first from ``first`` * ``cell`` on [length].

    Their edges are multiples of ``cell`` wherever the grains are, so that bins of different times can be compared.
    """

    cell: float
    first: int
    count: int

    @classmethod
    def over(cls, low, high, cell):
        """The bins that hold all from ``low`` to ``high``.

        Raises:
            SceneError: there would be too many.
        """
        if (high - low) / cell >= _MOST_BINS - 2:
            raise SceneError(
                f"cell = {cell:g} [length] cuts the extent of the grains, {high - low:g}, into more than {_MOST_BINS} bins; "
                f"use a larger cell"
            )
        first = math.floor(low / cell)
        return cls(cell, first, math.floor(high / cell) - first + 1)

    def index(self, place):
        """Bin of each coordinate; what lies outside counts in the bin at that end."""
        return np.clip(np.floor(place / self.cell).astype(np.int64) - self.first, 0, self.count - 1)

    @property
    def edges(self):
        """Their edges, (count + 1,) [length]."""
        return (self.first + np.arange(self.count + 1)) * self.cell

    @property
    def centres(self):
        """Their centres, (count,) [length]."""
        return (self.first + np.arange(self.count) + 0.5) * self.cell


def exact_sums(columns, comm, index=None, count=1):
    """Exact sums over all ranks, with one reduction.

    Args:
        columns: arrays (k,), one for each quantity.
        comm: communicator.
        index: (k,) bin of each row, 0 to ``count`` - 1; default: all rows in one.

    Returns:
        (columns, count) sums, each rounded once; NaN where a value is not finite.
    """
    order, ends = slice(None), np.array([0, len(columns[0])])
    if index is not None:
        order = np.argsort(index.astype(np.uint16), kind="stable")
        ends = np.searchsorted(index[order], np.arange(count + 1))
    limbs = np.zeros((len(columns), count, LIMBS + 1), dtype=np.int64)  # the last: how many are not finite
    for column, rows in zip(columns, limbs):
        ordered = np.ascontiguousarray(column[order], dtype=np.float64)
        for b in np.flatnonzero(np.diff(ends)):
            rows[b, -1] = accumulate(ordered[ends[b] : ends[b + 1]], rows[b, :-1])
            carry(rows[b, :-1])
    reduced = comm.sum(limbs).reshape(-1, LIMBS + 1)
    totals = [math.nan if row[-1] else value_of(row[:-1]) if row.any() else 0.0 for row in reduced]
    return np.array(totals).reshape(len(columns), count)


def quantile(bins, amounts, fraction):
    """Coordinate below which a fraction of the whole lies; within a bin the amount counts as evenly spread [length].

    Args:
        bins: ``Bins``.
        amounts: (count,) not negative. 0.0 is returned when all are 0.
        fraction: above 0, at most 1.
    """
    below = np.concatenate([[0.0], np.cumsum(amounts)])
    wanted = fraction * below[-1]
    if wanted == 0.0:
        return 0.0
    b = int(np.searchsorted(below, wanted)) - 1
    return float(bins.edges[b] + bins.cell * (wanted - below[b]) / (below[b + 1] - below[b]))


def crossing(here, there, value):
    """Where between two neighbours, 0 to 1, a quantity linear between them takes a value.

    >>> crossing(2.0, 4.0, 3.0)
    0.5
    """
    return (value - here) / (there - here)
