"""A flat wall without end: geometry only, the laws do the rest."""

from math import sqrt

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError
from barchan.kernels.planes import measure_plane, near_plane
from barchan.words import shown

_DIMENSIONS = {"point": "length", "normal": "1", "velocity": "length/time"}


def _three(name, value):
    """Three finite numbers as a new array."""
    array = numbers(f"plane: {name}", value, _DIMENSIONS[name])
    if array.shape != (3,) or not np.isfinite(array).all():
        raise SceneError(f"plane: {name} = {shown(value)} must be three finite numbers")
    return array


def _unit(vector):
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        raise SceneError("plane: normal = (0, 0, 0) has no direction; give the direction from the wall to the grains")
    vector = vector / largest
    return vector / np.sqrt((vector**2).sum())


class _Vector:
    """A vector of a plane. It is checked when it is set, and read-only otherwise, so that no change goes unnoticed."""

    def __set_name__(self, owner, name):
        self.name, self.store = name, f"_{name}"

    def __get__(self, plane, owner=None):
        if plane is None:
            return self
        view = getattr(plane, self.store).view()
        view.flags.writeable = False
        return view

    def __set__(self, plane, value):
        array = _three(self.name, value)
        setattr(plane, self.store, _unit(array) if self.name == "normal" else array)
        plane.edited = True


class Plane:
    """The half space behind a plane.

    Args:
        point: any point of the plane [length].
        normal: direction from the wall towards the grains; any length.
        material: name of its material.
        velocity: of the wall [length/time]; constant until it is set anew.

    All four can be set between runs and by actions; ``edited`` tells the scene that one was.

    Raises:
        SceneError: a value is not finite, or the normal has no length.
    """

    __slots__ = ("_material", "_normal", "_point", "_velocity", "edited", "force", "key", "torque")

    kind = "plane"
    point, normal, velocity = _Vector(), _Vector(), _Vector()

    def __init__(self, point, normal, material=0, velocity=(0.0, 0.0, 0.0)):
        self.point, self.normal, self.velocity, self.material = point, normal, velocity, material
        self.key, self.force, self.torque = 0, np.zeros(3), np.zeros(3)

    @property
    def material(self):
        """Name of its material; in a scene, its number."""
        return self._material

    @material.setter
    def material(self, material):
        self._material, self.edited = material, True

    @property
    def speed(self):
        """How fast it moves [length/time]."""
        x, y, z = self._velocity.tolist()
        return sqrt(x * x + y * y + z * z)

    def check(self, box, name):
        """Refuse a plane that cuts a periodic direction.

        Raises:
            SceneError: naming the axis.
        """
        for axis in range(3):
            if box.periodic[axis] and self._normal[axis] != 0.0:
                raise SceneError(
                    f"{name}: its normal {self.normal.tolist()} leans along {'xyz'[axis]}, where the box is periodic"
                )

    def move(self, dt):
        """Take the wall to the next step."""
        self._point = self._point + dt * self._velocity

    def move_to(self, point):
        """The same, where it was computed elsewhere."""
        self._point = point.copy()

    def candidates(self, grains, skin):
        """Owned rows that may touch the wall before the next rebuild, ascending."""
        found = np.empty(grains.n + 1, dtype=np.uint32)
        state = (grains.block("place"), grains.block("frozen"), self._point, self._normal)
        return found[: near_plane(*state, skin, found)]

    def measure(self, contacts, grains, begin, end):
        """Fill the surface rows of its contacts ``begin`` to ``end``."""
        measure_plane(
            contacts.wall_grain, grains.block("place"), begin, end, self._point, self._normal, self._velocity, contacts.surface
        )

    def state(self):
        """What a checkpoint keeps, as plain numbers."""
        return {
            "kind": self.kind,
            "material": int(self.material),
            "point": self.point.tolist(),
            "normal": self.normal.tolist(),
            "velocity": self.velocity.tolist(),
            "force": self.force.tolist(),
            "key": self.key,
        }

    def restore(self, state):
        """Take up what ``state`` returned, to the bit.

        Raises:
            SceneError: a vector is not three finite numbers.
        """
        self._point, self._normal, self._velocity = (_three(name, state[name]) for name in ("point", "normal", "velocity"))
        self.force = np.array(state["force"])
