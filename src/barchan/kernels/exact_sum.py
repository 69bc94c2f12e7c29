"""An exact sum of doubles: the same result in any order, on any number of threads and ranks.

A double is an integer of 53 bits times a power of two. The accumulator is a row of 64-bit integers, each worth 2^32 times
the one below; a double is cut into pieces of 32 bits that are added to three of them. Integer addition knows no order, and
accumulators of several ranks are added as integers. Room for 2^30 terms between two carries.
"""

import math

import numpy as np

from barchan.kernels.compiler import helper, kernel

#: 2^-1074 to 2^1024 in pieces of 32 bits, and one for the carry.
LIMBS = 68
_CARRY_EVERY = 1 << 29


@helper
def add(limbs, value):
    """Add a finite number to ``limbs``, which is modified."""
    mantissa, exponent = math.frexp(value)
    whole = np.int64(mantissa * 9007199254740992.0)
    shift = exponent - 53 + 1074
    if shift < 0:  # subnormal: the low bits are zeros
        whole = whole >> (-shift)
        shift = 0
    limb = shift >> 5
    offset = shift & 31
    sign = 1
    if whole < 0:
        sign = -1
        whole = -whole
    low = whole & 0xFFFFFFFF
    high = whole >> 32
    a = low << offset
    b = high << offset
    limbs[limb] += sign * (a & 0xFFFFFFFF)
    limbs[limb + 1] += sign * ((a >> 32) + (b & 0xFFFFFFFF))
    limbs[limb + 2] += sign * (b >> 32)


@kernel()
def accumulate(values, limbs):
    """Add ``values`` (1-D) to ``limbs`` (LIMBS,), which is modified. Returns the number of values that are not finite."""
    bad = 0
    for i in range(values.shape[0]):
        if values[i] - values[i] == 0.0:
            add(limbs, values[i])
        else:
            bad += 1
        if (i + 1) % _CARRY_EVERY == 0:
            carry(limbs)
    return bad


@kernel()
def carry(limbs):
    """Bring all pieces but the last below 2^32. ``limbs`` is modified, its value is not."""
    for i in range(limbs.shape[0] - 1):
        over = limbs[i] >> 32
        limbs[i] -= over << 32
        limbs[i + 1] += over


@kernel()
def value_of(limbs):
    """The sum in ``limbs``, rounded once to the nearest double. ``limbs`` is modified: afterwards it is worth nothing."""
    carry(limbs)
    top = limbs.shape[0] - 1
    sign = 1.0
    if limbs[top] < 0:
        sign = -1.0
        for i in range(limbs.shape[0]):
            limbs[i] = -limbs[i]
        carry(limbs)
    while top > 0 and limbs[top] == 0:
        top -= 1
    high, middle, low = limbs[top], limbs[top - 1] if top > 0 else 0, limbs[top - 2] if top > 1 else 0
    bits = 0
    while high >> bits > 0:
        bits += 1
    if bits > 32:  # beyond all doubles
        return sign * math.inf
    # 62 bits from the highest on; the last of them is set where anything below is: then they round as the whole does
    above = max(30 - bits, 0)
    below = max(bits - 30, 0)
    mantissa = (high << (62 - bits)) | ((middle << above) >> below) | (low >> (32 - above))
    rest = (middle & ((1 << below) - 1)) | (low & ((1 << (32 - above)) - 1))
    for i in range(top - 2):
        rest |= limbs[i]
    if rest != 0:
        mantissa |= 1
    exponent = 32 * top + bits - 62 - 1074
    half = exponent // 2  # in two steps, each within the range of doubles
    return sign * float(mantissa) * math.ldexp(1.0, half) * math.ldexp(1.0, exponent - half)


def exact_sum(values, comm=None):
    """Sum of an array of doubles over all ranks, rounded once.

    Args:
        values: array of any shape; it is summed over all elements.
        comm: communicator; None sums on this rank alone.

    Returns:
        The correctly rounded sum; NaN if any value is not finite.

    >>> exact_sum(np.array([1e100, 1.0, -1e100, 2.0**-1074]))
    1.0
    """
    limbs = np.zeros(LIMBS, dtype=np.int64)
    bad = accumulate(np.ascontiguousarray(values, dtype=np.float64).ravel(), limbs)
    carry(limbs)
    if comm is not None:
        reduced = comm.sum(np.append(limbs, bad))
        limbs, bad = reduced[:-1], reduced[-1]
    return math.nan if bad else value_of(limbs)
