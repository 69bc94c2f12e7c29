"""Rows that travel between ranks: a mapping is defined once and carries any number of fields, any number of times.

Push arrays, send, pop them in the same order: one message per rank however many fields. While it travels, there is time to
compute. The mappings of the PPM library (Walther & Sbalzarini 2009, section 3) are this one with other definitions: global
(any rank may send to any), local (ranks within reach), ghost get, and ghost put, its ``reverse``.
"""

import numpy as np

from barchan.kernels import pack as kernels


class Mapping:
    """Who sends which rows to whom.

    Args:
        comm: communicator.
        sends: rank -> rows to send there, ranks ascending.
        receives: rank -> how many rows come from there, ranks ascending.
    """

    def __init__(self, comm, sends, receives):
        self.comm, self.sends, self.receives = comm, sends, receives
        self.rows = np.concatenate([np.zeros(0, dtype=np.int64), *sends.values()])
        self.n_received = sum(receives.values())
        self._room = {True: np.empty(0), False: np.empty(0)}
        self._pushed, self._popped, self._pending, self._received = [], [], None, None

    @classmethod
    def define(cls, comm, sends, partners=None):
        """A mapping of which each rank knows what it sends; all ranks must call this.

        Args:
            partners: ranks that may send here and be sent to, the same of each other; None: any may.

        Raises:
            ValueError: this rank has rows for one that is not among them.
        """
        counts = {rank: np.array([len(rows)], dtype=np.int64).view(np.uint8) for rank, rows in sends.items() if len(rows)}
        if partners is None:
            received = comm.exchange(counts)
        else:  # all of them tell, if only of nothing: one round of messages of known size
            stranger = next((rank for rank in counts if rank not in partners), None)
            if stranger is not None:
                raise ValueError(f"rank {comm.rank} has a message for rank {stranger}, which does not listen to it")
            nothing, received = np.zeros(8, dtype=np.uint8), {rank: np.empty(8, dtype=np.uint8) for rank in partners}
            comm.start({rank: counts.get(rank, nothing) for rank in partners}, received).finish()
        told = {source: int(received[source].view(np.int64)[0]) for source in sorted(received)}
        sends = {rank: sends[rank] for rank in sorted(counts)}
        return cls(comm, sends, {source: count for source, count in told.items() if count})

    def reverse(self):
        """The mapping that sends something back for each row received, in the order in which they were."""
        ends = np.cumsum([0, *self.receives.values()]).tolist()
        sends = {source: np.arange(begin, end) for source, begin, end in zip(self.receives, ends[:-1], ends[1:])}
        return Mapping(self.comm, sends, {rank: len(rows) for rank, rows in self.sends.items()})

    def narrowed(self, wanted):
        """The mapping of those rows alone that their receivers want. All ranks must call this.

        Args:
            wanted: (received,) bool, rows that this rank wants.
        """
        counts = [int(part.sum()) for part in np.split(wanted, np.cumsum(list(self.receives.values()))[:-1])]
        told = self.reverse().push(wanted.astype(np.uint8)).send().pop() != 0
        parts = np.split(told, np.cumsum([len(rows) for rows in self.sends.values()])[:-1])
        sends = {rank: rows[some] for (rank, rows), some in zip(self.sends.items(), parts) if some.any()}
        return Mapping(self.comm, sends, {source: count for source, count in zip(self.receives, counts) if count})

    def push(self, array):
        """Put the rows of an array that are to be sent into the messages; it may be changed once ``send`` was called."""
        self._pushed.append(array)
        return self

    def send(self):
        """Send what was pushed; ``pop`` waits for what the others sent. All ranks must call this."""
        columns = np.cumsum([0, *(_words(array) for array in self._pushed)]).tolist()
        sent, self._received = self._buffer(True, len(self.rows), columns[-1]), self._buffer(False, self.n_received, columns[-1])
        for array, begin in zip(self._pushed, columns):
            if array.dtype == np.float64 and array.ndim == 2:
                kernels.pack_rows(array, self.rows, begin, sent)
            else:
                _field(sent, begin, array)[...] = array[self.rows]
        self._popped, self._pushed = list(zip(self._pushed, columns)), []
        outgoing = _slices(sent, {rank: len(rows) for rank, rows in self.sends.items()})
        self._pending = self.comm.start(outgoing, _slices(self._received, self.receives))
        return self

    def pop(self):
        """The next field, as received: rows in ascending order of their senders; valid until the next ``send``."""
        if self._pending is not None:
            self._pending.finish()
            self._pending = None
        array, begin = self._popped.pop(0)
        return _field(self._received, begin, array)

    def _buffer(self, outgoing, rows, columns):
        if len(self._room[outgoing]) < rows * columns:
            self._room[outgoing] = np.empty(rows * columns)
        return self._room[outgoing][: rows * columns].reshape(rows, columns)


def _words(array):
    """Words of eight bytes that a row takes."""
    width = array.shape[1] if array.ndim == 2 else 1
    return -(-array.itemsize * width // 8)


def _field(buffer, begin, array):
    """The part of the words from column ``begin`` on that holds rows like those of ``array``."""
    first = begin * (8 // array.itemsize)
    seen = buffer.view(array.dtype)
    return seen[:, first] if array.ndim == 1 else seen[:, first : first + array.shape[1]]


def _slices(buffer, counts):
    ends = np.cumsum([0, *counts.values()]).tolist()
    return {rank: buffer[begin:end].reshape(-1).view(np.uint8) for rank, begin, end in zip(counts, ends[:-1], ends[1:])}


def by_rank(owner, but=None):
    """Rank -> rows that it owns, both ascending; without those of the rank ``but``.

    >>> by_rank(np.array([2, 0, 2]), but=0)
    {2: array([0, 2])}
    """
    rows = np.arange(len(owner)) if but is None else np.flatnonzero(owner != but)
    order = rows[np.argsort(owner[rows], kind="stable")]
    ranks, begins = np.unique(owner[order], return_index=True)
    return {int(rank): part for rank, part in zip(ranks, np.split(order, begins[1:]))}
