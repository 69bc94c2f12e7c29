"""What all walls have in common: parameters that are checked when they are set, motion, control, and what grains do to them.

A wall is geometry only; the laws of grains hold for it too. Its force, torque and work are those of the grains *on the wall*; the
force of the wall on the grains, which Marketos et al. (2013) and LAMMPS store, is the opposite.
"""

from math import inf, isfinite

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError
from barchan.words import shown


def three(what, value, dimension):
    """Three finite numbers as a new array.

    Raises:
        SceneError: they are not.
    """
    array = numbers(what, value, dimension)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise SceneError(f"{what} = {shown(value)} must be three finite numbers [{dimension}]")
    return array


class _Parameter:
    """A parameter of a wall; setting it tells the scene that the wall was edited."""

    def __init__(self, dimension):
        self.dimension = dimension

    def __set_name__(self, owner, name):
        self.name, self.store = name, f"_{name}"

    def __set__(self, wall, value):
        setattr(wall, self.store, self.checked(wall, value))
        wall.edited = True


class Vector(_Parameter):
    """Three finite numbers, read-only but as a whole, so that no change goes unnoticed."""

    def __get__(self, wall, owner=None):
        if wall is None:
            return self
        view = getattr(wall, self.store).view()
        view.flags.writeable = False
        return view

    def checked(self, wall, value):
        """A user's value as an array."""
        return three(f"{wall.kind}: {self.name}", value, self.dimension)


class Direction(Vector):
    """A vector of any length but zero, kept with length 1."""

    def checked(self, wall, value):
        """A user's value as a unit vector."""
        vector = super().checked(wall, value)
        largest = float(np.abs(vector).max())
        if largest == 0.0:
            raise SceneError(f"{wall.kind}: {self.name} = (0, 0, 0) has no direction; give one of any length")
        vector = vector / largest
        return vector / np.sqrt((vector**2).sum())


class Number(_Parameter):
    """A finite number, perhaps with a least value.

    Args:
        least: that it may have.
        above: it must be larger than that.
    """

    def __init__(self, dimension, least=-np.inf, above=False):
        super().__init__(dimension)
        self.least, self.above = least, above

    def __get__(self, wall, owner=None):
        return self if wall is None else getattr(wall, self.store)

    def checked(self, wall, value):
        """A user's value as a float."""
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = float("nan")
        if not isfinite(number) or number < self.least or (self.above and number == self.least):
            bound = f" {'>' if self.above else '>='} {self.least:g}" if isfinite(self.least) else ""
            raise SceneError(f"{wall.kind}: {self.name} = {shown(value)} [{self.dimension}] must be a finite number{bound}")
        return number


#: With what a control may push a wall.
PUSH = Number("length/time")
PUSH.__set_name__(Number, "speed of push")


