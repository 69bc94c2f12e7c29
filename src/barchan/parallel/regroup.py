"""Grains in the order of their ids, shared evenly among the ranks: the topology of files, beside that of space.

What is written in this order is the same file for any number of ranks and any decomposition.
"""

import numpy as np

from barchan.neighbors.rows import ContactRows
from barchan.parallel.mapping import Mapping, by_rank
from barchan.parallel.migrate import move_rows


class ById:
    """Fields of all grains, by ascending id: each rank gets a range of ids; and the way back.

    Args:
        comm: communicator.
        ids: (n,) of this rank's grains.
        next_id: above all ids.

    Attributes:
        ids: (m,) ids that this rank got, ascending.
        begin, total: how many grains lower ranks got, and all ranks.
    """

    def __init__(self, comm, ids, next_id):
        self.comm, self._there = comm, Mapping.define(comm, by_rank(ids * comm.size // max(next_id, 1)))
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


def by_smaller_id(ids, rows):
    """Rows of the grains ``ids`` without those of pairs of which the other grain has the smaller id."""
    owner = np.repeat(np.arange(len(ids)), np.diff(rows.start))
    kept = (rows.keys < 0) | (rows.keys > ids[owner])
    counts = np.bincount(owner[kept], minlength=len(ids))
    return ContactRows(np.concatenate([[0], np.cumsum(counts)]), rows.keys[kept], rows.values[kept])


def by_both_ids(comm, ids, rows):
    """Rows with those of pairs for the other grain, too.

    Args:
        ids: ascending, and above those of all lower ranks.
        rows: ``ContactRows`` of these grains, by the smaller id of a pair.
    """
    firsts = comm.all_gather(int(ids[0]) if len(ids) else None)
    known = np.array([first for first in firsts if first is not None], dtype=np.int64)
    holders = np.array([rank for rank, first in enumerate(firsts) if first is not None], dtype=np.int64)
    owner, pairs = ids[np.repeat(np.arange(len(ids)), np.diff(rows.start))], np.flatnonzero(rows.keys >= 0)
    there = holders[np.searchsorted(known, rows.keys[pairs], side="right") - 1] if len(pairs) else pairs
    travel = Mapping.define(comm, {rank: pairs[some] for rank, some in by_rank(there).items()})
    travel.push(rows.keys).push(owner).push(rows.values).send()
    grains, keys, values = (np.concatenate([a, travel.pop()]) for a in (owner, rows.keys, rows.values))
    place = np.minimum(np.searchsorted(ids, grains), max(len(ids) - 1, 0))
    there = ids[place] == grains if len(ids) else np.zeros(len(grains), dtype=bool)
    order = np.flatnonzero(there)[np.lexsort((keys[there], place[there]))]
    counts = np.bincount(place[order], minlength=len(ids))
    return ContactRows(np.concatenate([[0], np.cumsum(counts)]), keys[order], values[order])
