"""Copies of other ranks' grains near the border, so that every pair is seen by the owners of both.

Ghosts carry the coordinates of the grain itself, never shifted by a period: the minimum image is taken on differences, so
all ranks see the same numbers. There is one ghost per grain per rank.
"""

import numpy as np

from barchan.kernels.border import find_touching
from barchan.neighbors.rows import ContactRows
from barchan.parallel.mapping import Mapping, by_rank
from barchan.parallel.migrate import move_rows
from barchan.parallel.wire import Lines


class Ghosts:
    """The ghosts of a rank: ``build`` at a rebuild, ``update`` in every other step.

    Attributes:
        get: the ``Mapping`` from grains to their ghosts; its ``reverse`` is the ghost put.
        searched: how many ghosts the last search looked at, those in no pair among them.
        at_once: True waits for messages as soon as they are sent, to show what it gains to compute meanwhile.
    """

    def __init__(self, comm):
        self.comm = comm
        self.get = Mapping(comm, {}, {})
        self._travelling, self._lines, self.at_once, self.searched = (), Lines(comm), False, 0

    @property
    def wire(self):
        """What compiled code brings the ghosts up to date with, or None if it cannot."""
        return self._lines.wire(self.get)

    def owners(self):
        """Rank that owns each ghost (ghosts,)."""
        return ranks_of(self.get)

    def build(self, grains, topology, grids, start, reach, bonded):
        """Make the ghosts of grains that may touch one of this rank's. ``grains`` is modified; the mapping is kept.

        Args:
            grids, start: owned rows are in the order of the cells of these ``Grids``, of which ``start`` tells where they begin.
            reach: how far beyond touching grains must see each other [length].
            bonded: rank -> ascending rows that have to be there anyway, and as many ranks that have such for this one.
        """
        if self.comm.size == 1:
            return
        partners = sorted({*topology.neighbours(self.comm.rank, 2.0 * grids.largest[-1] + reach), *bonded})
        place = topology.box.upright.places(grains.block("place"))
        sends = topology.sends(self.comm.rank, place, grids.largest, reach)
        if len(grids.largest) > 1:
            sends = self._with_touching(sends, partners, place, grids, start, reach)
        sends = _united(sends, bonded)
        self.get = Mapping.define(self.comm, sends, partners)
        names = grains.ghost_blocks()
        self._send(grains, names)
        grains.append_rows({}, self.get.n_received, ghost=True)
        self.finish_update(grains)

    def _with_touching(self, sends, partners, place, grids, start, reach):
        """What is sent, and each grain that may touch one of a larger class elsewhere: known once those are. They are few."""
        n_small = start[grids.first[1]]
        larger = Mapping.define(self.comm, {rank: rows[rows >= n_small] for rank, rows in sends.items()}, partners)
        ghosts = np.ascontiguousarray(larger.push(place).send().pop())
        ranks = ranks_of(larger)
        room = 64 + len(place) // 8
        while True:
            rows, to = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int32)
            found = find_touching(ghosts, ranks, place, start, grids, reach, rows, to)
            if found <= room:
                break
            room = found
        return _united(sends, {rank: rows[some] for rank, some in by_rank(to[:found]).items()})

    def keep(self, grains, wanted):
        """Forget the ghosts but for those that are ``wanted`` (ghosts,), in which they keep their order; owners send those alone
        from now on. ``grains`` is modified. All ranks must call this."""
        self.searched = len(wanted)
        if self.comm.size > 1:
            self.get = self.get.narrowed(wanted)
            grains.keep_ghosts(wanted)

    def join_rows(self, rows):
        """``ContactRows`` of the grains, and then those of their ghosts: a contact may be known to the other grain alone. All
        ranks must call this."""
        if self.comm.size == 1:
            return rows
        counts = self.get.push(np.diff(rows.start)).send().pop()
        return ContactRows.join([rows, move_rows(self.get, rows, counts)])

    def update(self, grains, names):
        """Bring the named fields of the ghosts up to date, one message a rank. ``grains`` is modified."""
        self.start_update(grains, names)
        self.finish_update(grains)

    def start_update(self, grains, names):
        """Send what others need; ``finish_update`` waits for what they sent."""
        if self.comm.size > 1:
            self._send(grains, grains.blocks_of(names))
            if self.at_once:
                self.finish_update(grains)

    def finish_update(self, grains):
        """Write what has arrived into the ghosts. ``grains`` is modified."""
        for name in self._travelling:
            grains.block(name, ghosts=True)[grains.n :] = self.get.pop()
        self._travelling = ()

    def _send(self, grains, blocks):
        for name in blocks:
            self.get.push(grains.block(name))
        self.get.send()
        self._travelling = blocks


def ranks_of(mapping):
    """Rank from which each row comes (received,)."""
    ranks, counts = np.array([*mapping.receives.items()], dtype=np.int64).reshape(-1, 2).T
    return np.repeat(ranks.astype(np.int32), counts)


def _united(sends, others):
    """Rank -> rows in either of two such, ascending."""
    nothing = np.zeros(0, dtype=np.int64)
    return {r: np.union1d(sends.get(r, nothing), others.get(r, nothing)) for r in sorted({*sends, *others})}
