"""Grain sizes: what is drawn has the curve of the table or formula, and a grain's size is its own."""

from itertools import pairwise
from math import erfc, exp, log, pi

import numpy as np
import pytest

from barchan.chance import uniform
from barchan.errors import SceneError
from barchan.packing import Exponential, LogNormal, Sieves, Uniform, normal

SIZES = np.array([0.5e-3, 1e-3, 2e-3, 3e-3, 8e-3])
PASSING = np.array([0.0, 0.2, 0.2, 0.55, 1.0])
COUNT = 200_000


def curve(diameter):
    """Fraction passing by the formula of the class: a straight line over the logarithm of the diameter."""
    return np.interp(np.log(diameter), np.log(SIZES), PASSING)


@pytest.mark.parametrize("by", ["mass", "number"])
def test_what_is_drawn_has_the_curve_of_the_table(by):
    """At the sieves and between them, within five standard errors of a weighted sample."""
    diameter = 2.0 * Sieves(SIZES, PASSING, by).radii(3, np.arange(COUNT))
    weight = diameter**3 if by == "mass" else np.ones(COUNT)
    assert SIZES[0] <= diameter.min() and diameter.max() <= SIZES[-1]
    for d in np.geomspace(0.55e-3, 7.5e-3, 23):
        passing, expected = (diameter <= d), curve(d)
        error = np.sqrt((weight**2 * (passing - expected) ** 2).sum()) / weight.sum()
        assert abs((weight * passing).sum() / weight.sum() - expected) < 5.0 * error + 1e-12, d
    assert error < 0.01, "a sharp test"


@pytest.mark.parametrize("by", ["mass", "number"])
def test_numbers_and_volume_are_the_integrals_of_the_curve(by):
    """dP is constant in ln d between two sieves; here integrated by the midpoint rule instead of in closed form."""
    sieves, counts, volumes = Sieves(SIZES, PASSING, by), [], []
    for (a, b), share in zip(pairwise(SIZES), np.diff(PASSING)):
        d = np.exp(log(a) + log(b / a) * (np.arange(20_000) + 0.5) / 20_000)
        number = share * (np.mean(d**-3.0) if by == "mass" else 1.0)
        counts.append(number)
        volumes.append(pi / 6.0 * share * (1.0 if by == "mass" else np.mean(d**3)))
    assert sieves.number_fractions == pytest.approx(np.array(counts) / sum(counts), rel=1e-7)
    assert sieves.mean_volume == pytest.approx(sum(volumes) / sum(counts), rel=1e-7)


def test_nothing_is_drawn_where_nothing_is():
    diameter = 2.0 * Sieves(SIZES, PASSING).radii(3, np.arange(COUNT))
    assert not ((diameter > 1.0001e-3) & (diameter < 1.9999e-3)).any()
    diameter = 2.0 * Sieves([1.0, 2.0, 3.0], [0.0, 1.0, 1.0], "number").radii(1, np.arange(COUNT))
    assert diameter.max() <= 2.0


ALL = [
    Sieves(SIZES, PASSING),
    Uniform(1.0, 2.0),
    Uniform(1.0, 2.0, "mass"),
    Exponential(1.0, 1.0, 9.0),
    LogNormal(1.0, 0.5, 0.1, 10.0),
    LogNormal(1.0, 2.5, 0.5, 2.0),
]


@pytest.mark.parametrize("sizes", ALL, ids=lambda sizes: type(sizes).__name__)
def test_a_radius_depends_on_seed_and_number_only(sizes):
    whole = sizes.radii(3, np.arange(10_000))
    assert np.array_equal(sizes.radii(3, np.arange(10_000)), whole)
    assert not np.array_equal(sizes.radii(4, np.arange(10_000)), whole)
    random = np.random.default_rng(1)
    for some in (
        *np.arange(40).reshape(-1, 1),
        np.arange(4090, 4103),
        np.array([], dtype=int),
        np.array([9999, 0, 4096, 0]),
        random.permutation(10_000)[:777],
    ):
        assert np.array_equal(sizes.radii(3, some), whole[some])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (([1.0], [1.0]), "two sieves or more"),
        (([1.0, 2.0], [0.0, 0.5, 1.0]), r"shape \(2,\) and passing \(3,\)"),
        (([2.0, 1.0], [0.0, 1.0]), r"sizes = \[2.0, 1.0\].*ascend"),
        (([0.0, 1.0], [0.0, 1.0]), "above 0"),
        (([1.0, np.inf], [0.0, 1.0]), "finite"),
        (([1.0, "a"], [0.0, 1.0]), "must be numbers"),
        (([1.0, 2.0, 3.0], [0.0, 0.6, 0.5]), "never fall"),
        (([1.0, 2.0], [0.0, np.nan]), "finite, and never fall"),
        (([1.0, 2.0], [0.1, 1.0]), "begin with 0 and end with 1"),
        (([1.0, 2.0], [0.0, 100.0]), "no percent"),
        (([1.0, 2.0], [0.0, 1.0], "volume"), "'mass' or 'number'"),
    ],
)
def test_a_table_that_is_none_is_refused(table, message):
    with pytest.raises(SceneError, match=message):
        Sieves(*table)


