"""Grain sizes: what is drawn has the curve of the table, and a grain's size is its own."""

from itertools import pairwise
from math import log, pi

import numpy as np
import pytest

from barchan.errors import SceneError
from barchan.packing import Sieves

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


def test_a_radius_depends_on_seed_and_number_only():
    sieves = Sieves(SIZES, PASSING)
    whole = sieves.radii(3, np.arange(10_000))
    assert np.array_equal(sieves.radii(3, np.arange(10_000)), whole)
    assert not np.array_equal(sieves.radii(4, np.arange(10_000)), whole)
    random = np.random.default_rng(1)
    for some in (np.arange(4090, 4103), np.array([], dtype=int), np.array([9999, 0, 4096, 0]), random.permutation(10_000)[:777]):
        assert np.array_equal(sieves.radii(3, some), whole[some])


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


@pytest.mark.parametrize(("seed", "numbers"), [(-1, [0]), (1.0, [0]), (True, [0]), (1, [-1]), (1, [0.5]), (1, 3), (2**63, [0])])
def test_seeds_and_numbers_that_cannot_be_are_refused(seed, numbers):
    with pytest.raises(SceneError, match=r"sieves: (seed|numbers) = "):
        Sieves([1.0, 2.0], [0.0, 1.0]).radii(seed, np.array(numbers))
