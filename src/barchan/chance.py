"""Random numbers that belong to things, not to whoever draws them: the same for any order, any part and any rank."""

import numpy as np

#: Numbers that are drawn together: of things in slices each rank needs most of them.
AT_A_TIME = 4096


def uniform(seed, numbers):
    """Random numbers, evenly distributed from 0 to below 1, each of which depends on the seed and its own number only.

    They are those of one row, ``Generator(Philox(key=seed, counter=0)).random()``; Philox counts, so any part of the row can be
    had without the rest (Salmon et al. 2011, Parallel random numbers: as easy as 1, 2, 3).

    Args:
        seed: whole number from 0 to below 2^128.
        numbers: (k,) whole numbers >= 0, in any order.

    Returns:
        (k,) numbers.

    >>> row = uniform(7, np.arange(5000))
    >>> bool((uniform(7, np.array([4999, 3])) == row[[4999, 3]]).all())
    True
    """
    numbers = np.asarray(numbers)
    order = np.argsort(numbers, kind="stable")
    ascending, drawn = numbers[order], np.empty(len(numbers))
    for block in np.unique(ascending // AT_A_TIME).tolist():
        begin, end = np.searchsorted(ascending, [block * AT_A_TIME, (block + 1) * AT_A_TIME])
        words = np.random.Philox(key=seed, counter=0).advance(block * AT_A_TIME // 4)  # it counts four numbers at once
        drawn[order[begin:end]] = np.random.Generator(words).random(AT_A_TIME)[ascending[begin:end] - block * AT_A_TIME]
    return drawn


def uniform_of_pairs(seed, first, second):
    """Random numbers, evenly distributed from 0 to below 1, each of which depends on the seed and a pair of numbers only.

    The pair goes through the finaliser of SplitMix64 (Steele, Lea & Flood 2014), once for each number.

    Args:
        seed: whole number from 0 to below 2^64.
        first, second: (k,) whole numbers >= 0.

    Returns:
        (k,) numbers.

    >>> some = uniform_of_pairs(7, np.arange(10_000), np.arange(10_000) + 1)
    >>> bool(abs(some.mean() - 0.5) < 0.01 and len(np.unique(some)) == 10_000)
    True
    """
    word = np.full(len(first), seed, dtype=np.uint64)
    for number in (first, second):
        word = word + np.uint64(0x9E3779B97F4A7C15) * (np.asarray(number).astype(np.uint64) + np.uint64(1))
        word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        word = word ^ (word >> np.uint64(31))
    return (word >> np.uint64(11)) * 2.0**-53
