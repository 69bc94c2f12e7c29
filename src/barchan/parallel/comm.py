"""Who the other ranks are and how to talk to them: the few verbs that everything in ``parallel`` is written with.

``Serial`` is one rank alone. ``VirtualRank`` is one of several ranks that live as threads of one process and take turns:
only the one that holds the baton computes, and it passes the baton on whenever it has to wait for the others. ``MpiRank``
(``mpi.py``) is one of several processes. The same simulation runs on any of them, unchanged.
"""

import threading
from functools import lru_cache
from time import process_time

import numpy as np

from barchan.errors import RankError, SceneError
from barchan.parallel.mpi import mpi_world
from barchan.words import shown

_local = threading.local()


class Serial:
    """One rank alone."""

    rank, size, ranks_on_node, rank_on_node = 0, 1, 1, 0

    def sum(self, values):
        """Sum of an integer array over all ranks (integers only: floating-point sums depend on the order)."""
        return np.array(values, dtype=np.int64)

    def maximum(self, values):
        """Largest value over all ranks, element by element."""
        return np.array(values, dtype=np.float64)

    def all_gather(self, item):
        """List of every rank's small Python object."""
        return [item]

    def from_first(self, item):
        """Rank 0's small Python object."""
        return item

    def before(self, values):
        """Sum of an integer array over all lower ranks."""
        return np.zeros(len(values), dtype=np.int64)

    def exchange(self, messages):
        """Send ``messages`` (rank -> array of bytes) and return what was received, rank -> array of bytes."""
        return dict(messages)

    def start(self, outgoing, incoming):
        """Begin to send arrays of bytes and to receive into others, rank -> array, whose sizes are those that will come. What is
        returned can ``finish``: wait until all has arrived, and all that was sent may be changed."""
        return _Copying(lambda: dict(outgoing), incoming)

    def barrier(self):
        """Wait for all ranks."""

    def rest(self):
        """Wait for all ranks without keeping a core busy."""

    def end(self, error, tell):
        """An error ends this rank, and with it all: ``tell()`` writes the message."""
        tell()


class _Copying:
    """Messages within one process."""

    def __init__(self, received, incoming):
        self._received, self._incoming = received, incoming

    def finish(self):
        """Wait for all ranks, and take what they sent."""
        for source, message in self._received().items():
            self._incoming[source][...] = message


class _World:
    def __init__(self, size):
        self.size, self.baton, self.meeting = size, threading.Lock(), threading.Barrier(size)
        self.board, self.failure = [None] * size, None


class VirtualRank:
    """One of several ranks in this process; made by ``virtual_ranks``.

    Attributes:
        computed: the processor's seconds while it held the baton, up to the last time that it waited for the others: for so long
            it would have computed on a core of its own.
    """

    ranks_on_node, rank_on_node, calls = 1, 0, None  # they take turns, in Python

    def __init__(self, world, rank):
        self._world, self.rank, self.size = world, rank, world.size
        self.computed, self._since = 0.0, process_time()

    def _meet(self):
        self.computed += process_time() - self._since
        self._world.baton.release()
        try:
            self._world.meeting.wait()
        except threading.BrokenBarrierError:
            raise RankError(f"stopped because {self._world.failure}") from None
        finally:
            self._world.baton.acquire()
            self._since = process_time()

    def all_gather(self, item):
        """List of every rank's small Python object."""
        self._world.board[self.rank] = item
        self._meet()
        everything = list(self._world.board)
        self._meet()
        return everything

    def sum(self, values):
        """Sum of an integer array over all ranks."""
        return np.sum(self.all_gather(np.array(values, dtype=np.int64)), axis=0)

    def maximum(self, values):
        """Largest value over all ranks, element by element."""
        return np.max(self.all_gather(np.array(values, dtype=np.float64)), axis=0)

    def from_first(self, item):
        """Rank 0's small Python object."""
        return self.all_gather(item)[0]

    def before(self, values):
        """Sum of an integer array over all lower ranks."""
        return np.sum([np.zeros(len(values)), *self.all_gather(np.array(values))[: self.rank]], axis=0, dtype=np.int64)

    def start(self, outgoing, incoming):
        """Begin to send arrays of bytes and to receive into others; see ``Serial``."""
        return _Copying(lambda: self.exchange(outgoing), incoming)

    def exchange(self, messages):
        """Send ``messages`` (rank -> array of bytes) and return what was received; see ``Serial``."""
        sent = self.all_gather({rank: message.copy() for rank, message in messages.items()})
        return {source: boxes[self.rank].copy() for source, boxes in enumerate(sent) if self.rank in boxes}

    def barrier(self):
        """Wait for all ranks."""
        self._meet()

    rest = barrier


def world():
    """The communicator of this program: the virtual rank that runs it, the processes that a launcher started together, or one
    rank alone.

    Raises:
        SceneError: several processes were started, but they cannot find each other.
    """
    return getattr(_local, "comm", None) or _mpi_world() or Serial()


_mpi_world = lru_cache(maxsize=1)(mpi_world)


def virtual_ranks(size, program, *args):
    """Run ``program(*args)`` on ``size`` virtual ranks of this process and return their results by rank.

    Args:
        size: number of ranks.
        program: function; within it ``world()`` is the rank that runs it.
        args: its arguments, the same for all ranks.

    Raises:
        SceneError: ``size`` is no whole number >= 1.
        The error of the first rank that failed.
    """
    if not isinstance(size, (int, np.integer)) or isinstance(size, bool) or size < 1:
        raise SceneError(f"virtual_ranks: size = {shown(size)} must be a whole number >= 1")
    shared = _World(size)
    results, errors = [None] * size, []

    def live(rank):
        with shared.baton:
            _local.comm = VirtualRank(shared, rank)
            try:
                results[rank] = program(*args)
            except RankError as error:
                errors.append((1, rank, error))
            except BaseException as error:  # handed to the caller below, whatever it is
                errors.append((0, rank, error))
                shared.failure = shared.failure or f"rank {rank} failed: {error}"
                shared.meeting.abort()

    threads = [threading.Thread(target=live, args=(rank,), daemon=True) for rank in range(size)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise min(errors, key=lambda entry: entry[:2])[2]
    return results
