"""The exact sum: correctly rounded, and the same bits in any order and on any number of ranks."""

import math
import random
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from barchan.kernels.exact_sum import LIMBS, accumulate, carry, exact_sum, value_of
from barchan.parallel import virtual_ranks, world

pytestmark = pytest.mark.nojit

finite = st.floats(allow_nan=False, allow_infinity=False)
lists = st.lists(finite, max_size=40)
LARGEST, SMALLEST = 1.7976931348623157e308, 5e-324


def bits(value):
    return struct.pack("<d", value + 0.0)  # + 0.0: both zeros are the same sum


def rounded_once(values):
    """The nearest double of the exact sum, by rational arithmetic; infinite from where rounding to nearest says so."""
    exact = sum((Fraction(v) for v in values), Fraction(0))
    if abs(exact) >= Fraction(LARGEST) + Fraction(2) ** 970:
        return math.inf if exact > 0 else -math.inf
    return float(exact)


@given(lists)
@example([1e100, 1.0, -1e100])
@example([SMALLEST] * 3)
@example([SMALLEST, -(2.0**-1022), 2.0**-1060])
@example([LARGEST, LARGEST, -LARGEST])
@example([1.0, 2.0**-53, 2.0**-106])
def test_sum_is_rounded_once(values):
    assert bits(exact_sum(np.array(values))) == bits(rounded_once(values))
    try:
        by_python = math.fsum(values)
    except OverflowError:  # fsum gives up when a partial sum overflows
        return
    assert bits(exact_sum(np.array(values))) == bits(by_python)


@given(lists, st.randoms())
def test_any_order_gives_the_same_bits(values, shuffle):
    before = bits(exact_sum(np.array(values)))
    shuffle.shuffle(values)
    assert bits(exact_sum(np.array(values))) == before


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([LARGEST, LARGEST], math.inf),
        ([-LARGEST, -LARGEST], -math.inf),
        ([LARGEST, 2.0**969], LARGEST),
        ([LARGEST, 2.0**970], math.inf),  # half way to the next double that would be: a tie goes to the even one, 2^1024
        ([], 0.0),
    ],
)
def test_the_ends_of_the_range(values, expected):
    assert exact_sum(np.array(values)) == expected


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_makes_the_sum_nan(bad):
    assert math.isnan(exact_sum(np.array([1.0, bad, 2.0])))


def test_arrays_of_any_shape_and_stride():
    table = np.random.default_rng(0).normal(size=(30, 7))
    assert exact_sum(table) == math.fsum(table.ravel())
    assert exact_sum(table[::3, 2]) == math.fsum(table[::3, 2])


def test_accumulating_in_parts_equals_accumulating_at_once():
    """As a wall force does that is summed over steps: the limbs carry and go on."""
    values = np.random.default_rng(1).normal(size=300) * 10.0 ** np.random.default_rng(2).integers(-200, 200, 300)
    limbs = np.zeros(LIMBS, dtype=np.int64)
    for part in np.split(values, 10):
        assert accumulate(part, limbs) == 0
        carry(limbs)
        assert (limbs[:-1] >= 0).all() and (limbs[:-1] < 2**32).all()
    assert value_of(limbs) == math.fsum(values)


@pytest.mark.parametrize("size", [2, 3])
def test_ranks_sum_to_the_same_bits_as_one(size):
    values = np.array([random.Random(5).uniform(-1, 1) * 10.0**k for k in range(-15, 16)] * 3)

    def program():
        return exact_sum(values[world().rank :: size], world())

    assert virtual_ranks(size, program) == [math.fsum(values)] * size


def test_a_bad_value_on_one_rank_is_seen_on_all():
    def program():
        return exact_sum(np.array([1.0, math.nan if world().rank == 1 else 2.0]), world())

    assert all(math.isnan(value) for value in virtual_ranks(2, program))
