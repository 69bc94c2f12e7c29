"""Rotation of unit vectors."""

from math import cos, sin, sqrt

import numpy as np


def turned(vector, rotation):
    """A unit vector turned by a rotation vector (Rodrigues' formula), of length 1 again."""
    angle = sqrt(float(rotation @ rotation))
    if angle == 0.0:
        return vector
    axis = rotation / angle
    there = cos(angle) * vector + sin(angle) * np.cross(axis, vector) + (1.0 - cos(angle)) * (axis @ vector) * axis
    return there / sqrt(float(there @ there))