@pytest.mark.parametrize("sizes", ALL, ids=lambda sizes: type(sizes).__name__)
@pytest.mark.parametrize(("seed", "numbers"), [(-1, [0]), (1.0, [0]), (True, [0]), (1, [-1]), (1, [0.5]), (1, 3), (2**63, [0])])
def test_seeds_and_numbers_that_cannot_be_are_refused(sizes, seed, numbers):
    with pytest.raises(SceneError, match=rf"{type(sizes).__name__.lower()}: (seed|numbers) = "):
        sizes.radii(seed, np.array(numbers))


MANY = 1_000_000


def below(z):
    """Share of the standard normal distribution below numbers (k,), by a slower way than the library's."""
    return 0.5 * np.array([erfc(-x / 2**0.5) for x in np.ravel(z)])


def shares(density, d, low, high):
    """Share of the integral of a density that lies below diameters ``d``, by the trapezoidal rule in ln d."""
    x = np.linspace(log(low), log(high), 2_000_001)
    y = density(np.exp(x)) * np.exp(x)
    whole = np.append(0.0, np.cumsum(0.5 * (y[1:] + y[:-1])))
    return np.interp(np.log(d), x, whole / whole[-1])


def bell(median, deviation):
    """Density of ln-normal diameters."""
    return lambda d: np.exp(-0.5 * (np.log(d / median) / deviation) ** 2) / d


#: Distribution, its bounds, and the density that it is defined by, of the number or of the mass.
FORMULAS = {
    "uniform": (Uniform(1e-3, 4e-3), (1e-3, 4e-3), "number", np.ones_like),
    "uniform, mass": (Uniform(1e-3, 4e-3, by="mass"), (1e-3, 4e-3), "mass", np.ones_like),
    "exponential": (Exponential(1.5, 1.0, 6.0), (1.0, 6.0), "number", lambda d: np.exp(-(d - 1.0) / 1.5)),
    "flat exponential": (Exponential(150.0, 1.0, 6.0), (1.0, 6.0), "number", lambda d: np.exp(-(d - 1.0) / 150.0)),
    "steep exponential": (Exponential(0.2, 1.0, 6.0), (1.0, 6.0), "number", lambda d: np.exp(-(d - 1.0) / 0.2)),
    "log-normal": (LogNormal(2.0, 0.4, 0.7, 4.0), (0.7, 4.0), "mass", bell(2.0, 0.4)),
    "log-normal, number": (LogNormal(2.0, 0.4, 0.7, 4.0, by="number"), (0.7, 4.0), "number", bell(2.0, 0.4)),
    "upper tail": (LogNormal(1.0, 2.5, 0.5, 2.0), (0.5, 2.0), "mass", bell(1.0, 2.5)),
    "lower tail": (LogNormal(9.0, 0.3, 0.5, 1.0, by="number"), (0.5, 1.0), "number", bell(9.0, 0.3)),
}
formulas = pytest.mark.parametrize(("sizes", "bounds", "by", "density"), FORMULAS.values(), ids=FORMULAS)


@formulas
def test_what_is_drawn_has_the_density_of_the_formula(sizes, bounds, by, density):
    """By number, the share of the grains below each is the random number it came from; by mass, within five standard errors.
    Both shares are integrated numerically from the one density in the docstring of the class."""
    diameter, drawn = 2.0 * sizes.radii(3, np.arange(MANY)), uniform(3, np.arange(MANY))
    assert bounds[0] <= diameter.min() and diameter.max() <= bounds[1]
    by_number = density if by == "number" else (lambda d: density(d) / d**3)
    by_mass = density if by == "mass" else (lambda d: density(d) * d**3)
    assert np.abs(shares(by_number, diameter, *bounds) - drawn).max() < 1e-9
    weight = diameter**3
    for d in np.quantile(diameter, np.linspace(0.05, 0.99, 12)):
        passing, expected = diameter <= d, shares(by_mass, d, *bounds)
        error = np.sqrt((weight**2 * (passing - expected) ** 2).sum()) / weight.sum()
        assert abs((weight * passing).sum() / weight.sum() - expected) < 5.0 * error + 1e-12, d
        assert error < 0.01, "a sharp test"


@formulas
def test_mean_volume_is_the_integral_and_that_of_what_is_drawn(sizes, bounds, by, density):
    x = np.linspace(log(bounds[0]), log(bounds[1]), 1_000_001)
    d = np.exp(x)
    number = density(d) * d * (d**-3 if by == "mass" else 1.0)
    number[[0, -1]] *= 0.5
    assert sizes.mean_volume == pytest.approx(pi / 6.0 * (number * d**3).sum() / number.sum(), rel=1e-9)
    volume = 4.0 / 3.0 * pi * sizes.radii(8, np.arange(MANY)) ** 3
    assert abs(volume.mean() - sizes.mean_volume) < 5.0 * volume.std() / MANY**0.5


