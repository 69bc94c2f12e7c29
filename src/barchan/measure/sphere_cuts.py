"""Volumes of spheres cut by planes, in closed form."""

import numpy as np

#: Parts of a unit sphere below this are rounding of the closed form.
_NOTHING = 1e-14


def cap_volume(b):
    """Volume of the unit sphere beyond the plane z = b.

    >>> float(cap_volume(0.0) / np.pi)
    0.6666666666666666
    """
    b = np.clip(b, -1.0, 1.0)
    return np.pi * (2.0 / 3.0 - b + b * b * b / 3.0)


def corner_volume(a, b):
    """Volume of the unit sphere beyond both of the planes x = a and z = b.

    The integral of circular segments x > a over z > b; with c = sqrt(1 - a^2 - b^2), half the chord in which the planes
    meet, or 0 when they meet outside, one form holds for all signs of a and b:
    2/3 (a b c + angle(c, a b)) - (a - a^3/3) angle(c, b) - (b - b^3/3) angle(c, a), angle = atan2.

    >>> round(float(corner_volume(0.0, 0.0) / np.pi), 15) == round(1 / 3, 15)
    True
    """
    a, b = np.clip(a, -1.0, 1.0), np.clip(b, -1.0, 1.0)
    c = np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0))
    return (
        2.0 / 3.0 * (a * b * c + np.arctan2(c, a * b))
        - (a - a * a * a / 3.0) * np.arctan2(c, b)
        - (b - b * b * b / 3.0) * np.arctan2(c, a)
    )


def bar_volume(a, b):
    """Volume of the unit sphere in a[0] < x < a[1], b[0] < z < b[1]; arrays (k,) of coordinates relative to the radius."""
    volume = cap_volume(b[0]) - cap_volume(b[1])
    cut = np.flatnonzero((a[0] > -1.0) | (a[1] < 1.0))
    (a0, a1), (b0, b1) = ((low[cut], high[cut]) for low, high in (a, b))
    volume[cut] = corner_volume(a0, b0) - corner_volume(a1, b0) - corner_volume(a0, b1) + corner_volume(a1, b1)
    return np.where(volume > _NOTHING, volume, 0.0)
