"""A flat wall without end: geometry only, the laws do the rest."""

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError
from barchan.kernels.planes import measure_plane


def _unit(vector):
    return vector / np.sqrt((vector**2).sum())


class Plane:
    """The half space behind a plane.

    Args:
        point: any point of the plane [length].
        normal: direction from the wall towards the grains; any length.
        material: name of its material.
        velocity: of the wall [length/time]; constant.

    Raises:
        SceneError: a value is not finite, or the normal has no length.
    """

    kind = "plane"

    def __init__(self, point, normal, material=0, velocity=(0.0, 0.0, 0.0)):
        given = {"point": point, "normal": normal, "velocity": velocity}
        arrays = {name: numbers(f"plane: {name}", value, "length") for name, value in given.items()}
        for name, value in arrays.items():
            if value.shape != (3,) or not np.isfinite(value).all():
                raise SceneError(f"plane: {name} = {given[name]!r} must be three finite numbers")
        largest = float(np.abs(arrays["normal"]).max())
        if largest == 0.0:
            raise SceneError("plane: normal = (0, 0, 0) has no direction; give the direction from the wall to the grains")
        self.point, self.velocity = arrays["point"], arrays["velocity"]
        self.normal, self.material = _unit(arrays["normal"] / largest), material
        self.key, self.force, self.torque = 0, np.zeros(3), np.zeros(3)

    def check(self, box, name):
        """Refuse a plane that cuts a periodic direction.

        Raises:
            SceneError: naming the axis.
        """
        for axis in range(3):
            if box.periodic[axis] and self.normal[axis] != 0.0:
                raise SceneError(
                    f"{name}: its normal {self.normal.tolist()} leans along {'xyz'[axis]}, where the box is periodic"
                )

    def move(self, dt):
        """Take the wall to the next step."""
        self.point = self.point + dt * self.velocity

    def candidates(self, grains, skin):
        """Owned rows that may touch the wall before the next rebuild."""
        distance = (grains.view("position") - self.point) @ self.normal
        return np.flatnonzero((distance < grains.view("radius") + skin) & (grains.view("frozen") == 0))

    def measure(self, contacts, grains, begin, end):
        """Fill the surface rows of its contacts ``begin`` to ``end``."""
        measure_plane(
            contacts.wall_grain, grains.block("place"), begin, end, self.point, self.normal, self.velocity, contacts.surface
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
        """Take up what ``state`` returned."""
        for name in ("point", "normal", "velocity", "force"):
            setattr(self, name, np.array(state[name]))
