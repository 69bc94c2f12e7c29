"""Rotations of vectors, exact in length however large the angle: what a bond remembers turns with it."""

from barchan.kernels.compiler import helper


@helper
def carried(a, old, new):
    """``a`` turned by the smallest rotation that brings the unit vector ``old`` to the unit vector ``new``."""
    sx, sy, sz = old[0] + new[0], old[1] + new[1], old[2] + new[2]
    along = a[0] * old[0] + a[1] * old[1] + a[2] * old[2]
    part = (a[0] * sx + a[1] * sy + a[2] * sz) / (1.0 + old[0] * new[0] + old[1] * new[1] + old[2] * new[2])
    return (
        a[0] - part * sx + 2.0 * along * new[0],
        a[1] - part * sy + 2.0 * along * new[1],
        a[2] - part * sz + 2.0 * along * new[2],
    )


@helper
def spun(a, axis, angle):
    """``a`` turned about the unit vector ``axis`` by 2 atan(angle / 2): the angle itself, but for its third power."""
    t = 0.5 * angle
    bx, by, bz = axis[1] * a[2] - axis[2] * a[1], axis[2] * a[0] - axis[0] * a[2], axis[0] * a[1] - axis[1] * a[0]
    cx, cy, cz = axis[1] * bz - axis[2] * by, axis[2] * bx - axis[0] * bz, axis[0] * by - axis[1] * bx
    first = 2.0 * t / (1.0 + t * t)
    second = t * first
    return a[0] + first * bx + second * cx, a[1] + first * by + second * cy, a[2] + first * bz + second * cz
