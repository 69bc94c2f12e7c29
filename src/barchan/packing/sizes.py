"""Grain sizes by a formula, and what all distributions of sizes share: each grain's size follows from its own number."""

from math import exp, expm1, log, pi

import numpy as np

from barchan.chance import uniform
from barchan.errors import SceneError
from barchan.packing import normal
from barchan.words import shown


class Sizes:
    """What all distributions share; each gives ``_quantile(share)``, the diameters below which shares (k,) of the grains lie."""

    def radii(self, seed, numbers):
        """Radii of grains, each of which depends on the seed and on the grain's number only: of several ranks each can ask for
        its own part.

        Args:
            seed: whole number >= 0.
            numbers: (k,) of the grains, whole numbers >= 0.

        Returns:
            (k,) [length].

        Raises:
            SceneError: seed or numbers are no such numbers.
        """
        name, numbers = type(self).__name__.lower(), np.asarray(numbers)
        if numbers.ndim != 1 or numbers.dtype.kind not in "iu" or (numbers < 0).any():
            raise SceneError(f"{name}: numbers = {shown(numbers)} must be whole numbers >= 0, such as numpy.arange(1000)")
        if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or not 0 <= seed < 2**63:
            raise SceneError(f"{name}: seed = {shown(seed)} must be a whole number from 0 to below 2^63")
        return 0.5 * self._quantile(uniform(int(seed), numbers))


class Uniform(Sizes):
    """Every diameter between two has the same share, of the grains or of their mass.

    Source: by mass, the number of grains of diameter d is as d^-3.

    Args:
        smallest: diameter [length].
        largest: diameter [length].
        by: "number" or "mass": what is uniform. All grains have one density.

    Attributes: ``mean_volume`` of a grain [length^3].

    Raises:
        SceneError: a value that cannot be used.

    >>> Uniform(1.0, 3.0).radii(7, np.arange(3)).round(3).tolist()
    [1.372, 0.795, 0.92]
    >>> round(Uniform(1.0, 3.0).mean_volume / Uniform(1.0, 3.0, by="mass").mean_volume, 6)  # as many grains of all sizes
    2.222222
    """

    def __init__(self, smallest, largest, by="number"):
        self.smallest, self.largest = small, large = _bounds("uniform", smallest, largest)
        self.by = _basis("uniform", by)
        if by == "mass":
            cube = 2.0 * small * (small * large / (small + large)) * large
        else:
            cube = (small + large) * (small**2 + large**2) / 4.0
        self.mean_volume = pi / 6.0 * cube

    def _quantile(self, share):
        if self.by == "mass":
            diameter = self.smallest / np.sqrt(1.0 - share * (1.0 - (self.smallest / self.largest) ** 2))
        else:
            diameter = self.smallest + share * (self.largest - self.smallest)
        return np.clip(diameter, self.smallest, self.largest)  # not beyond by rounding


class Exponential(Sizes):
    """The number of grains of diameter d is as exp(-(d - smallest)/scale), up to the largest.

    Args:
        scale: over which the number falls to 1/e [length].
        smallest: diameter [length].
        largest: diameter [length].

    Attributes: ``mean_volume`` of a grain [length^3].

    Raises:
        SceneError: a value that cannot be used.

    >>> dust = Exponential(scale=1.0, smallest=1.0, largest=5.0)
    >>> round(float((dust.radii(1, np.arange(100_000)) < 1.0).mean()), 2)  # (1 - 1/e) / (1 - 1/e^4) are below diameter 2
    0.64
    """

    def __init__(self, scale, smallest, largest):
        self.smallest, self.largest = small, large = _bounds("exponential", smallest, largest)
        self.scale = c = _length("exponential", "scale", scale)
        width = (large - small) / c
        if width > 1.0:  # the integral of d^3 exp(-(d - smallest)/c), by parts
            ends = [d**3 + 3.0 * c * d**2 + 6.0 * c**2 * d + 6.0 * c**3 for d in (small, large)]
            cube = (ends[0] - exp(-width) * ends[1]) / -expm1(-width)
        else:  # there its terms cancel; 12 points of Gauss are exact but for rounding
            place, weight = np.polynomial.legendre.leggauss(12)
            part = 0.5 * (1.0 + place)
            weight = weight * np.exp(-width * part)
            cube = float(weight @ (small + (large - small) * part) ** 3 / weight.sum())
        self.mean_volume = pi / 6.0 * cube

    def _quantile(self, share):
        beyond = -self.scale * np.log1p(share * expm1(-(self.largest - self.smallest) / self.scale))
        return np.clip(self.smallest + beyond, self.smallest, self.largest)


