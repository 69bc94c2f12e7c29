"""Gravity: any direction, constant or a function of time."""

from math import isfinite

from barchan.errors import SceneError


class Gravity:
    """Acceleration on all grains.

    Args:
        value: three numbers [length/time^2], or a function of time [time] that returns them.

    Raises:
        SceneError: what is given, or returned, is not three finite numbers.

    >>> Gravity(lambda t: (0.0, 0.0, -9.81 * t)).at(2.0)
    (0.0, 0.0, -19.62)
    """

    def __init__(self, value):
        self.value = value
        self.at(0.0)

    def at(self, time):
        """The acceleration at ``time``."""
        vector = self.value(time) if callable(self.value) else self.value
        try:
            numbers = tuple(float(component) for component in vector)
        except (TypeError, ValueError, OverflowError):
            numbers = ()
        if len(numbers) != 3 or not all(isfinite(number) for number in numbers):
            raise SceneError(f"gravity at t = {time:g}: {vector!r} must be three finite numbers [length/time^2]")
        return numbers
