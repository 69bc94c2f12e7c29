"""When something is due: every n steps, at one step, or as any function of the step says."""

from barchan.errors import SceneError


class Every:
    """Due at ``start``, ``start + period``, ...

    >>> [step for step in range(10) if Every(4, start=1)(step)]
    [1, 5, 9]
    """

    def __init__(self, period, start=0):
        if int(period) < 1:
            raise SceneError(f"Every: period = {period!r} [steps] must be at least 1")
        self.period, self.start = int(period), int(start)

    def __call__(self, step):
        """True if due at ``step``."""
        return step >= self.start and (step - self.start) % self.period == 0


class At:
    """Due once at each of the given steps.

    >>> [step for step in range(10) if At(3, 7)(step)]
    [3, 7]
    """

    def __init__(self, *steps):
        self.steps = frozenset(int(step) for step in steps)

    def __call__(self, step):
        """True if due at ``step``."""
        return step in self.steps
