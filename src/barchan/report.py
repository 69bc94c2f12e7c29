"""What a person sees while a simulation runs and when it has ended."""

import io
import sys
import time
from datetime import datetime
from math import inf

from rich.console import Console
from rich.progress import Progress, TextColumn
from rich.table import Column

from barchan.parallel import world

#: Seconds between plain lines of progress: the first ones, and in long runs.
FIRST_LINES, LATER_LINES = 5.0, 60.0


class Journal:
    """Tells the user, and keeps in a log file what was told.

    Args:
        path: of the log; appended to. None: there is no log (yet).
    """

    def __init__(self, path=None, stream=None):
        self.console = Console(file=stream or sys.stderr, highlight=False, markup=False, soft_wrap=True)
        self._log, self._passing = None, False
        if path is not None:
            self.keep(path)

    def keep(self, path):
        """From now on, keep a log in the file ``path``; of several ranks the first does."""
        if world().rank == 0:
            self._log = open(path, "a")

    def say(self, text, passing=False):
        """A line for the user; on a terminal the next line takes the place of one that is ``passing``."""
        on_terminal = self.console.is_terminal
        if on_terminal and self._passing:
            self._put("\r\x1b[K")
        self._passing = passing
        self._put(text + ("" if on_terminal and passing else "\n"))
        self.note(text)

    def _put(self, text):
        """Write to the user; that nobody reads any more (a closed pipe, a full disk) must not end a run."""
        try:
            if self.console.is_terminal and not text.startswith("\r"):
                self.console.print(text, end="")  # knows of a progress line on the screen
            else:
                self.console.file.write(text)
                self.console.file.flush()
        except (OSError, ValueError, SystemExit):  # rich turns a closed pipe into an exit
            self.console = Console(file=io.StringIO())

    def compiling(self, text):
        """A line about a kernel that is being compiled, or the last of them."""
        self.say(text, passing="compiling" in text)

    def note(self, text):
        """A line for the log only."""
        if self._log is not None:
            try:
                self._log.write(f"{datetime.now().isoformat(timespec='seconds')}  {text}\n")
                self._log.flush()
            except OSError as error:
                self._log = None
                self.say(f"warning: the log ends here, it cannot be written: {error.strerror}")

    def close(self):
        """End the log."""
        if self._log is not None:
            self._log.close()
            self._log = None


class ProgressLine:
    """One line that tells phase, time left, step, simulated time and speed; plain lines where there is no terminal.

    What matters most stands first: a narrow terminal cuts the end.

    Used as a writer of a simulation.

    Args:
        phases: list of (name, step at which it ends), in order.
        first: step at which this run begins.
        journal: where plain lines go.
    """

    def __init__(self, phases, first, journal):
        self.phases, self.first, self.last, self.journal = phases, first, phases[-1][1], journal
        self.began = self.last_shown = self._last_line = time.monotonic()
        self.recent = (self.began, first)
        self._bar = self._task = None
        if journal.console.is_terminal:
            column = TextColumn("{task.fields[text]}", table_column=Column(no_wrap=True, overflow="ellipsis"))
            self._bar = Progress(column, console=journal.console, transient=True)
            self._task = self._bar.add_task("", text="")
            self._bar.start()

    def due(self, step):
        """Looked at every 16 steps; shown a few times a second on a terminal, rarely as plain lines."""
        if step % 16 and step != self.last:
            return False
        now = time.monotonic()
        pause = 0.2 if self._bar else min(max(FIRST_LINES, 0.05 * (now - self.began)), LATER_LINES)
        return step == self.last or now - self.last_shown > pause

    def next_due(self, step):
        """The next step after ``step`` at which to look."""
        return min(step + 16 - step % 16, self.last if self.last > step else inf)

    def write(self, sim):
        """Show the present state."""
        now, step = time.monotonic(), sim.step_number
        self.last_shown = now
        if sim.comm.rank:
            return
        count = sim.grains.n * sim.comm.size  # about: ranks look at their own clocks, so they cannot ask each other
        then, step_then = self.recent
        rate = (step - step_then) / max(now - then, 1e-9)
        if now - then > 10.0:
            self.recent = (now, step)
        phase = next((name for name, end in self.phases if step <= end), self.phases[-1][0])
        left = clock((self.last - step) / max(rate, 1e-9))
        text = (
            f"{phase}: {100 * step / max(self.last, 1):3.0f} %  {left} left  step {step:,}/{self.last:,}  t = {sim.time:.4f} s  "
            f"{rate:,.0f} steps/s  {rate * count:.2e} grain-steps/s"
        )
        if self._bar is None:
            self.journal.say(text)
        else:
            self._bar.update(self._task, text=text)
            if now - self._last_line > LATER_LINES:
                self._last_line = now
                self.journal.note(text)

    def close(self):
        """Take the line away."""
        if self._bar:
            self._bar.stop()


def clock(seconds):
    """Seconds as h:mm:ss or m:ss.

    >>> clock(3725), clock(65)
    ('1:02:05', '1:05')
    """
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def table(rows, indent="  "):
    """Rows of texts as aligned columns, one line each.

    >>> table([("a", "1 m"), ("long", "2 m")])
    ['  a     1 m', '  long  2 m']
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    return [indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
