"""Which rank takes which new part: the one that has most of it already, so that little moves."""

import numpy as np


def matched(overlaps, speeds):
    """Ranks of the parts of a new decomposition, largest overlaps first.

    Args:
        overlaps: for each rank, part -> cost of what it has of that part now.
        speeds: (ranks,) relative; part k was cut for the speed of rank k, so only ranks of the same speed may swap parts.

    Returns:
        (ranks,) rank of each part.

    >>> matched([{1: 9, 0: 1}, {0: 5}], np.ones(2)).tolist()
    [1, 0]
    """
    entries = [(-cost, rank, part) for rank, parts in enumerate(overlaps) for part, cost in parts.items()]
    rank_of, is_free = np.full(len(speeds), -1), np.ones(len(speeds), dtype=bool)
    for _, rank, part in sorted(entries):
        if rank_of[part] < 0 and is_free[rank] and speeds[rank] == speeds[part]:
            rank_of[part], is_free[rank] = rank, False
    for speed in np.unique(speeds):
        left, free = (np.flatnonzero(some & (speeds == speed)) for some in (rank_of < 0, is_free))
        rank_of[left] = free
    return rank_of
