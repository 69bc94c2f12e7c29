"""A tree of boxes around triangles: which are near a place is found without looking at all of them."""

import numpy as np

from barchan.kernels.triangles import Tree

#: Triangles in a box that is not divided further.
LEAF = 4


def tree_around(places):
    """A ``Tree`` of triangles, and the order that they must be brought into.

    Args:
        places: (triangles, 3, 3) their corners.
    """
    low, high, middle = places.min(axis=1), places.max(axis=1), places.mean(axis=1)
    nodes, order, waiting = [], [], [np.arange(len(places))]
    while waiting:
        some = waiting.pop()
        nodes.append((low[some].min(axis=0), high[some].max(axis=0), len(order), len(some)))
        if len(some) <= LEAF:
            order.extend(np.sort(some).tolist())
            continue
        axis = int(np.argmax(np.ptp(middle[some], axis=0)))
        ranked = some[np.argsort(middle[some, axis], kind="stable")]
        waiting += [ranked[len(some) // 2 :], ranked[: len(some) // 2]]  # the last is the next
    lows, highs, first, count = map(np.array, zip(*nodes))
    return Tree(lows, highs, _skips(first, count), first, np.where(count <= LEAF, count, 0)), np.array(order)


def _skips(first, count):
    """The node to go on with if nothing of a node is near: the first one that begins where it ends."""
    skip, after = np.full(len(count), len(count)), {}
    for node in range(len(count) - 1, -1, -1):
        skip[node] = after.get(first[node] + count[node], len(count))
        after[first[node]] = node
    return skip
