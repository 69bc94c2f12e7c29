"""Copies of other ranks' grains near the border, so that every pair is seen by the owners of both.

Ghosts carry the coordinates of the grain itself, never shifted by a period: the minimum image is taken on differences, so
all ranks see the same numbers. There is one ghost per grain per rank.
"""

import numpy as np

from barchan.parallel.message import Reader, pack


class Ghosts:
    """The ghosts of a rank: ``build`` at a rebuild, ``update`` in every other step."""

    def __init__(self, comm, topology):
        self.comm, self.topology = comm, topology
        self.sends, self.receives = {}, {}

    def build(self, grains, reach):
        """Make the ghosts of grains that come within ``radius + reach`` of this rank's part of space. ``grains`` is
        modified; the lists of who is sent where are kept for ``update``."""
        if self.comm.size == 1:
            return
        radius = grains.view("radius")
        widest = float(radius.max()) if grains.n else 0.0
        widest = float(self.comm.maximum([widest])[0])
        self.sends, messages = {}, {}
        for rank in self.topology.neighbours(self.comm.rank, widest + reach):
            within = self.topology.distance(grains.view("position"), rank) <= (radius + reach) * (1.0 + 1e-9)
            chosen = np.flatnonzero(within)
            if len(chosen):
                self.sends[rank] = chosen
                messages[rank] = self._pack(grains, chosen, grains.ghost_blocks())
        received = self.comm.exchange(messages)
        self.receives = {}
        for source in sorted(received):
            count = int(Reader(received[source]).take(np.int64, 1)[0])
            begin = grains.n + grains.n_ghost
            grains.append_rows({}, count, ghost=True)
            self.receives[source] = (begin, count)
        self._unpack(grains, received, grains.ghost_blocks())

    def update(self, grains, names):
        """Bring the named fields of the ghosts up to date, one message a rank. ``grains`` is modified."""
        if self.comm.size == 1:
            return
        blocks = grains.blocks_of(names)
        self._unpack(grains, self.comm.exchange({r: self._pack(grains, rows, blocks) for r, rows in self.sends.items()}), blocks)

    @staticmethod
    def _pack(grains, rows, blocks):
        return pack([np.array([len(rows)]), *(grains.block(name)[rows] for name in blocks)])

    def _unpack(self, grains, received, blocks):
        for source, message in received.items():
            reader = Reader(message)
            begin, count = self.receives[source]
            reader.take(np.int64, 1)
            for name in blocks:
                target = grains.block(name, ghosts=True)[begin : begin + count]
                target[...] = reader.take(target.dtype, target.shape)
