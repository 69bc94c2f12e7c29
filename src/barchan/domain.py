"""The box: which part of space is simulated and which of its faces are periodic. Nobody else knows."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError


def numbers(what, value, dimension):
    """A user's numbers as an array of doubles.

    Raises:
        SceneError: ``value`` is no number, or no regular list of numbers.
    """
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"{what} = {value!r} [{dimension}] must be numbers") from None


class Frame(NamedTuple):
    """The box as the kernels see it, (3,) each; ``half`` is infinite where a direction is not periodic. ``rate``: by which the
    place of a grain in the box moves faster for each length along an axis, as the box is stretched [1/time]."""

    low: np.ndarray
    length: np.ndarray
    half: np.ndarray
    rate: np.ndarray


class Stretch(NamedTuple):
    """What becomes of places and velocities in a step in which the box is stretched, (3,) each: places relative to ``centre``
    grow by the factor ``ratio``, velocities by ``slower``."""

    centre: np.ndarray
    ratio: np.ndarray
    slower: np.ndarray


class Box:
    """An axis-aligned box, or in two dimensions a rectangle in the plane z = 0.

    Args:
        low, high: corners, three numbers each [length], or two, x and y: then all that happens in it happens in the plane.
        periodic: a boolean for each direction, by default none; a grain that leaves through a periodic face enters at the
            opposite one, a grain that leaves through any other face is lost, which is an error.

    Attributes:
        dimension: 3 or 2.
        low, high: corners, (3,) each [length]; in two dimensions z is 0 in both. As a ``Deformation`` stretches the box, they
            are those of now.
        first: low and high as they were given, (2, 3) [length].
        middle: edge lengths in the middle of the last step, (3,) [length].
        periodic: three booleans.

    Raises:
        SceneError: a corner is not finite, or ``high`` does not exceed ``low``.

    >>> box = Box((0, 0, 0), (2, 1, 1), periodic=(True, False, False))
    >>> box.length.tolist()
    [2.0, 1.0, 1.0]
    >>> box.difference(np.array([1.9, 0.5, 0.5]), np.array([0.1, 0.5, 0.5])).round(12).tolist()
    [-0.2, 0.0, 0.0]
    >>> plane = Box((0, 0), (2, 1))
    >>> plane.dimension, plane.low.tolist(), plane.high.tolist()
    (2, [0.0, 0.0, 0.0], [2.0, 1.0, 0.0])
    """

    def __init__(self, low, high, periodic=None):
        corners = numbers("box: low", low, "length"), numbers("box: high", high, "length")
        self.dimension = corners[0].size
        flags = [False] * self.dimension if periodic is None else [None]
        flags = list(periodic) if isinstance(periodic, (tuple, list, np.ndarray)) else flags
        if not all(isinstance(flag, (bool, np.bool_)) or flag in (0, 1) for flag in flags):
            raise SceneError(f"box: periodic = {periodic!r} must be three of True and False, or two in two dimensions")
        shapes = {corners[0].shape, corners[1].shape, (len(flags),)}
        if shapes not in ({(3,)}, {(2,)}):
            raise SceneError(
                f"box: low, high and periodic take three values each, or two in two dimensions; got {low!r}, {high!r}, "
                f"{periodic!r}"
            )
        with np.errstate(all="ignore"):
            length = corners[1] - corners[0]
        if not (np.isfinite(length).all() and (corners[1] > corners[0]).all()):
            raise SceneError(
                f"box: high [length] must be finite and exceed low on every axis; got low={low!r}, high={high!r}. In two "
                f"dimensions corners have two numbers"
            )
        across = [0.0] * (3 - self.dimension)
        self.first = np.array([np.append(corner, across) for corner in corners])
        self.low, self.high = self.first
        self.middle, self._rate = self.length, np.zeros(3)
        self.periodic = (*(bool(flag) for flag in flags), *(False for _ in across))

    @property
    def length(self):
        """Edge lengths, shape (3,) [length]; 0 across the plane of a two-dimensional box."""
        return self.high - self.low

    @property
    def span(self):
        """The same, but 1 across the plane: volumes are areas then."""
        return np.where(np.arange(3) < self.dimension, self.length, 1.0)

    @property
    def frame(self):
        """The box as plain numbers for kernels."""
        half = np.where(self.periodic, 0.5 * self.length, np.inf)
        return Frame(self.low, self.length, half, self._rate)

    @property
    def moves(self):
        """Whether it was stretched in the last step: then velocities still have to follow in the next."""
        return bool(self._rate.any())

    def stretch(self, rate, dt):
        """Stretch the box about its centre for a step; returns a ``Stretch``.

        A place x keeps its share of the box but for the velocity v of the grain, which is that relative to the box: x' = v + G x
        and v' = F/m - G v, as in Evans & Morriss, Phys. Rev. A 30, 1528 (1984). So in a box whose edges grow steadily free grains
        fly straight on in space. With L(n+1) = (1 + rate dt) L(n), G(n+1/2) is the change of L over its mean in the step, and
        v(n+1/2) / v(n-1/2) the means of L the other way round.

        Args:
            rate: relative growth of each edge (3,), 0 where the box is not periodic [1/time].
        """
        centre, before, length = 0.5 * (self.low + self.high), self.middle, self.length
        ratio = 1.0 + dt * rate
        moved = ratio != 1.0
        low, high = (centre + sign * 0.5 * ratio * length for sign in (-1.0, 1.0))
        self.low, self.high = np.where(moved, low, self.low), np.where(moved, high, self.high)
        self.middle = 0.5 * (length + self.length)
        self._rate = rate * length / np.where(self.middle > 0.0, self.middle, 1.0)
        return Stretch(centre, ratio, np.where(self.middle > 0.0, before / np.where(self.middle > 0.0, self.middle, 1.0), 1.0))

    def state(self):
        """What a checkpoint keeps of it, besides what it was at first."""
        return {"low": self.low.tolist(), "high": self.high.tolist(), "middle": self.middle.tolist(), "rate": self._rate.tolist()}

    def restore(self, state):
        """Take up what ``state`` returned."""
        self.low, self.high, self.middle, self._rate = (np.array(state[name]) for name in ("low", "high", "middle", "rate"))

    def difference(self, a, b):
        """Minimum image of ``a - b`` for points inside the box, shape (..., 3) [length]."""
        d = np.asarray(a, dtype=np.float64) - b
        length = np.where(self.periodic, self.length, 0.0)
        half = np.where(self.periodic, 0.5 * self.length, np.inf)
        return d - length * (d > half) + length * (d < -half)

    def wrap(self, position):
        """Positions folded into the box along periodic directions, and the images they came from."""
        position = np.array(position, dtype=np.float64)
        folds = self.periodic & np.isfinite(position)  # what is not finite is refused later, as it was given
        turns = np.floor((position - self.low) / self.span, where=folds, out=np.zeros_like(position))
        folded = np.where(folds, position - turns * self.length, position)
        at_top = folds & (folded >= self.high)
        folded = np.where(at_top | (folds & (folded < self.low)), self.low, folded)
        return folded, (turns + at_top).astype(np.int32)

    def outside(self, position):
        """True where a point lies outside the box along a direction that is not periodic (NaN counts as outside)."""
        inside = (position >= self.low) & (position <= self.high)
        return ~(inside | self.periodic).all(axis=-1) | ~np.isfinite(position).all(axis=-1)
