"""When something is due: every n steps, at one step, or as any function of the step says."""

from math import inf
from numbers import Integral

from barchan.errors import SceneError


def _whole(value):
    return isinstance(value, Integral) and not isinstance(value, bool)


def trigger(due, what):
    """``due``, if it can be asked.

    Raises:
        SceneError: it is no function of the step.
    """
    if not callable(due):
        raise SceneError(f"{what}: due = {due!r} must be a trigger, such as barchan.Every(1000), or any function of the step")
    return due


class Every:
    """Due at ``start``, ``start + period``, ...

    >>> [step for step in range(10) if Every(4, start=1)(step)]
    [1, 5, 9]
    """

    def __init__(self, period, start=0):
        for name, value, least in (("period", period, 1), ("start", start, 0)):
            if not _whole(value) or value < least:
                raise SceneError(f"Every: {name} = {value!r} [steps] must be a whole number of at least {least}")
        self.period, self.start = int(period), int(start)

    def __call__(self, step):
        """True if due at ``step``."""
        return step >= self.start and (step - self.start) % self.period == 0

    def after(self, step):
        """The first step after ``step`` at which it is due."""
        return max(self.start, step + self.period - (step - self.start) % self.period)


class At:
    """Due once at each of the given steps.

    >>> [step for step in range(10) if At(3, 7)(step)]
    [3, 7]
    """

    def __init__(self, *steps):
        wrong = [step for step in steps if not _whole(step)]
        if wrong:
            raise SceneError(f"At: step {wrong[0]!r} must be a whole number")
        self.steps = frozenset(int(step) for step in steps)

    def __call__(self, step):
        """True if due at ``step``."""
        return step in self.steps

    def after(self, step):
        """The first step after ``step`` at which it is due; infinite if there is none."""
        return min((due for due in self.steps if due > step), default=inf)
