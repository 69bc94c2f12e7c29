"""A flat wall without end."""

from math import sqrt

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.planes import measure_plane, near_plane
from barchan.walls.turning import turned
from barchan.walls.wall import PUSH, Direction, Wall, without_faces


class Plane(Wall):
    """The half space behind a plane.

    Args:
        point: any point of the plane [length]; it turns about this one.
        normal: direction from the wall towards the grains; any length.
        material: name of its material.
        velocity: of the wall [length/time]; constant until it is set anew.
        omega: angular velocity about ``point`` [1/time]; the normal turns with it.

    All can be set between runs and by actions; ``Wall`` tells what can be read.

    Raises:
        SceneError: a value is not finite, or the normal has no length.
    """

    __slots__ = ("_corners", "_half", "_normal", "_slide")

    kind, parts = "plane", ("point", "normal", "half", "velocity", "slide", "omega")
    normal, can_be_pushed = Direction("1"), True

    def __init__(self, point, normal, material=0, velocity=(0.0, 0.0, 0.0), omega=(0.0, 0.0, 0.0)):
        super().__init__(point, material, velocity, omega)
        self.normal, self._corners = normal, np.zeros((8, 3))
        self.settle()

    @property
    def is_steady(self):
        """True unless it turns."""
        return not self._omega.any()

    @property
    def speed(self):
        """Bound on how fast it approaches anything in the box [length/time]."""
        x, y, z = self._velocity.tolist()
        speed = sqrt(x * x + y * y + z * z)
        if self._omega.any():
            speed += float(np.sqrt((self._omega**2).sum()) * np.sqrt(((self._corners - self._point) ** 2).sum(axis=1)).max())
        return speed

    def check(self, box, name):
        """Refuse a plane that cuts a periodic direction or leans out of two dimensions, or turns so.

        Raises:
            SceneError: naming the axis.
        """
        super().check(box, name)
        for axis, why in without_faces(box):
            if self._normal[axis] != 0.0:
                raise SceneError(f"{name}: its normal {self._normal.tolist()} leans along {'xyz'[axis]}, where {why}")
            if np.cross(self._omega, self._normal)[axis] != 0.0:
                raise SceneError(f"{name}: it turns with omega = {self._omega.tolist()} towards {'xyz'[axis]}, where {why}")
        self._corners = np.stack(np.meshgrid(*zip(box.low, box.high), indexing="ij"), axis=-1).reshape(-1, 3)

    def settle(self):
        """Start from parameters that were set anew."""
        self._slide, self._half = self._velocity - (self._velocity @ self._normal) * self._normal, self._normal

    def push(self, speed):
        """Move towards the grains with ``speed`` from now on, and along itself as before."""
        self._velocity = self._slide + PUSH.checked(self, speed) * self._normal

    def move(self, dt):
        """Take the wall to the next step."""
        self._point = self._point + dt * self._velocity
        self._half = self._normal
        if self._omega.any():
            self._half, self._normal = (turned(self._normal, self._omega * time) for time in (0.5 * dt, dt))

    def move_to(self, point):
        """The same for a steady one, where it was computed elsewhere."""
        self._point = point.copy()

    @property
    def place(self):
        """Where it is, for ``travel``."""
        return self._point.copy(), self._normal

    def travel(self, then):
        """How far it has come since ``place`` was ``then``: along x, -x, y, -y, z, -z, and the largest [length]."""
        point, normal = then
        if normal is self._normal or (normal == self._normal).all():
            way = self._point - point
            return np.stack([way, -way], axis=1).ravel(), sqrt(float((way**2).sum()))
        change = (self._corners - self._point) @ self._normal - (self._corners - point) @ normal
        farthest = float(np.abs(change).max())
        return np.full(6, farthest), farthest

    def distance(self, position):
        """Distance of points (k, 3) from the wall [length], (k,): negative behind it."""
        away = (position - self._point) * self._normal
        return away[:, 0] + away[:, 1] + away[:, 2]  # in one order, however many points there are

    def candidates(self, grains, reach):
        """Owned rows that may touch the wall before the next rebuild, ascending."""
        found = np.empty(grains.n + 1, dtype=np.uint32)
        state = (grains.block("place"), grains.block("frozen"), self._point, self._normal)
        return found[: near_plane(*state, reach, found)]

    def measure(self, contacts, grains, dt, begin, end):
        """Fill the surface rows of its contacts ``begin`` to ``end``, for a step of ``dt``."""
        shape = (self._point, self._normal, self._half, self._velocity, self._omega)
        measure_plane(contacts.wall_grain, grains.block("place"), begin, end, *shape, contacts.surface)
