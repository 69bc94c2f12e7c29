"""The room that walls enclose: how large it is, and the stress on each wall of it."""

import math

import numpy as np

from barchan.errors import SceneError
from barchan.walls.curved import Cylinder
from barchan.walls.plane import Plane


class Room:
    """A brick between pairs of planes and periodic faces, or a cylinder with two ends: what a laboratory loads a sample in.

    Along each axis the box is periodic, or two planes face each other; or a cylinder goes along one axis, with grains inside,
    and stands for the other two. Walls may move as they like, but not turn. In two dimensions there is nothing along z.

    Args:
        sim: the simulation. Walls of other kinds, and grains outside, are left alone.

    Attributes:
        walls: those that enclose it, in the order of the scene.
        side: the cylinder, or None.
        ends: for x, y and z the low and the high plane, or () where there are none.

    Raises:
        SceneError: along an axis the room is open or of no length, or a plane of it turns.

    >>> import barchan as bc
    >>> sand = bc.Material("sand", density=2650, kn=1e5, kt=3e4, friction=0.5)
    >>> sim = bc.Simulation(bc.Box((-1, -1, -1), (4, 4, 4)), bc.laws.linear, sand, dt=1e-5)
    >>> side = sim.add_wall(bc.Cylinder((1, 1, 0), (0, 0, 1), radius=0.5))
    >>> ends = [sim.add_wall(bc.Plane((0, 0, z), (0, 0, 1 - z))) for z in (0, 2)]
    >>> room = Room(sim)
    >>> round(room.volume, 6), round(room.area(side)(sim), 6), room.size.tolist()
    (1.570796, 6.283185, [1.0, 1.0, 2.0])
    """

    def __init__(self, sim):
        self._box, self.side = sim.box, _side(sim)
        self._along = None if self.side is None else int(np.argmax(np.abs(self.side.axis)))
        self.ends = [() if self._is_across_the_side(axis) else _ends(sim, axis) for axis in range(3)]
        chosen = [self.side, *(wall for pair in self.ends for wall in pair)]
        self.walls = [wall for wall in sim.walls if any(wall is other for other in chosen)]

    @property
    def size(self):
        """Its lengths along x, y and z; of a cylinder the diameter across its axis; 1 across two dimensions, (3,) [length]."""
        return np.array([self._length(axis) for axis in range(3)])

    @property
    def volume(self):
        """[length^3], in two dimensions the area [length^2]."""
        x, y, z = self.size.tolist()
        return x * y * z * (1.0 if self.side is None else 0.25 * math.pi)

    def area(self, wall):
        """The area of one of its walls, for the ``area`` of a control: a function of the simulation [length^2]; in a plane, its
        length.

        Raises:
            SceneError: the wall is none of the room's.
        """
        if not any(wall is own for own in self.walls):
            raise SceneError(f"this {wall.kind} is no wall of the room, which has {len(self.walls)}: Room.walls")

        def area(sim):
            return self._mantle() if wall is self.side else self.volume / self._length(self._axis_across(wall))

        return area

    def stress(self, sim, wall):
        """Mean normal stress of the grains on one of its walls, compression positive [force/length^2]. All ranks must ask.

        Raises:
            SceneError: the wall is none of the room's, or the scene was changed since the last run.
        """
        return wall.pressing / self.area(wall)(sim)

    def across(self, wall):
        """How far it is from one of its walls to the opposite one, of a cylinder its diameter [length]."""
        return self._length(self._axis_across(wall)) if wall is not self.side else 2.0 * self.side.radius

    def check_has_walls(self, what):
        """Refuse a room of periodic faces alone, which cannot be made smaller.

        Raises:
            SceneError: saying so.
        """
        if not self.walls:
            raise SceneError(f"{what}: the box is periodic on all sides, and there are no walls to close in; let grains grow")

    def _axis_across(self, plane):
        return next(axis for axis in range(3) if any(plane is end for end in self.ends[axis]))

    def _is_across_the_side(self, axis):
        return self.side is not None and axis != self._along

    def _length(self, axis):
        if self._is_across_the_side(axis):
            return 2.0 * self.side.radius
        if not self.ends[axis]:
            return float(self._box.span[axis])
        low, high = (float(wall.point[axis]) for wall in self.ends[axis])
        return high - low

    def _mantle(self):
        return 2.0 * math.pi * self.side.radius * self._length(self._along)


def _axis_of(plane):
    """The axis that a plane lies across, or None."""
    across = np.flatnonzero(plane.normal)
    return int(across[0]) if len(across) == 1 else None


def _side(sim):
    """The cylinder around the grains, or None."""
    found = [wall for wall in sim.walls if isinstance(wall, Cylinder) and wall.inside]
    if not found:
        return None
    if len(found) > 1 or np.count_nonzero(found[0].axis) != 1:
        raise SceneError(
            f"Room: {len(found)} cylinder(s) around the grains, axis {found[0].axis.tolist()}; it takes one, along x, y or z"
        )
    return found[0]


def _ends(sim, axis):
    """The low and the high plane across an axis; () if it is periodic, or has no extent."""
    if sim.box.periodic[axis] or axis >= sim.box.dimension:
        return ()
    planes = [wall for wall in sim.walls if isinstance(wall, Plane) and _axis_of(wall) == axis]
    low, high = ([plane for plane in planes if sign * plane.normal[axis] > 0.0] for sign in (1, -1))
    if len(low) != 1 or len(high) != 1:
        raise SceneError(
            f"Room: along {'xyz'[axis]} the box is not periodic, and {len(low)} plane(s) face up and {len(high)} down; it takes "
            f"two planes that face each other, or a cylinder around the grains"
        )
    for plane in (low[0], high[0]):
        if np.cross(plane.omega, plane.normal).any():
            raise SceneError(
                f"Room: the plane at {'xyz'[axis]} = {plane.point[axis]:g} [length] turns with omega = {plane.omega.tolist()} "
                f"[1/time]; walls of a room may move, but not turn"
            )
    if not low[0].point[axis] < high[0].point[axis]:
        raise SceneError(
            f"Room: the planes across {'xyz'[axis]}, at {low[0].point[axis]:g} and {high[0].point[axis]:g} [length], have no "
            f"room between them; the normal of each must point to the other"
        )
    return low[0], high[0]
