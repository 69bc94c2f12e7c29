"""Walls of triangles."""

from hashlib import sha256
from itertools import product
from math import cos, radians, sqrt

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError
from barchan.kernels.addresses import whereabouts
from barchan.kernels.feet import measure_mesh
from barchan.kernels.mesh_steps import Meshes
from barchan.kernels.meshes import Course, Nearby, move_mesh, near_mesh, travel_of_mesh, turned_by
from barchan.kernels.triangles import distances_mesh
from barchan.walls.mesh_file import read_triangles
from barchan.walls.triangulation import triangulation
from barchan.walls.wall import PUSH, Direction, Wall
from barchan.words import shown

#: A mesh may be as many times as large as the box, or as small.
_ABSURD = 300.0

#: Extent of a mesh over the radius of a typical grain.
_SMALLEST, _LARGEST = 0.03, 1e6

_UNIT = (
    ": is its unit right? A drawing in millimetres that is taken for one in metres is 1000 times too large, one in metres taken "
    "for millimetres as much too small"
)


class _Towards(Direction):
    """A direction, or None: kept as (0, 0, 0)."""

    def checked(self, wall, value):
        """A user's value as a unit vector."""
        return np.zeros(3) if value is None else super().checked(wall, value)


class Mesh(Wall):
    """Triangles. Grains touch a closed mesh from outside, or from ``inside``, and one with holes, a sheet, from both sides.

    A grain touches it where it is nearest. On a smooth surface, whose triangles meet at less than ``feature_angle``, there is one
    contact, whose memory goes along over edges and vertices, and over sharper ones that stick out, too. In corners that go in
    there is one for each side. A grain whose centre goes through ends the run, however fast it is, if ``max_overlap`` is below
    0.5. To the law all triangles are flat: what curvature they stand for is not known.

    Args:
        vertices: (v, 3) [length].
        triangles: (t, 3) whole numbers: the vertices of each, from 0.
        inside: True if grains are inside of a closed mesh.
        feature_angle: between 0 and 90 degrees; by default prisms of more than nine sides are smooth.
        material: name of its material.
        velocity: of the wall [length/time].
        omega: angular velocity about ``point`` [1/time].
        point: about which it turns; by default the middle of its extent [length].
        towards: direction in which a ``control`` such as a ``Servo`` pushes it, towards the grains; any length. ``pressing`` is
            then the force of the grains against it, not the sum of normal forces.

    Raises:
        SceneError: what is given is no mesh, or no closed one where it has to be.
    """

    __slots__ = (
    "_axis_x", "_axis_y", "_corners", "_dt", "_given", "_half_period", "_listed", "_made_of", "_mesh", "_patch", "_period",
    "_poses", "_rooms", "_slide", "_towards", "feature_angle", "inside",
    )  # fmt: skip

    kind, parts = "mesh", ("point", "axis_x", "axis_y", "velocity", "slide", "omega", "towards")
    towards, is_steady = _Towards("1"), True

    def __init__(
        self,
        vertices,
        triangles,
        inside=False,
        feature_angle=40.0,
        material=0,
        velocity=(0, 0, 0),
        omega=(0, 0, 0),
        point=None,
        towards=None,
    ):
        vertices = numbers("mesh: vertices", vertices, "length")
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices) or not np.isfinite(vertices).all():
            raise SceneError(f"mesh: vertices have shape {vertices.shape}; they must be (v, 3) finite numbers [length]")
        if not isinstance(inside, (bool, np.bool_)):
            raise SceneError(f"mesh: inside = {shown(inside)} must be True (grains are inside) or False")
        self.inside, self.feature_angle = bool(inside), _angle(feature_angle)
        middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        super().__init__(middle if point is None else point, material, velocity, omega)
        own = vertices - self._point
        self._given = own, triangles, self.feature_angle, self.inside
        self._period, self._half_period = np.zeros(3), np.full(3, np.inf)
        self._mesh = triangulation(*self._given, self._period)
        self._made_of = sha256(
            repr((own.tolist(), np.asarray(triangles).tolist(), inside, self.feature_angle)).encode()
        ).hexdigest()
        self._corners = np.stack(np.meshgrid(*zip(own.min(axis=0), own.max(axis=0)), indexing="ij"), axis=-1).reshape(-1, 3)
        self._axis_x, self._axis_y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        self._listed, self._patch, self._rooms, self.towards = None, None, None, towards
        self.settle()

    @classmethod
    def read(cls, path, unit, **given):
        """A mesh from an STL, OBJ or PLY file; it needs the package trimesh.

        Args:
            path: of the file.
            unit: of its lengths: "m", "cm", "mm", "um", "in" or "ft", in a scene in SI units, or a number, its length in those
                of the scene. Files do not tell it.
            given: what else a mesh takes, such as ``inside`` and ``material``.

        Raises:
            SceneError: the file cannot be read, or holds no mesh; naming it.
        """
        vertices, triangles = read_triangles(path, unit)
        try:
            return cls(vertices, triangles, **given)
        except SceneError as error:
            raise SceneError(f"'{path}': {error}") from None

    @property
    def is_closed(self):
        """True if it has no holes; then it has a front and a back."""
        return bool(self._mesh.shape.solid)

    @property
    def patches(self):
        """How many contacts a grain may have with it, each with a key of its own."""
        return len(self._mesh.shape.surface)

    @property
    def n_triangles(self):
        """How many triangles it has."""
        return len(self._mesh.order)

    @property
    def places(self):
        """The corners of its triangles where they are now, (t, 3, 3) [length]."""
        shape, order = self._mesh.shape, self._mesh.order
        places = np.empty((len(order), 3, 3))
        places[order] = shape.vertices[shape.corners] @ self._poses[0, :3] + self._point
        return places

    @property
    def touched(self):
        """The triangle on which each of its listed contacts on this rank would be, by number."""
        return self._mesh.order[self._listed.triangle[self._rooms[2][:, 0]]]

    @property
    def pressing(self):
        """Force of the grains against ``towards``; without one the sum of the normal forces of its contacts [force]."""
        (x, y, z), (a, b, c) = self.load.force, self._towards.tolist()
        return -(x * a + y * b + z * c) if self.can_be_pushed else self.load.pressing

    @property
    def can_be_pushed(self):
        """True if ``towards`` is known."""
        return bool(self._towards.any())

    def push(self, speed):
        """Move along ``towards`` with ``speed`` from now on, and across it as before."""
        self._velocity = self._slide + PUSH.checked(self, speed) * self._towards

    @property
    def speed(self):
        """Bound on how fast it approaches anything [length/time]."""
        farthest = sqrt(float((self._corners**2).sum(axis=1).max())) if self._omega.any() else 0.0
        return sqrt(float((self._velocity**2).sum())) + sqrt(float((self._omega**2).sum())) * farthest

    def check(self, box, name):
        """Refuse a mesh in two dimensions, and one of absurd size.

        Raises:
            SceneError: saying so.
        """
        if box.dimension == 2:
            raise SceneError(f"{name}: a mesh needs three dimensions, the box has two; use planes, cylinders and cones there")
        period = np.where(box.periodic, box.length, 0.0)
        if (period != self._period).any():
            self._mesh, self._period = triangulation(*self._given, period), period
            self._half_period = np.where(period > 0.0, 0.5 * period, np.inf)
        room = float((box.high - box.low).max())
        if not 1.0 / _ABSURD < self._extent / room < _ABSURD:
            raise SceneError(f"{name}: it extends over {self._extent:g} [length] and the box over {room:g}{_UNIT}")

    def check_sizes(self, typical, name):
        """Refuse a mesh that grains of a ``typical`` radius [length] cannot be meant for.

        Raises:
            SceneError: saying so.
        """
        if not _SMALLEST < self._extent / typical < _LARGEST:
            raise SceneError(
                f"{name}: it extends over {self._extent:g} [length], and a typical grain has a radius of {typical:g}{_UNIT}"
            )

    @property
    def _extent(self):
        """How long it is along x, y or z, whichever is longest [length]."""
        return float(np.ptp(self._corners, axis=0).max())

    def settle(self):
        """Start from parameters that were set anew."""
        self._slide = self._velocity - (self._velocity @ self._towards) * self._towards
        self._come_to_rest()

    def _come_to_rest(self):
        """Where it was a step before is not known."""
        axes = (self._axis_x, self._axis_y, np.cross(self._axis_x, self._axis_y))
        self._poses, self._dt = np.broadcast_to((*axes, self._point), (3, 4, 3)).copy(), 0.0

    def move(self, dt):
        """Take the wall to the next step."""
        poses = self._poses.copy()
        move_mesh(poses, self._drive, dt)
        self.move_to(poses, dt)

    def move_to(self, poses, dt):
        """The same where it was computed elsewhere: ``poses`` (3, 4, 3), as ``Course`` has them."""
        self._poses, self._dt = poses, dt
        self._axis_x, self._axis_y, self._point = poses[0, 0].copy(), poses[0, 1].copy(), poses[0, 3].copy()

    def restore(self, state):
        """Take up what ``state`` returned, to the bit.

        Raises:
            SceneError: a parameter is of the wrong kind.
        """
        super().restore(state)
        if abs(self._axis_x @ self._axis_y) > 1e-9:
            raise SceneError(f"mesh: its axes {self._axis_x.tolist()} and {self._axis_y.tolist()} are not at right angles")
        self._come_to_rest()

    def state(self):
        """What a checkpoint keeps, as plain data."""
        return super().state() | {"patches": self.patches, "mesh": self._made_of}

    @property
    def place(self):
        """Where it is, for ``travel``: its axes and its point, (4, 3)."""
        return self._poses[0].copy()

    def travel(self, then):
        """How far it has come since ``place`` was ``then``: along x, -x, y, -y, z, -z, and the largest [length]."""
        travel = np.full(7, -np.inf)
        travel_of_mesh(self._poses[0], then, self._corners, travel)
        return travel[:6], sqrt(float(travel[6]))

    def distance(self, position):
        """Distance of points (k, 3) from the wall [length], (k,): negative inside a closed one, or outside where grains are
        inside."""
        nearest, one = np.full(len(position), np.inf), np.empty(len(position))
        periods = [(-period, 0.0, period) if period else (0.0,) for period in self._period.tolist()]
        for image in product(*periods):
            distances_mesh((position - self._point + image) @ self._poses[0, :3].T, self._mesh.shape, self._mesh.tree, one)
            nearest = np.where(np.abs(one) < np.abs(nearest), one, nearest)
        return nearest

    def candidates(self, grains, reach):
        """Owned rows that may touch the wall before the next rebuild, ascending, each once for every patch."""
        corners = self._corners @ self._poses[0, :3]
        state = (grains.block("place"), grains.block("motion"), grains.block("frozen"), self._course(self._dt))
        where = (*state, np.stack([corners.min(axis=0), corners.max(axis=0)]), reach, self._mesh.shape, self._mesh.tree)
        counts, begin = np.empty(grains.n, dtype=np.int64), np.zeros(grains.n + 1, dtype=np.int64)
        near_mesh(*where, begin, *_entries(0), counts)
        np.cumsum(counts, out=begin[1:])
        triangle, image, clear = _entries(begin[-1])
        if len(triangle):
            near_mesh(*where, begin, triangle, image, clear, counts)
        row, patch = np.repeat(np.arange(grains.n), counts), self._mesh.shape.patch[triangle]
        entry = np.flatnonzero(np.append(True, (np.diff(row) != 0) | (np.diff(patch) != 0))[: len(row)])
        rows, self._patch = row[entry], patch[entry]
        group = np.flatnonzero(np.append(True, np.diff(rows) != 0)[: len(rows)])
        then, first = state[0][rows[group], :3], entry[group]
        if self._period.any():
            clear[(image != np.repeat(image[first], np.diff(np.append(first, len(row))), axis=0)).any(axis=1)] = -1.0
        at = (then - self._point - image[first] * self._period) @ self._poses[0, :3].T
        self._listed = Nearby(np.append(group, len(rows)), np.append(entry, len(row)), triangle, image, then, at, clear)
        count = len(rows)
        self._rooms = (np.empty(len(row)), np.empty((count, 4)), *(np.empty(n, dtype=np.int64) for n in ((count, 2), count)))
        return rows.astype(np.uint32)

    def keys(self, rows):
        """The key of each candidate that was found last."""
        return self.key - self._patch

    def measure(self, contacts, grains, dt, begin, end):
        """Fill the surface rows of its contacts ``begin`` to ``end``, for a step of ``dt``."""
        if begin < end:
            number, column, *memory = contacts.memory_at_walls(begin)
            what = (grains.block("place"), grains.block("motion"), begin, number, column, self._listed, self._course(dt))
            measure_mesh(contacts.wall_grain, *what, self._mesh.shape, self._cosine, *self._rooms, *memory, contacts.surface)

    @property
    def _cosine(self):
        return cos(radians(self.feature_angle))

    @property
    def _drive(self):
        return np.concatenate([self._velocity, self._omega])

    def _course(self, dt):
        now, half, before = self._poses
        moved = (now, half if dt else now, before)
        return Course(*moved, self._drive, turned_by(self._poses, self._corners), float(dt), self._period, self._half_period)


