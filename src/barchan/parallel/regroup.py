"""Grains in the order of their ids, shared evenly among the ranks: the topology of files, beside that of space.

What is written in this order is the same file for any number of ranks and any decomposition.
"""

import numpy as np

from barchan.parallel.mapping import Mapping, by_rank
from barchan.parallel.migrate import move_rows


class ById:
    """Fields of all grains, by ascending id: each rank gets a range of ids; and the way back.

    Args:
        comm: communicator.
        ids: (n,) of this rank's grains.
        low, high: of all ranks' ids, the first that may be, and the one after the last.

    Attributes:
        ids: (m,) ids that this rank got, ascending.
        begin, total: how many grains lower ranks got, and all ranks.
    """

    def __init__(self, comm, ids, low, high):
        self.comm, self._there = comm, Mapping.define(comm, by_rank((ids - low) * comm.size // max(high - low, 1)))
        got = self._there.push(ids).send().pop()
        self._order = np.argsort(got, kind="stable")
        self.ids, self.begin = got[self._order], int(comm.before([len(got)])[0])
        self.total = int(comm.sum([len(got)])[0])

    def bring(self, field):
        """A field (n,) or (n, width) of this rank's grains as (m, ...) of the ids that it got."""
        return self._there.push(field).send().pop()[self._order]

    def bring_rows(self, rows):
        """``ContactRows`` of this rank's grains, as those of the ids that it got."""
        counts = self._there.push(np.diff(rows.start)).send().pop()
        return move_rows(self._there, rows, counts).take(self._order)

    def take_back(self, field):
        """A field (m, ...) of the ids that this rank got, as (n, ...) of its own grains."""
        unsorted = np.empty_like(field)
        unsorted[self._order] = field
        back = self._there.reverse().push(unsorted).send().pop()
        own = np.empty_like(back)
        own[self._there.rows] = back
        return own