def test_log_normal_shares_are_those_of_the_error_function():
    """To the last digits, by number around the median of Hatch & Choate, and from the end that has the digits."""
    sizes, drawn = LogNormal(2.0, 0.4, 0.7, 4.0), uniform(3, np.arange(100_000))
    low, z, high = (np.log(d / (2.0 * exp(-3 * 0.4**2))) / 0.4 for d in (0.7, 2.0 * sizes.radii(3, np.arange(100_000)), 4.0))
    assert np.abs((below(z) - below(low)) / (below(high) - below(low)) - drawn).max() < 1e-14
    sizes = LogNormal(1.0, 2.5, 0.5, 2.0)
    low, z, high = ((np.log(d) + 3 * 2.5**2) / 2.5 for d in (0.5, 2.0 * sizes.radii(3, np.arange(100_000)), 2.0))
    assert low > 7.0, "shares below would all be 1"
    assert np.abs((below(-z) - below(-high)) / (below(-low) - below(-high)) - (1.0 - drawn)).max() < 1e-12


def test_quantiles_of_the_normal_distribution():
    """The share below, by the error function, is the one given; an error of 1e-12 of z is one of about 1e-12 z^2 of the share."""
    share = np.append(np.geomspace(1e-307, 0.01, 2000), np.linspace(0.01, 0.4999, 2000))
    z = normal.quantile(share, 1.0 - share)
    assert np.array_equal(normal.quantile(1.0 - share, share), -z)
    assert (np.abs(below(z) / share - 1.0) < 1e-13 + 1e-15 * z**2).all()
    assert normal.quantile(np.array([0.5, 0.0]), np.array([0.5, 1.0])) == pytest.approx([0.0, -37.519379], abs=1e-6)


def test_a_narrow_range_has_volumes_of_its_own():
    for sizes in (LogNormal(1.0, 1.0, 1.0, 1.0 + 1e-12), Exponential(1.0, 1.0, 1.0 + 1e-12), Uniform(1.0, 1.0 + 1e-12, "mass")):
        assert pi / 6.0 <= sizes.mean_volume * (1.0 + 1e-15) and sizes.mean_volume <= pi / 6.0 * (1.0 + 4e-12)
        assert 0.5 <= sizes.radii(1, np.arange(1000)).min() and sizes.radii(1, np.arange(1000)).max() <= 0.5 + 5e-13


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Uniform(2.0, 1.0), r"uniform: smallest = 2.0 must be below largest = 1.0 \[length\]"),
        (lambda: Uniform(1.0, 1.0), "uniform: smallest = 1.0 must be below"),
        (lambda: Uniform(0.0, 1.0), r"uniform: smallest = 0.0 \[length\] must be a number > 0"),
        (lambda: Uniform(1.0, np.inf), "uniform: largest = inf"),
        (lambda: Uniform("1", 2.0), "uniform: smallest = '1'"),
        (lambda: Uniform(True, 2.0), "uniform: smallest = True"),
        (lambda: Uniform(1.0, [2.0, 3.0]), r"uniform: largest = \[2.0, 3.0\]"),
        (lambda: Uniform(1.0, 10**400), "uniform: largest = 1"),
        (lambda: Uniform(1.0, 2.0, "volume"), "uniform: by = 'volume' must be 'mass' or 'number'"),
        (lambda: Exponential(0.0, 1.0, 2.0), r"exponential: scale = 0.0 \[length\] must be a number > 0"),
        (lambda: Exponential(np.nan, 1.0, 2.0), "exponential: scale = nan"),
        (lambda: Exponential(1.0, 2.0, 1.0), "exponential: smallest = 2.0 must be below"),
        (lambda: LogNormal(-1.0, 1.0, 1.0, 2.0), r"lognormal: median = -1.0 \[length\] must be a number > 0"),
        (lambda: LogNormal(1.0, 0.0, 1.0, 2.0), r"lognormal: deviation = 0.0 \[1\] must be a number > 0 and at most 10"),
        (lambda: LogNormal(1.0, 11, 1.0, 2.0), "lognormal: deviation = 11"),
        (lambda: LogNormal(1.0, np.nan, 1.0, 2.0), "lognormal: deviation = nan"),
        (lambda: LogNormal(1.0, "wide", 1.0, 2.0), "lognormal: deviation = 'wide'"),
        (lambda: LogNormal(1.0, 1.0, 3.0, 2.0), "lognormal: smallest = 3.0 must be below"),
        (lambda: LogNormal(1.0, 1.0, 1.0, 2.0, by=3), "lognormal: by = 3"),
        (lambda: LogNormal(1.0, 0.01, 2.0, 3.0), r"between smallest = 2.0 and largest = 3.0 \[length\] lie next to none"),
        (lambda: LogNormal(1.0, 10.0, 1.0, 1.0 + 4e-16), "lie next to none"),
    ],
)
def test_a_formula_that_is_none_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()
