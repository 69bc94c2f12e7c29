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


def corner_of_three(a, b, c):
    """Volume of the unit sphere beyond all of the planes x = a, y = b and z = c.

    Where a, b, c >= 0, a third of the solid angle of the spherical triangle (Gauss and Bonnet) less the cones over the three flat
    faces; a plane on the other side of the centre leaves what lies beyond the two others less the mirror image.

    >>> round(float(corner_of_three(0.0, 0.0, 0.0) / np.pi), 15) == round(1 / 6, 15)
    True
    """
    a, b, c = (np.clip(x, -1.0, 1.0) for x in (a, b, c))
    volume = _octant_corner(np.abs(a), np.abs(b), np.abs(c))
    volume = np.where(a < 0.0, corner_volume(np.abs(b), np.abs(c)) - volume, volume)
    volume = np.where(b < 0.0, corner_volume(a, np.abs(c)) - volume, volume)
    return np.where(c < 0.0, corner_volume(a, b) - volume, volume)


def _octant_corner(a, b, c):
    """``corner_of_three`` for a, b, c >= 0: the corner lies outside, or all three planes meet inside."""
    ab, bc, ca = (np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0)) for x, y in ((a, b), (b, c), (c, a)))
    volume = 2.0 * np.pi - np.arctan2(ab, -a * b) - np.arctan2(bc, -b * c) - np.arctan2(ca, -c * a)
    for x, y, z, xy, zx in ((a, b, c, ab, ca), (b, c, a, bc, ab), (c, a, b, ca, bc)):
        arc = np.arctan2(xy, y) - np.arctan2(z, zx)  # of the circle in which the plane of x cuts the sphere
        face = 0.5 * ((1.0 - x * x) * arc - y * (xy - z) - z * (zx - y))
        volume = volume - x * (arc + face)
    return np.where(a * a + b * b + c * c < 1.0, volume / 3.0, 0.0)


def brick_volume(low, high):
    """Volume of the unit sphere between two corners, (3, k) each, of coordinates relative to the radius, (k,)."""
    volume = np.zeros(low.shape[1])
    for corner in np.ndindex(2, 2, 2):
        faces = [(low, high)[side][axis] for axis, side in enumerate(corner)]
        volume += (-1.0) ** sum(corner) * corner_of_three(*faces)
    return np.where(volume > _NOTHING, volume, 0.0)
