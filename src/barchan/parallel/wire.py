"""Lays the lines on which compiled code sends: see ``kernels.wire``."""

import numpy as np

from barchan.kernels.wire import GHOST, NUMBERS, Wire, unconnected


class Lines:
    """The lines of one rank: those to all others once, those of the ghosts anew after each rebuild."""

    def __init__(self, comm):
        self._comm, self._rounds, self._of, self._requests, self._wire = comm, None, None, None, unconnected()

    def wire(self, get):
        """A ``Wire`` for the ghosts of the mapping ``get``; None where ranks can only be reached from Python."""
        if self._comm.size == 1 or self._comm.calls is None:
            return self._wire if self._comm.size == 1 else None
        if self._of is not get:
            self._connect(get)
        return self._wire

    def _connect(self, get):
        comm = self._comm
        if self._rounds is None:
            self._lay_rounds()
        if self._requests is not None:
            self._requests.free()
        sent, received = np.empty((len(get.rows), GHOST)), np.empty((get.n_received, GHOST))
        self._requests = comm.lasting(_parts(sent, get.sends), _parts(received, get.receives), tag=0)
        requests = self._requests.handles
        statuses = np.empty(max(len(requests), 2) * comm.calls.status, dtype=np.uint8)
        told, heard, rounds = self._rounds
        handles = np.stack([messages.handles for messages in rounds])
        addresses = (np.uint64(address) for address in (comm.calls.start, comm.calls.wait, comm.calls.clock))
        lines = (requests, get.rows, sent, received, handles, told, heard, statuses)
        self._wire, self._of = Wire(*addresses, *lines, np.zeros(NUMBERS), np.zeros(5)), get

    def _lay_rounds(self):
        rank, size = self._comm.rank, self._comm.size
        count = (size - 1).bit_length()
        told, heard = np.zeros((2, count, NUMBERS))
        rounds = [
            self._comm.lasting({(rank + (1 << k)) % size: told[k]}, {(rank - (1 << k)) % size: heard[k]}, tag=1 + k)
            for k in range(count)
        ]
        self._rounds = told, heard, rounds


def _parts(rows, of):
    """Rank -> its part of the rows, one after another."""
    counts = [part if isinstance(part, int) else len(part) for part in of.values()]
    ends = np.cumsum([0, *counts]).tolist()
    return {rank: rows[begin:end] for rank, begin, end in zip(of, ends[:-1], ends[1:])}