def _entries(count):
    """Room for triangles that are near grains: which, in which image, and how far."""
    return np.empty(count, dtype=np.int64), np.empty((count, 3), dtype=np.int64), np.empty(count)


def _angle(angle):
    try:
        number = float(angle)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not 0.0 < number < 90.0:
        raise SceneError(f"mesh: feature_angle = {shown(angle)} [degrees] must be between 0 and 90")
    return number


def in_steps(meshes, walls_then):
    """What steps that are made many at a time need of meshes, a ``Meshes``. They have to live on as long as it is used.

    Args:
        walls_then: of all walls by number, the ``place`` at the rebuild.
    """
    whole = [(*mesh._listed, *mesh._mesh.shape[:-1], *mesh._rooms) for mesh in meshes]
    return Meshes(
        np.array([mesh.number for mesh in meshes]),
        np.array([mesh._poses for mesh in meshes]),
        np.array([mesh._drive for mesh in meshes]),
        np.array([mesh._corners for mesh in meshes]),
        np.array([walls_then[mesh.number] for mesh in meshes]),
        meshes[0]._period,
        meshes[0]._half_period,
        np.array([mesh._cosine for mesh in meshes]),
        np.array([mesh._mesh.shape.solid for mesh in meshes]),
        np.array([[whereabouts(array) for array in arrays] for arrays in whole]),
    )
