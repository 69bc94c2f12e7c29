"""Where the time of a run goes."""

from time import perf_counter


class Stopwatch:
    """Adds up seconds by name.

    Args:
        comm: of ranks that are to wait for each other at the end of each lap, which is booked as "waiting"; None: they are not.

    Attributes to set:
        by_phase: True times each phase of each step, also where compiled code would take many steps at once.

    >>> watch = Stopwatch()
    >>> watch.start(); watch.lap("forces"); watch.seconds["forces"] >= 0.0
    True
    """

    def __init__(self, comm=None):
        self.seconds, self.by_phase, self._since, self._comm = {}, False, perf_counter(), comm

    def start(self):
        """Begin to count."""
        self._since = perf_counter()

    def lap(self, name):
        """Book the time since the last lap, or the start, under ``name``."""
        self._book(name)
        if self._comm is not None:
            self._comm.barrier()
            self._book("waiting")

    def _book(self, name):
        now = perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._since
        self._since = now

    def move(self, seconds, name, other):
        """Book ``seconds`` under ``other`` that were booked under ``name``."""
        self.seconds[name] -= seconds
        self.seconds[other] = self.seconds.get(other, 0.0) + seconds
