"""Which rank owns which part of space: equal bricks."""

from itertools import product

import numpy as np


def brick_counts(size, length):
    """Bricks along each axis with the least surface between ranks.

    >>> brick_counts(4, np.array([4.0, 1.0, 1.0]))
    (4, 1, 1)
    """
    ways = [c for c in product(range(1, size + 1), repeat=3) if c[0] * c[1] * c[2] == size]

    def surface(counts):
        edges = length / np.array(counts)
        return edges[0] * edges[1] + edges[1] * edges[2] + edges[2] * edges[0]

    return min(ways, key=lambda counts: (surface(counts), counts))


class Bricks:
    """The box cut into equal bricks, one a rank.

    Args:
        box: the ``Box``.
        size: number of ranks.
    """

    def __init__(self, box, size):
        self.box, self.size = box, size
        self.counts = np.array(brick_counts(size, box.length))
        self.edge = box.length / self.counts

    def owner(self, position):
        """Rank that owns each point, shape (k,)."""
        cell = np.clip(np.floor((position - self.box.low) / self.edge).astype(np.int64), 0, self.counts - 1)
        return (cell[:, 0] * self.counts[1] + cell[:, 1]) * self.counts[2] + cell[:, 2]

    def bounds(self, rank):
        """Low and high corner of a rank's brick."""
        cell = np.array(np.unravel_index(rank, self.counts))
        return self.box.low + cell * self.edge, self.box.low + (cell + 1) * self.edge

    def distance(self, position, rank):
        """Distance of points to a rank's brick, over the nearest periodic image, shape (k,)."""
        low, high = self.bounds(rank)
        away = np.abs(self.box.difference(position, 0.5 * (low + high))) - 0.5 * (high - low)
        return np.sqrt((np.maximum(away, 0.0) ** 2).sum(axis=1))

    def neighbours(self, rank, reach):
        """Ranks whose bricks come within ``reach`` of a rank's brick."""
        low, high = self.bounds(rank)
        centre = 0.5 * (low + high)
        others = [other for other in range(self.size) if other != rank]
        near = []
        for other in others:
            middle = 0.5 * sum(self.bounds(other))
            gap = np.maximum(np.abs(self.box.difference(centre, middle)) - self.edge, 0.0)
            if np.sqrt((gap**2).sum()) <= reach:
                near.append(other)
        return near
