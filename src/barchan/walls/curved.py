"""Round walls: cylinders without end, spheres, and shells of cones with two rims."""

from math import sqrt

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.curved import distances_cone, distances_round, measure_cone, measure_round, near_cone, near_round
from barchan.walls.wall import PUSH, Direction, Number, Wall, without_faces
from barchan.words import shown


class _Curved(Wall):
    """The base of round walls: they turn about their own axis, so that they stay where they are."""

    __slots__ = ()
    _near = _measure = _far = None

    def check(self, box, name):
        """Refuse a wall that cuts a periodic direction or curves out of two dimensions, or leaves its own shape by turning.

        Raises:
            SceneError: naming the axis.
        """
        super().check(box, name)
        for axis, why in without_faces(box):
            if not self._goes_along(axis):
                raise SceneError(f"{name}: it is round across {'xyz'[axis]}, where {why}")
        if self.kind != "sphere" and np.abs(np.cross(self._omega, self._axis)).max() > 1e-12 * np.abs(self._omega).max():
            raise SceneError(
                f"{name}: omega = {self._omega.tolist()} must be along its axis {self._axis.tolist()}: it turns about itself only"
            )

    def _goes_along(self, axis):
        return False

    @property
    def place(self):
        """Where it is, for ``travel``."""
        return self._point.copy(), self._shape()[0]

    def travel(self, then):
        """How far it has come since ``place`` was ``then``: along x, -x, y, -y, z, -z, and the largest [length]."""
        point, radius = then
        way, growth = self._point - point, abs(self._shape()[0] - radius)
        return np.stack([way, -way], axis=1).ravel() + growth, sqrt(float((way**2).sum())) + growth

    def distance(self, position):
        """Distance of points (k, 3) from the wall [length], (k,): negative behind it, where it has a back."""
        found = np.empty(len(position))
        type(self)._far(np.ascontiguousarray(position, dtype=np.float64), self._point, self._directed(), self._shape(), found)
        return found

    def candidates(self, grains, reach):
        """Owned rows that may touch the wall before the next rebuild, ascending."""
        found = np.empty(grains.n + 1, dtype=np.uint32)
        state = (grains.block("place"), grains.block("frozen"), self._point, self._directed(), self._shape())
        return found[: type(self)._near(*state, reach, found)]

    def measure(self, contacts, grains, dt, begin, end):
        """Fill the surface rows of its contacts ``begin`` to ``end``, for a step of ``dt``."""
        state = (grains.block("place"), grains.block("motion"), begin, end, self._point, self._directed(), self._shape())
        drive = np.array([*self._velocity, *self._omega, self._growth()])
        type(self)._measure(contacts.wall_grain, *state, drive, dt, contacts.surface)

    def _directed(self):
        return self._axis

    def _growth(self):
        return 0.0

    def _shape(self):
        raise NotImplementedError


class _Growing(_Curved):
    """A round wall whose radius may grow and shrink, and which grains touch from one side."""

    __slots__ = ("_radial_velocity", "_radius", "inside")
    can_be_pushed = True
    _near, _measure, _far = near_round, measure_round, distances_round
    radius, radial_velocity = Number("length", 0.0, above=True), Number("length/time")

    def _begin(self, radius, inside, radial_velocity):
        if not isinstance(inside, (bool, np.bool_)):
            raise SceneError(f"{self.kind}: inside = {shown(inside)} must be True (grains are inside) or False")
        self.radius, self.inside, self.radial_velocity = radius, bool(inside), radial_velocity

    @property
    def speed(self):
        """Bound on how fast it approaches anything [length/time]."""
        x, y, z = self._velocity.tolist()
        return sqrt(x * x + y * y + z * z) + abs(self._radial_velocity)

    def push(self, speed):
        """Close in on the grains with ``speed`` from now on: the radius shrinks if they are inside, and grows if not."""
        speed = PUSH.checked(self, speed)
        self._radial_velocity = -speed if self.inside else speed

    def move(self, dt):
        """Take the wall to the next step."""
        self._point, self._radius = self._point + dt * self._velocity, self._radius + dt * self._radial_velocity

    def _growth(self):
        return self._radial_velocity

    def _shape(self):
        return np.array([self._radius, -1.0 if self.inside else 1.0, float(self.kind == "cylinder")])


