"""Ranks as processes of MPI: the only file that imports mpi4py."""

import ctypes
import os
import sys
from time import perf_counter, sleep
from typing import NamedTuple

import numpy as np

from barchan.errors import RankError, SceneError

#: How launchers tell a process that it is one of several: MPICH and Intel MPI, Open MPI, Slurm.
_LAUNCHED = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")

_CONTENTS, _ROWS = 1, 2  # tags of messages

#: Seconds that a rank with an error waits for the others to have one, too.
PATIENCE = 1.0


def launched_size():
    """How many processes the launcher says that it started; 1 if there was none."""
    return max((int(os.environ[name]) for name in _LAUNCHED if os.environ.get(name, "").isdigit()), default=1)


def mpi_world():
    """The communicator of all processes that were started together, or None where this one is alone.

    Raises:
        SceneError: a launcher started several, but they cannot find each other.
    """
    expected = launched_size()
    if expected == 1 and "mpi4py.MPI" not in sys.modules:
        return None
    try:
        from mpi4py import MPI
    except ImportError:
        raise SceneError(_alone(expected, "mpi4py is not installed. Install it: pip install 'barchan[mpi]'")) from None
    except RuntimeError as error:
        raise SceneError(_alone(expected, f"mpi4py finds no MPI library ({error}). pip install mpich brings one")) from None
    size = MPI.COMM_WORLD.size
    if size == 1 < expected:
        library = MPI.Get_library_version().splitlines()[0].strip()
        raise SceneError(
            _alone(expected, f"MPI sees {size}. Its library is {library}; start with the mpiexec that belongs to it")
        )
    return MpiRank(MPI) if size > 1 else None


def _alone(expected, reason):
    return f"a launcher started {expected} processes, which would all write the same files: {reason}"


class Calls(NamedTuple):
    """Addresses of MPI's own MPI_Startall, MPI_Waitall and MPI_Wtime, and bytes of a status: for compiled code."""

    start: int
    wait: int
    clock: int
    status: int


class Lasting:
    """Messages that are sent over and over, from and into the same places in memory.

    Attributes:
        handles: (n, bytes) the requests as MPI knows them, those that receive first.
    """

    def __init__(self, mpi, comm, outgoing, incoming, tag):
        self._requests = [comm.Recv_init(array, source=source, tag=tag) for source, array in incoming.items()]
        self._requests += [comm.Send_init(array, dest=rank, tag=tag) for rank, array in outgoing.items()]
        size = mpi._sizeof(mpi.Request)
        handles = b"".join(ctypes.string_at(mpi._addressof(request), size) for request in self._requests)
        self.handles = np.frombuffer(bytearray(handles), dtype=np.uint8).reshape(-1, size)

    def free(self):
        """They are sent no more."""
        for request in self._requests:
            request.Free()


class _Pending:
    def __init__(self, requests, wait):
        self._requests, self._wait = requests, wait

    def finish(self):
        """Wait until all has arrived and all that was sent may be changed."""
        self._wait(self._requests)


def _calls(mpi):
    """The addresses of MPI's functions, or None where the system does not tell."""
    try:
        library = ctypes.CDLL(mpi.__file__)  # and all that it is linked with
        names = "MPI_Startall", "MPI_Waitall", "MPI_Wtime"
        addresses = (ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in names)
        return Calls(*addresses, mpi._sizeof(mpi.Status))
    except (OSError, AttributeError):
        return None


