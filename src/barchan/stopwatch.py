"""Where the time of a run goes."""

from time import perf_counter


class Stopwatch:
    """Adds up seconds by name.

    >>> watch = Stopwatch()
    >>> watch.start(); watch.lap("forces"); watch.seconds["forces"] >= 0.0
    True
    """

    def __init__(self):
        self.seconds, self._since = {}, perf_counter()

    def start(self):
        """Begin to count."""
        self._since = perf_counter()

    def lap(self, name):
        """Book the time since the last lap, or the start, under ``name``."""
        now = perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._since
        self._since = now

    def move(self, seconds, name, other):
        """Book ``seconds`` under ``other`` that were booked under ``name``."""
        self.seconds[name] -= seconds
        self.seconds[other] = self.seconds.get(other, 0.0) + seconds
