"""The angle of a pile from the profile of its surface."""

from typing import NamedTuple

import numpy as np

from barchan.measure.sums import crossing

#: The part of the run-out through which the straight line is laid: neither the rounded top nor the thin foot.
FITTED = (0.2, 0.8)


class Line(NamedTuple):
    """A straight line through points: ``slope`` and its standard ``error`` [1], height at distance 0 ``origin`` [length]."""

    slope: float
    error: float
    origin: float

    @property
    def angle(self):
        """Angle by which it falls [deg]."""
        return float(np.degrees(np.arctan(-self.slope)))

    @property
    def angle_error(self):
        """Standard error of the angle [deg]."""
        return float(np.degrees(self.error / (1.0 + self.slope**2)))


class Pile(NamedTuple):
    """What a profile tells: ``height`` of its highest bin, ``run_out`` [length], and the ``line`` through its slope."""

    height: float
    run_out: float
    line: Line

    @property
    def plain_angle(self):
        """Angle of the straight line from the top to the foot [deg]."""
        return float(np.degrees(np.arctan2(self.height, self.run_out)))


def straight(x, y):
    """The straight ``Line`` through points by least squares; NaN of fewer than two, no error of fewer than three.

    Args:
        x, y: (k,) [length].
    """
    if len(x) < 2:
        return Line(np.nan, np.nan, np.nan)
    offset = x - x.mean()
    spread = (offset**2).sum()
    slope = (offset * y).sum() / spread
    origin = y.mean() - slope * x.mean()
    rest = ((y - origin - slope * x) ** 2).sum()
    error = np.sqrt(rest / (len(x) - 2) / spread) if len(x) > 2 else np.nan
    return Line(float(slope), float(error), float(origin))


def pile(distance, height, least):
    """What a profile tells.

    Args:
        distance, height: (bins,) [length].
        least: height of the surface at the foot, for which the run-out is taken [length].
    """
    run_out = foot(distance, height, least)
    return Pile(float(height.max()), run_out, straight(*on_slope(distance, height, run_out)))


def on_slope(distance, height, run_out):
    """The part of a profile through which the line is laid: distances and heights."""
    inside = (distance >= FITTED[0] * run_out) & (distance <= FITTED[1] * run_out)
    return distance[inside], height[inside]


def foot(distance, height, least):
    """Distance at which a surface falls below ``least`` on the way out from its highest place; 0.0 if it is nowhere as high, the
    last distance if it does not [length]."""
    top = int(np.argmax(height))
    below = np.flatnonzero(height[top:] < least)
    if not len(below):
        return float(distance[-1])
    if not below[0]:
        return 0.0
    first = top + int(below[0])
    part = crossing(height[first - 1], height[first], least)
    return float(distance[first - 1] + part * (distance[first] - distance[first - 1]))