class MpiRank:
    """One of several processes. Attributes: ``rank`` of ``size``; ``ranks_on_node``, of which it is number ``rank_on_node``;
    ``calls`` that compiled code may make, or None."""

    def __init__(self, mpi):
        self._mpi, self._comm, self._end = mpi, mpi.COMM_WORLD.Dup(), mpi.COMM_WORLD.Dup()
        self.rank, self.size = self._comm.rank, self._comm.size
        node = self._comm.Split_type(mpi.COMM_TYPE_SHARED)
        self.ranks_on_node, self.rank_on_node = node.size, node.rank
        self._hook, sys.excepthook = sys.excepthook, self._ended_by
        self._lines = mpi.COMM_WORLD.Dup()
        self._lines.Set_errhandler(mpi.ERRORS_ARE_FATAL)  # compiled code raises nothing
        self.calls = _calls(mpi)
        if self.maximum([float(self.calls is None)])[0]:
            self.calls = None

    def _ended_by(self, kind, error, trace):
        """What Python calls when an error ends the program."""
        self.end(error, lambda: self._hook(kind, error, trace))

    def end(self, error, tell):
        """An error ends this rank. If it ended all, one tells of it and this returns; otherwise no rank may wait for this one,
        and all are ended now.

        Args:
            tell: function that writes the message to ``sys.stderr``.
        """
        everybody, patience = self._end.Ibarrier(), perf_counter() + PATIENCE
        while not everybody.Test():
            if perf_counter() > patience:
                self._tell(f"barchan: rank {self.rank} of {self.size} failed\n", tell)
                self._comm.Abort(getattr(error, "exit_code", 1))
            sleep(0.01)
        texts = self._end.allgather((isinstance(error, RankError), str(error)))
        if min((is_quoted, rank) for rank, (is_quoted, _) in enumerate(texts))[1] == self.rank:
            alike = len(set(texts)) == 1  # bad input, a wish to stop: it is nobody's in particular
            self._tell("" if alike else f"barchan: rank {self.rank} of {self.size} failed\n", tell)

    @staticmethod
    def _tell(who, tell):
        sys.stderr = sys.__stderr__
        sys.stderr.write(who)
        tell()
        sys.stderr.flush()

    def sum(self, values):
        """Sum of an integer array over all ranks (integers only: floating-point sums depend on the order)."""
        total = np.array(values, dtype=np.int64)
        self._comm.Allreduce(self._mpi.IN_PLACE, total, self._mpi.SUM)
        return total

    def maximum(self, values):
        """Largest value over all ranks, element by element."""
        largest = np.array(values, dtype=np.float64)
        self._comm.Allreduce(self._mpi.IN_PLACE, largest, self._mpi.MAX)
        return largest

    def all_gather(self, item):
        """List of every rank's small Python object."""
        return self._comm.allgather(item)

    def from_first(self, item):
        """Rank 0's small Python object."""
        return self._comm.bcast(item)

    def before(self, values):
        """Sum of an integer array over all lower ranks."""
        total = np.zeros(len(values), dtype=np.int64)
        self._comm.Exscan(np.array(values, dtype=np.int64), total, self._mpi.SUM)
        return total if self.rank else np.zeros_like(total)

    def barrier(self):
        """Wait for all ranks."""
        self._comm.Barrier()

    def rest(self):
        """Wait for all ranks without keeping a core busy."""
        everybody = self._comm.Ibarrier()
        while not everybody.Test():
            sleep(0.005)

    def exchange(self, messages):
        """Send ``messages`` (rank -> array of bytes) and return what was received, rank -> array of bytes."""
        outgoing, incoming = np.zeros(self.size, dtype=np.int64), np.empty(self.size, dtype=np.int64)
        for rank, message in messages.items():
            outgoing[rank] = len(message)
        self._comm.Alltoall(outgoing, incoming)
        received = {int(source): np.empty(incoming[source], dtype=np.uint8) for source in np.flatnonzero(incoming)}
        self._start({rank: message for rank, message in messages.items() if len(message)}, received, _CONTENTS).finish()
        return received

    def lasting(self, outgoing, incoming, tag):
        """``Lasting`` messages, rank -> array; where ``calls`` are known."""
        return Lasting(self._mpi, self._lines, outgoing, incoming, tag)

    def start(self, outgoing, incoming):
        """Begin to send arrays of bytes and to receive into others, rank -> array; all sizes are known."""
        return self._start(outgoing, incoming, _ROWS)

    def _start(self, outgoing, incoming, tag):
        requests = [self._comm.Irecv(array, source=source, tag=tag) for source, array in incoming.items()]
        requests += [self._comm.Isend(array, dest=rank, tag=tag) for rank, array in outgoing.items()]
        return _Pending(requests, self._mpi.Request.Waitall)
