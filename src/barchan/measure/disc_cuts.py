"""Areas of discs cut by lines, in closed form."""

import numpy as np


def segment_area(b):
    """Area of the unit disc beyond the line y = b.

    >>> float(segment_area(0.0) / np.pi)
    0.5
    """
    b = np.clip(b, -1.0, 1.0)
    return np.arccos(b) - b * np.sqrt(1.0 - b * b)


def corner_area(a, b):
    """Area of the unit disc beyond both of the lines x = a and y = b.

    For a, b >= 0 the sector between the two points where the lines leave the disc, less two triangles; a line on the other side
    of the centre leaves the segment of the other less the mirror image.

    >>> round(float(corner_area(0.0, 0.0) / np.pi), 15)
    0.25
    """
    a, b = np.clip(a, -1.0, 1.0), np.clip(b, -1.0, 1.0)
    area = _quadrant_corner(np.abs(a), np.abs(b))
    area = np.where(a < 0.0, segment_area(np.abs(b)) - area, area)
    return np.where(b < 0.0, segment_area(a) - area, area)


def _quadrant_corner(a, b):
    """``corner_area`` for a, b >= 0: the corner lies outside, or both lines meet inside."""
    up, right = np.sqrt(1.0 - a * a), np.sqrt(1.0 - b * b)  # where they leave the disc: (a, up) and (right, b)
    sector = 0.5 * (np.arctan2(up, a) - np.arctan2(b, right))
    return np.where(a * a + b * b < 1.0, sector - 0.5 * (a * (up - b) + b * (right - a)), 0.0)


def rectangle_area(low, high):
    """Area of the unit disc between two corners, (2, k) each, of coordinates relative to the radius, (k,)."""
    (a0, b0), (a1, b1) = low, high
    area = corner_area(a0, b0) - corner_area(a1, b0) - corner_area(a0, b1) + corner_area(a1, b1)
    return np.maximum(area, 0.0)
