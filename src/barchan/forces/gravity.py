"""Gravity: any direction, constant or a function of time."""

from math import isfinite

from barchan.errors import SceneError


class Gravity:
    """Acceleration on all grains.

    Args:
        value: three numbers [length/time^2], or a function of time [time] that returns them.
        dimension: of the box; in two dimensions the third number must be 0.

    Raises:
        SceneError: what is given, or returned, is not three finite numbers, or leads out of the plane.

    >>> Gravity(lambda t: (0.0, 0.0, -9.81 * t)).at(2.0)
    (0.0, 0.0, -19.62)
    """

    def __init__(self, value, dimension=3):
        self.value, self._dimension = value, dimension
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
        if self._dimension == 2 and numbers[2] != 0.0:
            raise SceneError(
                f"gravity at t = {time:g}: {vector!r} [length/time^2] must have no z component: the box has two dimensions"
            )
        return numbers