class Cylinder(_Growing):
    """A cylinder without end.

    Args:
        point: any point of the axis [length].
        axis: direction of the axis; any length. It may lie along a periodic direction.
        radius: [length].
        inside: True if grains are inside, False if they are around it.
        material: name of its material.
        velocity: of the wall [length/time].
        omega: angular velocity [1/time], along the axis.
        radial_velocity: rate at which the radius grows [length/time].

    A grain feels the mean curvature 1/(2 R) of the wall, which is Hertz's ellipse to first order in its radius over R.

    Raises:
        SceneError: a value is not finite or not positive, or the axis has no length.
    """

    __slots__ = ("_axis",)
    kind, parts = "cylinder", ("point", "axis", "radius", "velocity", "omega", "radial_velocity")
    axis = Direction("1")

    def __init__(self, point, axis, radius, inside=True, material=0, velocity=(0, 0, 0), omega=(0, 0, 0), radial_velocity=0.0):
        super().__init__(point, material, velocity, omega)
        self.axis = axis
        self._begin(radius, inside, radial_velocity)

    def _goes_along(self, axis):
        return abs(self._axis[axis]) == 1.0


class Sphere(_Growing):
    """A sphere.

    Args:
        point: its centre [length].
        radius: [length].
        inside: True if grains are inside, False if they are around it.
        material, velocity, omega, radial_velocity: as of a ``Cylinder``; it may turn about any axis.

    Raises:
        SceneError: a value is not finite or not positive.
    """

    __slots__ = ()
    kind, parts = "sphere", ("point", "radius", "velocity", "omega", "radial_velocity")

    def __init__(self, point, radius, inside=True, material=0, velocity=(0, 0, 0), omega=(0, 0, 0), radial_velocity=0.0):
        super().__init__(point, material, velocity, omega)
        self._begin(radius, inside, radial_velocity)

    def _directed(self):
        return np.zeros(3)


class Cone(_Curved):
    """The thin shell of a cone between two rims, which grains touch from both sides: a funnel; with two equal radii a tube, and
    with length 0 a ring-shaped plate.

    Args:
        point: centre of the lower rim [length].
        axis: direction towards the upper rim; any length.
        radius_low, radius_high: of the rims [length].
        length: between the rims, along the axis [length].
        material, velocity, omega: as of a ``Cylinder``.

    Raises:
        SceneError: a value is not finite or negative, the axis has no length, or there is no shell.
    """

    __slots__ = ("_axis", "_length", "_radius_high", "_radius_low")
    kind, parts = "cone", ("point", "axis", "radius_low", "radius_high", "length", "velocity", "omega")
    _near, _measure, _far = near_cone, measure_cone, distances_cone
    axis, length = Direction("1"), Number("length", 0.0)
    radius_low, radius_high = Number("length", 0.0), Number("length", 0.0)

    def __init__(self, point, axis, radius_low, radius_high, length, material=0, velocity=(0, 0, 0), omega=(0, 0, 0)):
        super().__init__(point, material, velocity, omega)
        self.axis, self.radius_low, self.radius_high, self.length = axis, radius_low, radius_high, length
        if self._length == 0.0 and self._radius_low == self._radius_high:
            raise SceneError(f"cone: with length 0 and two radii of {self._radius_low:g} [length] there is no shell")

    @property
    def speed(self):
        """Bound on how fast it approaches anything [length/time]."""
        x, y, z = self._velocity.tolist()
        return sqrt(x * x + y * y + z * z)

    def move(self, dt):
        """Take the wall to the next step."""
        self._point = self._point + dt * self._velocity

    def _shape(self):
        return np.array([self._radius_low, self._radius_high, self._length])
