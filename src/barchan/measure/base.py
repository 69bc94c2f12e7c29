"""What measures share: how results are declared, which grains flow, and their velocities at the full step."""

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError


class Result:
    """What a measure finds, as an attribute; read before ``compute``, it says so.

    Args:
        meaning: what it is, with its dimension.
    """

    def __init__(self, meaning):
        self.__doc__ = meaning

    def __set_name__(self, owner, name):
        self._name = name

    def __get__(self, measure, owner=None):
        if measure is None:
            return self
        raise RuntimeError(f"{type(measure).__name__}: call compute(sim) first; then {self._name} is there")


def number(what, value, positive=False):
    """A user's number [length].

    Raises:
        SceneError: it is not finite, or not positive where it must be.
    """
    given = numbers(what, value, "length")
    if given.ndim or not np.isfinite(given) or (positive and given <= 0.0):
        raise SceneError(f"{what} = {value!r} [length] must be a finite number{' > 0' if positive else ''}")
    return float(given)


def flowing_rows(sim):
    """Owned rows of the grains that are not frozen."""
    return np.flatnonzero(sim.grains.view("frozen") == 0)


def full_step(sim, rows):
    """Velocity and angular velocity at the full step n, (k, 3) each [length/time, 1/time].

    The state holds them at n-1/2; half a kick brings them to n: v + dt/2 F/m.
    """
    grains, half = sim.grains, 0.5 * sim.dt
    velocity = grains.view("velocity")[rows] + half * grains.view("force")[rows] * grains.view("inverse_mass")[rows, None]
    omega = grains.view("omega")[rows] + half * grains.view("torque")[rows] * grains.view("inverse_inertia")[rows, None]
    return velocity, omega


def squared(vectors):
    """Squared lengths of (k, 3) vectors, added in a fixed order."""
    x, y, z = vectors.T
    return x * x + y * y + z * z


def sphere_volume(radius):
    """Volumes of spheres [length^3]."""
    return 4.0 / 3.0 * np.pi * (radius * radius * radius)


def filled_volume(radius, dimension):
    """What grains fill of a box of so many dimensions: volumes [length^3], or in a plane areas [length^2]."""
    return sphere_volume(radius) if dimension == 3 else np.pi * (radius * radius)


def refuse_plane(sim, what):
    """Refuse a measure that has no meaning in two dimensions.

    Raises:
        SceneError: the box has two.
    """
    if sim.box.dimension == 2:
        raise SceneError(
            f"{what} measures in three dimensions only, and the box has two; coarse_grain and stress measure in both"
        )
