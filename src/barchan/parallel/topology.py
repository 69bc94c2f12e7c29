"""Which rank owns which part of space: the box cut into sub-domains, many for each rank, and the owner of each. Where the box
tilts they lean as it does: it is the ``Upright`` box that is cut.

Several topologies may exist side by side; a ``Mapping`` brings rows from the owners of one to those of another.
"""

from itertools import product

import numpy as np

from barchan.kernels import reach as kernels
from barchan.parallel.partition.bisection import bisection

#: Relative room for rounding in distances: a ghost too many costs nothing, one too few loses contacts.
_ROUNDING = 1e-9


class Topology:
    """Sub-domains of a box and their owners.

    Args:
        box: the ``Box``.
        shape: sub-domains along each axis, three numbers.
        owner: (sub-domains,) rank of each, along z fastest.
        size: number of ranks.
    """

    def __init__(self, box, shape, owner, size):
        self.box, self.shape, self.size = box, np.asarray(shape, dtype=np.int64), size
        self.owners = np.asarray(owner, dtype=np.int32)
        self._near = {}

    @property
    def edge(self):
        """Edges of a sub-domain, (3,) [length]: as the box is stretched, they follow."""
        return self.box.upright.span / self.shape

    def subdomain(self, position):
        """Number of the sub-domain of each point, (k,)."""
        numbers = np.empty(len(position), dtype=np.int64)
        box = self.box.upright
        there = np.ascontiguousarray(box.places(position))
        kernels.find_subdomains(there, box.low, self.shape / box.span, self.shape, numbers)
        return numbers

    def owner(self, position):
        """Rank that owns each point, (k,)."""
        if self.size == 1:
            return np.zeros(len(position), dtype=np.int32)
        return self.owners[self.subdomain(position)]

    def bounds(self, rank):
        """Low and high corner of the brick around a rank's sub-domains in the ``Upright`` box; of an empty one if it has none."""
        places = np.stack(np.unravel_index(np.flatnonzero(self.owners == rank), self.shape), axis=1)
        if not len(places):
            return self.box.low.copy(), self.box.low.copy()
        box, edge = self.box.upright, self.edge
        low, high = box.low + places.min(axis=0) * edge, box.low + (places.max(axis=0) + 1) * edge
        return low, np.minimum(high, box.high)

    def neighbours(self, rank, reach):
        """Ranks with a sub-domain within ``reach`` [length] of one of this rank's, ascending."""
        return self._surroundings(rank, reach)[0]

    def sends(self, rank, place, largest, reach):
        """Which grains may touch one of their size class in other ranks' sub-domains, or a smaller one, over the nearest periodic
        image.

        Args:
            rank: their owner.
            place: (n, 4) positions in the ``Upright`` box and radii [length].
            largest: (classes,) radius of the largest grain of each size class on any rank, ascending [length].
            reach: how far beyond touching others must see them [length].

        Returns:
            Rank -> rows, ascending; ranks ascending.
        """
        _, border, span = self._surroundings(rank, 2.0 * largest[-1] + reach)
        room, box = 64 + len(place) // 4, self.box.upright
        grid = (box.low, self.edge, self.shape / box.span, self.shape, np.array(box.periodic))
        while True:
            rows, ranks = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int32)
            found = kernels.find_sends(place, *grid, span, self.owners, border, rank, largest, reach, _ROUNDING, rows, ranks)
            if found <= room:
                break
            room = found
        rows, ranks = rows[:found], ranks[:found]
        return {int(other): rows[ranks == other] for other in np.unique(ranks)}

    def _surroundings(self, rank, reach):
        """Ranks within ``reach``, which of the rank's sub-domains have such neighbours, and how many sub-domains that is along
        each axis."""
        reach = reach * (1.0 + _ROUNDING)
        span = np.minimum(np.ceil(reach / self.edge).astype(np.int64), self.shape)
        key = rank, *span
        if key not in self._near:
            periodic, own = np.array(self.box.periodic), np.flatnonzero(self.owners == rank)
            places = np.stack(np.unravel_index(own, self.shape), axis=1)
            border, ranks = np.zeros(len(self.owners), dtype=np.uint8), set()
            for step in product(*(range(-s, s + 1) for s in span)):
                there = places + step
                inside = (periodic | ((there >= 0) & (there < self.shape))).all(axis=1)
                owners = self.owners[np.ravel_multi_index(tuple((there[inside] % self.shape).T), self.shape)]
                foreign = owners != rank
                border[own[inside][foreign]] = 1
                ranks.update(owners[foreign].tolist())
            self._near[key] = tuple(sorted(ranks)), border
        return *self._near[key], span


#: Sub-domains with grains in them for each rank: a rank's load is then known to about half a percent.
SUBDOMAINS = 128

#: Most sub-domains: all ranks know all of them.
MOST = 1 << 22


def shape_of(box, count, least=0.0):
    """About ``count`` sub-domains, as near to cubes as the box allows, of edges not below ``least`` [length].

    >>> from barchan.domain import Box
    >>> shape_of(Box((0, 0, 0), (4, 2, 1)), 64).tolist(), shape_of(Box((0, 0, 0), (4, 2, 1)), 64, 0.9).tolist()
    ([8, 4, 2], [4, 2, 1])
    """
    shape, left = np.ones(3, dtype=np.int64), float(count)
    with np.errstate(over="ignore", divide="ignore"):
        most = np.floor(box.span / least)
    rest = np.argsort(box.length[: box.dimension], kind="stable")
    while len(rest):
        axis, edge = rest[0], (np.prod(box.length[rest]) / left) ** (1.0 / len(rest))
        shape[axis] = max(1.0, min(np.round(box.length[axis] / edge), most[axis]))
        left, rest = max(left / shape[axis], 1.0), rest[1:]
    return shape


def even(box, size, bricks=None):
    """A topology to begin with, in which each rank gets as much of what grains will fill.

    Args:
        bricks: low and high corner of each part of the box that they will fill evenly; default: all of it.
    """
    wanted = SUBDOMAINS * size if size > 1 else 1
    count, bricks = wanted, [(box.low, box.high)] if bricks is None else bricks
    while True:
        shape = shape_of(box, count)
        volume = _volumes(box, shape, bricks)
        if np.count_nonzero(volume) >= min(wanted, volume.size) or count >= MOST:
            break
        count *= 2
    cost = np.rint(1e6 * volume / max(volume.max(), 1e-300)).astype(np.int64)
    return Topology(box, shape, bisection(cost, shape, box.span / shape, np.ones(size)), size)


def _volumes(box, shape, bricks):
    """How much of each sub-domain the bricks fill."""
    total = np.zeros(tuple(shape))
    for low, high in bricks:
        lengths = [np.ones(1)] * 3  # of an axis without extent
        for axis in range(box.dimension):
            faces = box.low[axis] + np.arange(shape[axis] + 1) * (box.length[axis] / shape[axis])
            lengths[axis] = np.clip(np.minimum(high[axis], faces[1:]) - np.maximum(low[axis], faces[:-1]), 0.0, None)
        total += np.einsum("i,j,k", *lengths)
    return total.ravel()
