"""Vectors of three numbers as tuples: the vocabulary in which laws are written.

Plain functions. ``kernels/generate.py`` copies those that a law uses beside the law and compiles them together; the
tuples dissolve into registers (measured: the same machine code as hand-written scalars).
"""

from math import sqrt


def add(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def sub(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(s, a):
    """s a, for a number s."""
    return s * a[0], s * a[1], s * a[2]


def dot(a, b):
    """Scalar product.

    >>> dot((1.0, 2.0, 3.0), (1.0, 0.0, -1.0))
    -2.0
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Vector product.

    >>> cross((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    (0.0, 0.0, 1.0)
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def norm(a):
    """Length of a vector."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def project(a, normal):
    """The part of ``a`` in the plane of the unit vector ``normal``."""
    along = a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]
    return a[0] - along * normal[0], a[1] - along * normal[1], a[2] - along * normal[2]


def turn(a, normal):
    """``a`` laid onto the plane of the unit vector ``normal`` with its length kept.

    >>> turn((3.0, 0.0, 4.0), (0.0, 0.0, 1.0))
    (5.0, 0.0, 0.0)
    """
    along = a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]
    x, y, z = a[0] - along * normal[0], a[1] - along * normal[1], a[2] - along * normal[2]
    before = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    after = x * x + y * y + z * z
    stretch = sqrt(before / after) if after > 0.0 else 0.0
    return stretch * x, stretch * y, stretch * z