class LogNormal(Sizes):
    """The logarithm of the diameter is normally distributed, and cut off at a smallest and a largest diameter.

    Where that is so by mass, it is so by number, too, around a median that is exp(-3 deviation^2) times as large.
    Source: Hatch & Choate, J. Franklin Inst. 207, 369 (1929).

    Args:
        median: diameter below which half of the grains or of their mass would lie, were nothing cut off [length].
        deviation: standard deviation of ln d [1], at most 10.
        smallest: diameter [length].
        largest: diameter [length].
        by: "mass" or "number": what the median is of. All grains have one density.

    Attributes: ``mean_volume`` of a grain [length^3].

    Raises:
        SceneError: a value that cannot be used, or next to no grains of the distribution lie between smallest and largest.

    >>> sand = LogNormal(median=1e-3, deviation=0.5, smallest=0.2e-3, largest=5e-3)
    >>> round(float(2e3 * np.median(sand.radii(1, np.arange(10_000)))), 1)  # in mm; exp(-0.75), somewhat more for what is cut off
    0.5
    """

    def __init__(self, median, deviation, smallest, largest, by="mass"):
        self.smallest, self.largest = _bounds("lognormal", smallest, largest)
        self.median, self.by = _length("lognormal", "median", median), _basis("lognormal", by)
        if not _is_number(deviation) or not 0.0 < deviation <= 10.0:
            raise SceneError(f"lognormal: deviation = {shown(deviation)} [1] must be a number > 0 and at most 10")
        self.deviation = wide = float(deviation)
        middle = log(self.median) - (3.0 * wide**2 if by == "mass" else 0.0)
        self._middle = exp(middle)
        low, high = (log(self.smallest) - middle) / wide, (log(self.largest) - middle) / wide
        self._share, heavy = normal.between(low, high), normal.between(low - 3.0 * wide, high - 3.0 * wide)
        if min(self._share, heavy) < np.finfo(float).tiny:
            raise SceneError(
                f"lognormal: between smallest = {self.smallest} and largest = {self.largest} [length] lie next to none of "
                f"the grains around median = {self.median} [length], or of their mass; move them nearer to it or further apart"
            )
        self._below, self._above = normal.below(low), normal.below(-high)
        cube = exp(3.0 * middle + 4.5 * wide**2 + log(heavy) - log(self._share))
        # between close bounds the shares are differences that keep few digits
        self.mean_volume = pi / 6.0 * min(max(cube, self.smallest**3), self.largest**3)

    def _quantile(self, share):
        z = normal.quantile(self._below + share * self._share, self._above + (1.0 - share) * self._share)
        return np.clip(self._middle * np.exp(self.deviation * z), self.smallest, self.largest)


def _is_number(value):
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _length(name, what, value):
    """A user's length; its cube is within the range of doubles."""
    if not _is_number(value) or not 1e-100 <= value <= 1e100:
        raise SceneError(f"{name}: {what} = {shown(value)} [length] must be a number > 0, from 1e-100 to 1e100")
    return float(value)


def _bounds(name, smallest, largest):
    """The two diameters between which all grains are."""
    bounds = _length(name, "smallest", smallest), _length(name, "largest", largest)
    if not bounds[0] < bounds[1]:
        raise SceneError(f"{name}: smallest = {bounds[0]} must be below largest = {bounds[1]} [length]")
    return bounds


def _basis(name, by):
    """What the distribution is of."""
    if by not in ("mass", "number"):
        raise SceneError(f"{name}: by = {shown(by)} must be 'mass' or 'number'")
    return by
