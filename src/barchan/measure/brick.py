"""A brick of space in which a measure averages, and what of the sample lies in it."""

from itertools import product

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError


class Brick:
    """A brick with faces across the axes.

    Args:
        box: of the simulation.
        low, high: corners [length]; default: those of the box. The brick must lie in the box; in two dimensions it is a
            rectangle, with z = 0 in both corners.
        volume: of a room of another shape that holds all grains, such as ``Room.volume``, to take instead [length^3].

    Attributes:
        low, high: corners, (3,) each [length].
        volume: [length^3], in two dimensions the area [length^2].
        endless: (3,) bool, directions in which it is as long as a periodic box: there it has no faces.
        shifts: (images, 3) what takes a place to those of its images that may lie in the brick [length].

    Raises:
        SceneError: a corner is not three finite numbers, ``high`` does not exceed ``low``, or the brick leaves the box; or the
            volume is no number above 0, or stands beside corners.
    """

    def __init__(self, box, low=None, high=None, volume=None):
        if volume is not None and not (low is None and high is None):
            raise SceneError("volume stands for a room that holds all grains; give low and high, or the volume, but not both")
        whole = None if volume is None else numbers("volume", volume, "length^3")
        if whole is not None and not (whole.ndim == 0 and np.isfinite(whole) and whole > 0.0):
            raise SceneError(f"volume = {volume!r} [length^3] must be a finite number > 0")
        low = box.low if low is None else numbers("brick: low", low, "length")
        high = box.high if high is None else numbers("brick: high", high, "length")
        ascending = low.shape == high.shape == (3,) and (high > low)[: box.dimension].all()
        if not (ascending and np.isfinite([low, high]).all()):
            raise SceneError(
                f"brick: low = {low.tolist()} and high = {high.tolist()} [length] must be three finite numbers each, and high "
                f"must exceed low on {'every axis' if box.dimension == 3 else 'x and y'}"
            )
        beyond = 1e-9 * box.length  # a brick as long as the box may exceed it by rounding
        if (low < box.low - beyond).any() or (high > box.high + beyond).any():
            raise SceneError(
                f"brick: from {low.tolist()} to {high.tolist()} [length] leaves the box, from {box.low.tolist()} to "
                f"{box.high.tolist()}; make it smaller"
            )
        self.low, self.high = np.maximum(low, box.low), np.minimum(high, box.high)
        self.volume = float(np.prod((self.high - self.low)[: box.dimension]) if whole is None else whole)
        at_faces = self.low <= box.low, self.high >= box.high
        self.endless = at_faces[0] & at_faces[1] & box.periodic
        moves = [(-length, 0.0, length) if around else (0.0,) for length, around in zip(box.length, box.periodic & ~self.endless)]
        self.shifts = np.array(list(product(*moves)))
        # What lies beyond a face of the box that is not periodic counts in the bricks at that face.
        outermost = np.array(box.periodic) & ~self.endless
        self._open_low = np.where(at_faces[0] & ~outermost, -np.inf, self.low)
        self._open_high = np.where(at_faces[1] & ~outermost, np.inf, self.high)

    def holds(self, position):
        """Which of the points (k, 3) in the box lie in it; of bricks side by side, one."""
        return ((position >= self._open_low) & (position < self._open_high)).all(axis=1)

    def part_of(self, start, branch):
        """Which part of each straight line from ``start`` to ``start - branch``, (3, k), lies in it, 0 to 1, (k,)."""
        inside = np.zeros(start.shape[1])
        for shift in self.shifts:
            enter, leave = np.zeros_like(inside), np.ones_like(inside)
            for axis in range(3):
                first, last = self._between(axis, start[axis] + shift[axis], branch[axis])
                enter, leave = np.maximum(enter, first), np.minimum(leave, last)
            inside += np.maximum(leave - enter, 0.0)
        return inside

    def _between(self, axis, x, step):
        """Between which t the coordinate x - t step lies in the brick, smaller first; all or none if step is 0."""
        low, high = self._open_low[axis], self._open_high[axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = (x - high) / step, (x - low) / step
        first, last = np.minimum(one, other), np.maximum(one, other)
        within = (x >= low) & (x < high)
        return np.where(step == 0.0, np.where(within, -np.inf, np.inf), first), np.where(step == 0.0, np.inf, last)
