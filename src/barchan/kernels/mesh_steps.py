"""Meshes in steps that are made many at a time: any number of them, by the addresses of their arrays."""

from typing import NamedTuple

import numpy as np

from barchan.kernels.addresses import array_at
from barchan.kernels.compiler import helper, kernel
from barchan.kernels.feet import measure_mesh_alone
from barchan.kernels.meshes import Course, Nearby, move_mesh, travel_of_mesh, turned_by
from barchan.kernels.triangles import Triangles


class Meshes(NamedTuple):
    """All meshes of a scene: ``number`` (meshes,) among its walls; ``poses`` (meshes, 3, 4, 3), which are modified, and ``drive``
    (meshes, 6), as ``Course`` has them; ``corners`` (meshes, 8, 3) of the box around each; ``then`` (meshes, 4, 3): where they
    were at the rebuild; ``period``, ``half_period`` (3,) of the box; ``cosine`` (meshes,) of their feature angles; ``solid``
    (meshes,); ``where`` (meshes, 20, 2): addresses and rows of the arrays of its ``Nearby``, of its ``Triangles``, and of the
    rooms of ``measure_mesh``."""

    number: np.ndarray
    poses: np.ndarray
    drive: np.ndarray
    corners: np.ndarray
    then: np.ndarray
    period: np.ndarray
    half_period: np.ndarray
    cosine: np.ndarray
    solid: np.ndarray
    where: np.ndarray


@helper
def nearby_at(where):
    """The ``Nearby`` whose arrays begin with the first."""
    return Nearby(
        array_at(where[0], (), np.int64),
        array_at(where[1], (), np.int64),
        array_at(where[2], (), np.int64),
        array_at(where[3], (3,), np.int64),
        array_at(where[4], (3,), np.float64),
        array_at(where[5], (3,), np.float64),
        array_at(where[6], (), np.float64),
    )


@helper
def triangles_at(where, solid):
    """The ``Triangles`` whose arrays follow."""
    return Triangles(
        array_at(where[7], (3,), np.float64),
        array_at(where[8], (3,), np.int64),
        array_at(where[9], (4, 4), np.float64),
        array_at(where[10], (3,), np.float64),
        array_at(where[11], (3, 3), np.float64),
        array_at(where[12], (3,), np.float64),
        array_at(where[13], (), np.int64),
        array_at(where[14], (), np.int64),
        array_at(where[15], (), np.uint8),
        solid,
    )


@kernel()
def move_meshes(meshes, dt):
    """Take all to the next step."""
    for m in range(meshes.number.shape[0]):
        move_mesh(meshes.poses[m], meshes.drive[m], dt)


@kernel()
def travel_of_meshes(meshes, travel):
    """Raise ``travel``, as ``travel_of_mesh`` does, to how far any has come since the rebuild."""
    for m in range(meshes.number.shape[0]):
        travel_of_mesh(meshes.poses[m, 0], meshes.then[m], meshes.corners[m], travel)


@kernel()
def measure_meshes(meshes, dt, grain, place, motion, begin, number, column, slot, history, changed, surface):
    """What ``measure_mesh`` does, for all.

    Args:
        begin: (walls + 1,) where the contacts of each wall begin.
        number, column: of the first contact with a wall.
    """
    for m in range(meshes.number.shape[0]):
        first, where, poses = begin[meshes.number[m]], meshes.where[m], meshes.poses[m]
        course = Course(
            poses[0], poses[1], poses[2], meshes.drive[m], turned_by(poses, meshes.corners[m]), dt, meshes.period,
            meshes.half_period)  # fmt: skip
        measure_mesh_alone(
            grain, place, motion, first, number + first, column + first, nearby_at(where), course,
            triangles_at(where, meshes.solid[m]), meshes.cosine[m], array_at(where[16], (), np.float64),
            array_at(where[17], (4,), np.float64), array_at(where[18], (2,), np.int64), array_at(where[19], (), np.int64), slot,
            history, changed, surface)  # fmt: skip