class Wall:
    """The base of all walls.

    Attributes to set between runs, by actions and by controls:
        material: name of its material; in a scene, its number.
        velocity, omega: of translation [length/time] and of rotation about ``point`` [1/time]; constant until set anew.
        control: a ``Control`` that sets them in every step, or None.

    Attributes to read, the same on all ranks, which all must ask:
        force, torque: of the grains on the wall, torque about ``point``: three numbers each [force, force length].
        pressing: sum of the normal forces of its contacts, positive when grains press on it [force].
        contacts: how many grains touch it.

    ``edited`` tells the scene that a parameter was set.
    """

    __slots__ = ("_control", "_loads", "_material", "_omega", "_point", "_velocity", "edited", "key", "number")

    #: What a user calls it, and the names of what ``state`` keeps of it.
    kind, parts = "wall", ("point", "velocity", "omega")

    #: How many contacts a grain may have with it, each with a key of its own: ``key``, and those below.
    patches = 1

    #: True if it has ``push``, which controls of forces call.
    can_be_pushed = False

    #: True if compiled code can move it, and knows its geometry, unless a control interferes.
    is_steady = False

    point, velocity, omega = Vector("length"), Vector("length/time"), Vector("1/time")

    def __init__(self, point, material, velocity, omega):
        self.point, self.velocity, self.omega, self.material = point, velocity, omega, material
        self.key, self.number, self.control, self._loads = 0, 0, None, None

    @property
    def material(self):
        """Name of its material; in a scene, its number."""
        return self._material

    @material.setter
    def material(self, material):
        self._material, self.edited = material, True

    @property
    def control(self):
        """What sets its velocity in every step, or None."""
        return self._control

    @control.setter
    def control(self, control):
        if control is not None and (isinstance(control, type) or not callable(getattr(control, "steer", None))):
            raise SceneError(
                f"{self.kind}: control = {shown(control)} must be an object with a method steer(wall, sim), such as a "
                f"barchan.walls.Servo"
            )
        self._control = control

    @property
    def load(self):
        """What grains do to it, a ``Load``: the four below in one."""
        self._in_a_scene()
        return self._loads.of(self)

    def _in_a_scene(self):
        if self._loads is None:
            raise SceneError(f"this {self.kind} is in no scene yet, and nothing touches it; add_wall() takes it up")

    @property
    def response(self):
        """How the force of grains on it changes as it closes in, a ``Response``."""
        self._in_a_scene()
        return self._loads.response_of(self)

    @property
    def force(self):
        """Force of the grains on the wall, (3,) [force]."""
        return np.array(self.load.force)

    @property
    def torque(self):
        """Torque of the grains on the wall about its point, (3,) [force length]. Ask in a writer or between runs: in an action
        grains and walls have moved on since the forces were computed."""
        return np.array(self.load.torque)

    @property
    def pressing(self):
        """Sum of the normal forces of its contacts, positive when grains press on it [force]."""
        return self.load.pressing

    @property
    def contacts(self):
        """Number of grains that touch it."""
        return self.load.contacts

    def steady_steps(self, step):
        """In how many steps from ``step`` on it only moves on as it does, so that compiled code can move it."""
        if not self.is_steady:
            return 0
        return inf if self._control is None else getattr(self._control, "start", 0) - step

    def admit(self, loads, number, key):
        """Take it into a scene: it is wall ``number`` there, and ``key`` is the first of its keys."""
        self._loads, self.number, self.key = loads, number, key

    def keys(self, rows):
        """The key of each candidate that was found last."""
        return np.full(len(rows), self.key)

    def drive(self, velocity):
        """Move with this velocity from now on, three numbers [length/time]: for controls; to users a change would be an edit."""
        self._velocity = three(f"{self.kind}: velocity of drive", velocity, "length/time")

    def check(self, box, name):
        """Refuse a wall that has no place in a box.

        Raises:
            SceneError: in two dimensions, it is beside the plane, moves out of it, or turns other than about z.
        """
        if box.dimension == 2 and (self._point[2] != 0.0 or self._velocity[2] != 0.0 or self._omega[:2].any()):
            raise SceneError(
                f"{name}: point = {self._point.tolist()} [length] and velocity = {self._velocity.tolist()} [length/time] must "
                f"have no z component, and omega = {self._omega.tolist()} [1/time] a z component only: the box has two dimensions"
            )

    def check_sizes(self, typical, name):
        """Refuse a wall that grains of a ``typical`` radius [length] cannot be meant for.

        Raises:
            SceneError: saying so.
        """

    def settle(self):
        """Start from parameters that were set anew."""

    def steer(self, sim):
        """Let its control set the velocity from this step to the next."""
        if self._control is not None and sim.step_number >= getattr(self._control, "start", 0):
            self._control.steer(self, sim)

    def state(self):
        """What a checkpoint keeps, as plain data."""
        parts = {name: getattr(self, f"_{name}") for name in self.parts}
        return {
            "kind": self.kind,
            "material": int(self.material),
            "key": self.key,
            **{name: part.tolist() if isinstance(part, np.ndarray) else part for name, part in parts.items()},
            "control": self._control.state() if hasattr(self._control, "state") else {},
        }

    def restore(self, state):
        """Take up what ``state`` returned, to the bit.

        Raises:
            SceneError: a parameter is of the wrong kind.
        """
        for name in self.parts:
            value = state[name]
            setattr(self, f"_{name}", three(f"{self.kind}: {name}", value, "1") if isinstance(value, list) else float(value))
        if hasattr(self._control, "restore"):
            self._control.restore(state["control"])


def without_faces(box):
    """Axes along which walls can but go on for ever, and why: [(axis, reason)]."""
    periodic = [(axis, "the box is periodic") for axis in range(3) if box.periodic[axis]]
    return periodic + [(axis, "the box of two dimensions has no extent") for axis in range(box.dimension, 3)]


def steer(walls, sim):
    """Let the controls of walls set their velocities; if one fails, all remember what they did before."""
    controls = [wall.control for wall in walls]
    before = [(control, name, getattr(control, name)) for control in controls for name in getattr(control, "memory", ())]
    try:
        for wall in walls:
            wall.steer(sim)
    except Exception:
        for control, name, value in before:
            setattr(control, name, value)
        raise
