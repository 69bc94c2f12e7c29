"""What a person sees while a simulation runs and when it has ended."""

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn


class ProgressLine:
    """One line that tells phase, step, simulated time, speed and time left; plain lines where there is no terminal.

    Used as a writer of a simulation: it is due at every ``stride``-th step and keeps the stride near twice a second.
    """

    def __init__(self, phase, steps, stream=None):
        self.phase, self.steps, self.done = phase, steps, 0
        self.console = Console(file=stream or sys.stderr)
        self.began = self.last_shown = time.monotonic()
        self._bar = self._task = None
        if self.console.is_terminal:
            columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[text]}"))
            self._bar = Progress(*columns, console=self.console, transient=False)
            self._task = self._bar.add_task(phase, total=steps, text="")
            self._bar.start()

    def due(self, step):
        """Every step is counted; few are shown."""
        self.done += 1
        interval = 0.2 if self._bar else 5.0
        return self.done == self.steps or (self.done % 16 == 0 and time.monotonic() - self.last_shown > interval)

    def write(self, sim):
        """Show the present state."""
        now = time.monotonic()
        self.last_shown = now
        if sim.comm.rank:
            return
        rate = self.done / max(now - self.began, 1e-9)
        left = (self.steps - self.done) / rate
        text = (
            f"step {sim.step_number:,}  t = {sim.time:.4g}  {rate:,.0f} steps/s  {rate * sim.grains.n:.3g} grain-steps/s  "
            f"{_clock(left)} left"
        )
        if self._bar:
            self._bar.update(self._task, completed=self.done, text=text)
        else:
            self.console.print(f"{self.phase}: {100 * self.done / self.steps:3.0f} %  {text}", soft_wrap=True, highlight=False)

    def close(self):
        """Leave the line as it is."""
        if self._bar:
            self._bar.stop()


def _clock(seconds):
    """Seconds as h:mm:ss or m:ss.

    >>> _clock(3725), _clock(65)
    ('1:02:05', '1:05')
    """
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def summary(sim):
    """Lines that end a run: what was computed, and how the neighbour list fared."""
    watch = sim.staleness
    mean = watch.total / watch.rebuilds if watch.rebuilds else float("nan")
    bound = f"{watch.bound_13:.1f}" if watch.bound_13 < float("inf") else "no motion"
    return [
        f"step {sim.step_number:,}, t = {sim.time:.6g}, {sim.grains.n:,} grains, {sim.touching:,} contacts",
        f"neighbour list: {watch.rebuilds} rebuilds, every {mean:.1f} steps on average, shortest {watch.shortest:.0f}; "
        f"equation (13) allows {bound} steps at the largest speed seen",
        f"contacts above 5 % overlap: {sim.large_overlaps:,} (counted each step)",
    ]
