"""Recursive coordinate bisection: space is cut across its longest side until each rank has a part, near to a brick."""

import numpy as np


def bisection(cost, shape, edge, speeds):
    """Owners of sub-domains, so that each rank's share of the cost is that of its speed.

    A cut goes along a layer of sub-domains, and within the layer that it meets along a row: so each half has its share to
    within half a sub-domain, at the price of one step in its surface.

    Args:
        cost: (sub-domains,) integers, along z fastest.
        shape: sub-domains along each axis, three numbers.
        edge: lengths of a sub-domain, three numbers.
        speeds: (ranks,) relative.

    Returns:
        (sub-domains,) ranks.
    """
    owners = np.zeros(len(cost), dtype=np.int32)
    places = np.stack(np.unravel_index(np.arange(len(cost)), shape), axis=1)
    parts = [(np.arange(len(cost)), 0, len(speeds))]
    while parts:
        cells, first, last = parts.pop()
        if last - first == 1:
            owners[cells] = first
            continue
        middle = (first + last) // 2
        share = speeds[first:middle].sum() / speeds[first:last].sum()
        there = places[cells][cost[cells] > 0] if cost[cells].any() else places[cells]
        extent = (np.ptp(there, axis=0) + 1 if len(there) else np.ones(3)) * edge
        axes = np.argsort(extent, kind="stable")  # the last is the longest
        ordered = cells[np.lexsort(places[cells][:, axes].T)]
        summed = np.concatenate([[0], np.cumsum(cost[ordered] if cost[cells].any() else np.ones_like(ordered))])
        cut = int(np.argmin(np.abs(summed - share * summed[-1])))
        parts += [(ordered[:cut], first, middle), (ordered[cut:], middle, last)]
    return owners
