"""Grain sizes from a table of sieves."""

import numpy as np

from barchan.domain import numbers as as_numbers
from barchan.errors import SceneError
from barchan.packing.sizes import Sizes
from barchan.words import shown


class Sieves(Sizes):
    """A distribution of grain sizes, as a sieve analysis gives it.

    Between two sieves the fraction passing grows with the logarithm of the diameter, a straight line in the usual diagram:
    P(d) = P_i + (P_(i+1) - P_i) ln(d/d_i) / ln(d_(i+1)/d_i).

    Args:
        sizes: (k,) diameters of the sieves [length], ascending.
        passing: (k,) fraction of the grains that pass each, from 0 at the finest to 1 at the coarsest; no percent.
        by: "mass" or "number": what the fraction is of. All grains have one density.

    Attributes: ``number_fractions`` (k-1,) of the grains between one sieve and the next; ``mean_volume`` of a grain [length^3].

    Raises:
        SceneError: a value that cannot be used.

    >>> sand = Sieves(sizes=[1e-3, 2e-3, 4e-3], passing=[0.0, 0.5, 1.0])
    >>> sand.number_fractions.round(6).tolist()  # half of the mass each, but the finer grains have an eighth of the volume
    [0.888889, 0.111111]
    """

    def __init__(self, sizes, passing, by="mass"):
        self.sizes, self.passing = as_numbers("sieves: sizes", sizes, "length"), as_numbers("sieves: passing", passing, "1")
        _check(self.sizes, self.passing, by)
        self.by, share, width = by, np.diff(self.passing), np.diff(np.log(self.sizes))
        if by == "mass":  # grains of diameter d: dN ~ dP/d^3
            rest = self.sizes[0] / self.sizes
            count = share * -np.diff(rest**3) / width
            self.number_fractions = count / count.sum()
            self.mean_volume = float(np.pi / 6.0 * self.sizes[0] ** 3 * 3.0 / count.sum())
        else:
            self.number_fractions = share
            self.mean_volume = float(np.pi / 6.0 * (share * np.diff(self.sizes**3) / (3.0 * width)).sum())

    def _quantile(self, share):
        """Diameters below which shares (k,) of the grains lie."""
        ends = np.append(0.0, np.cumsum(self.number_fractions))
        between = np.minimum(np.searchsorted(ends, share, side="right") - 1, np.flatnonzero(self.number_fractions)[-1])
        part = np.minimum((share - ends[between]) / self.number_fractions[between], 1.0)
        fine, coarse = self.sizes[between], self.sizes[between + 1]
        if self.by == "mass":  # the number of grains finer than d grows with -d^-3
            return fine / np.cbrt(1.0 - part * (1.0 - (fine / coarse) ** 3))
        return fine * np.exp(part * np.log(coarse / fine))


def _check(sizes, passing, by):
    """Refuse a table that is none."""
    if sizes.ndim != 1 or len(sizes) < 2 or passing.shape != sizes.shape:
        raise SceneError(
            f"sieves: sizes have shape {sizes.shape} and passing {passing.shape}; give lists of one length, two sieves or more"
        )
    if not (np.isfinite(sizes).all() and sizes[0] > 0.0 and (np.diff(sizes) > 0.0).all()):
        raise SceneError(f"sieves: sizes = {shown(sizes.tolist())} [length] must be finite, above 0, and ascend")
    if not (np.isfinite(passing).all() and (np.diff(passing) >= 0.0).all()):
        raise SceneError(f"sieves: passing = {shown(passing.tolist())} [1] must be finite, and never fall")
    if passing[0] != 0.0 or passing[-1] != 1.0:
        raise SceneError(
            f"sieves: passing = {shown(passing.tolist())} [1] must begin with 0 and end with 1 (fractions, no percent); else the "
            f"finest or coarsest grains have no size: add a sieve that nothing passes, or one that all grains do"
        )
    if by not in ("mass", "number"):
        raise SceneError(f"sieves: by = {shown(by)} must be 'mass' or 'number'")
