"""How meshes move, and which of their triangles are near which grains."""

from math import ceil, cos, floor, inf, sin, sqrt
from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import kernel, piece, prange
from barchan.kernels.triangles import beside_box, beside_triangle, nearest_of


class Nearby(NamedTuple):
    """Triangles near grains since the list was made. ``group`` (grains + 1,): where the contacts of each grain begin; ``entry``
    (contacts + 1,): where the triangles of each begin; ``triangle`` (entries,); ``image`` (entries, 3): in which image of the
    mesh across periodic faces; ``then`` (grains, 3): where the grains were; ``at`` (grains, 3): where they were, seen from the
    image of their first entry, when ``clear`` (entries,), how far the triangles were, was taken: both change as they go; -1: in
    another image than the first, and not known."""

    group: np.ndarray
    entry: np.ndarray
    triangle: np.ndarray
    image: np.ndarray
    then: np.ndarray
    at: np.ndarray
    clear: np.ndarray


class Course(NamedTuple):
    """How a mesh moves. ``now``, ``half``, ``before`` (4, 3): its three axes and its point in this step, the axes half a step
    and both a step before; ``drive`` (6,): velocity and angular velocity; ``turned``: how far its rotation took any of it in the
    last step at most; ``dt``: that step; ``period``, ``half_period`` (3,) of the box: 0 and inf where it is not periodic."""

    now: np.ndarray
    half: np.ndarray
    before: np.ndarray
    drive: np.ndarray
    turned: float
    dt: float
    period: np.ndarray
    half_period: np.ndarray


@piece
def into(pose, x, y, z):
    """A vector in the frame of a mesh."""
    return (
        x * pose[0, 0] + y * pose[0, 1] + z * pose[0, 2],
        x * pose[1, 0] + y * pose[1, 1] + z * pose[1, 2],
        x * pose[2, 0] + y * pose[2, 1] + z * pose[2, 2],
    )


@piece
def out_of(pose, x, y, z):
    """A vector from the frame of a mesh."""
    return (
        x * pose[0, 0] + y * pose[1, 0] + z * pose[2, 0],
        x * pose[0, 1] + y * pose[1, 1] + z * pose[2, 1],
        x * pose[0, 2] + y * pose[1, 2] + z * pose[2, 2],
    )


@piece
def rotated(x, y, z, rx, ry, rz):
    """A unit vector turned by a rotation vector (Rodrigues' formula), of length 1 again."""
    angle = sqrt(rx * rx + ry * ry + rz * rz)
    ax, ay, az = rx / angle, ry / angle, rz / angle
    c, s, along = cos(angle), sin(angle), (1.0 - cos(angle)) * (ax * x + ay * y + az * z)
    tx = c * x + s * (ay * z - az * y) + along * ax
    ty = c * y + s * (az * x - ax * z) + along * ay
    tz = c * z + s * (ax * y - ay * x) + along * az
    norm = sqrt(tx * tx + ty * ty + tz * tz)
    return tx / norm, ty / norm, tz / norm


@piece
def set_axes(pose, xx, xy, xz, yx, yy, yz):
    """Three axes of two, the third across both."""
    pose[0, 0], pose[0, 1], pose[0, 2] = xx, xy, xz
    pose[1, 0], pose[1, 1], pose[1, 2] = yx, yy, yz
    pose[2, 0], pose[2, 1], pose[2, 2] = xy * yz - xz * yy, xz * yx - xx * yz, xx * yy - xy * yx


@piece
def turn_axes(before, drive, dt, pose):
    """Write axes that have turned for a time into ``pose``, at right angles again."""
    rx, ry, rz = dt * drive[3], dt * drive[4], dt * drive[5]
    xx, xy, xz = rotated(before[0, 0], before[0, 1], before[0, 2], rx, ry, rz)
    yx, yy, yz = rotated(before[1, 0], before[1, 1], before[1, 2], rx, ry, rz)
    along = xx * yx + xy * yy + xz * yz
    yx, yy, yz = yx - along * xx, yy - along * xy, yz - along * xz
    norm = sqrt(yx * yx + yy * yy + yz * yz)
    set_axes(pose, xx, xy, xz, yx / norm, yy / norm, yz / norm)


@kernel()
def move_mesh(poses, drive, dt):
    """Take a mesh to the next step. ``poses`` (3, 4, 3), as ``Course`` has them, are modified; ``drive`` (6,)."""
    now, half, before = poses[0], poses[1], poses[2]
    for row in range(4):
        for c in range(3):
            before[row, c] = half[row, c] = now[row, c]
    for c in range(3):
        now[3, c] = before[3, c] + dt * drive[c]
    if drive[3] != 0.0 or drive[4] != 0.0 or drive[5] != 0.0:
        turn_axes(before, drive, 0.5 * dt, half)
        turn_axes(before, drive, dt, now)


@piece
def turned_along(corners, k, pose, then, c):
    """How far a corner, (8, 3) from the point of its mesh, has come along an axis by rotation alone."""
    way = 0.0
    for row in range(3):
        way += corners[k, row] * (pose[row, c] - then[row, c])
    return way


@kernel()
def turned_by(poses, corners):
    """How far the rotation of the last step took any of the ``corners`` of a box around a mesh."""
    farthest = 0.0
    for k in range(corners.shape[0]):
        square = 0.0
        for c in range(3):
            square += turned_along(corners, k, poses[0], poses[2], c) ** 2
        farthest = max(farthest, square)
    return sqrt(farthest)


@kernel()
def travel_of_mesh(pose, then, corners, travel):
    """Raise ``travel`` to how far ``corners`` have come since the mesh was ``then``, (4, 3): along each axis and against it, and
    the square of the farthest."""
    for k in range(corners.shape[0]):
        square = 0.0
        for c in range(3):
            way = (pose[3, c] - then[3, c]) + turned_along(corners, k, pose, then, c)
            square += way * way
            travel[2 * c], travel[2 * c + 1] = max(travel[2 * c], way), max(travel[2 * c + 1], -way)
        travel[6] = max(travel[6], square)


@piece
def way_of(motion, i, course):
    """Bound on how far a grain went relative to the mesh in the last step."""
    square = 0.0
    for c in range(3):
        step = course.dt * motion[i, c] - (course.now[3, c] - course.before[3, c])
        square += step * step
    return sqrt(square) + course.turned


@piece
def images(along, low, high, radius, period):
    """First and last image along an axis that may be nearer than ``radius`` to a place ``along`` from the mesh's point."""
    if period == 0.0:
        return 0, 0
    return np.int64(ceil((along - high - radius) / period)), np.int64(floor((along - low + radius) / period))


@kernel(parallel=True)
def near_mesh(place, motion, frozen, course, extent, reach, shape, tree, begin, triangle, image, clear, counts):
    """Count the triangles nearer to the surface of each grain than ``reach``, or within the way that it came in the last step;
    where there is room, list them, their image and distance from ``begin`` on, by patch. ``counts``, ``triangle``, ``image`` and
    ``clear`` are modified.

    Args:
        extent: (2, 3) lowest and highest corner of a box around the mesh, from its point.
    """
    listing = triangle.shape[0] > 0
    for i in prange(counts.shape[0]):
        count = 0
        if frozen[i] == 0 and (counts[i] > 0 or not listing):
            radius = max(place[i, 3] + reach, 1.001 * way_of(motion, i, course))
            dx, dy, dz = place[i, 0] - course.now[3, 0], place[i, 1] - course.now[3, 1], place[i, 2] - course.now[3, 2]
            ax, bx = images(dx, extent[0, 0], extent[1, 0], radius, course.period[0])
            ay, by = images(dy, extent[0, 1], extent[1, 1], radius, course.period[1])
            az, bz = images(dz, extent[0, 2], extent[1, 2], radius, course.period[2])
            for number in range((bx - ax + 1) * (by - ay + 1) * (bz - az + 1)):
                mx = ax + number % (bx - ax + 1)
                my = ay + number // (bx - ax + 1) % (by - ay + 1)
                mz = az + number // ((bx - ax + 1) * (by - ay + 1))
                x, y, z = dx - mx * course.period[0], dy - my * course.period[1], dz - mz * course.period[2]
                x, y, z = into(course.now, x, y, z)
                node = 0
                while node < tree.skip.shape[0]:
                    if beside_box(tree, node, x, y, z) >= radius * radius:
                        node = tree.skip[node]
                        continue
                    for t in range(tree.first[node], tree.first[node] + tree.count[node]):
                        distance = inf if beside_triangle(shape, t, x, y, z, radius) else nearest_of(shape, t, x, y, z)[0]
                        if distance < radius:
                            if listing:
                                place_by_patch(begin[i], count, t, (mx, my, mz), distance, shape.patch, triangle, image, clear)
                            count += 1
                    node += 1
        counts[i] = count


@piece
def place_by_patch(begin, count, t, where, distance, patch, triangle, image, clear):
    """Put a triangle among ``count`` others, after those of its patch and of lower ones."""
    e = begin + count
    while e > begin and patch[triangle[e - 1]] > patch[t]:
        triangle[e], clear[e] = triangle[e - 1], clear[e - 1]
        for c in range(3):
            image[e, c] = image[e - 1, c]
        e -= 1
    triangle[e], clear[e] = t, distance
    image[e, 0], image[e, 1], image[e, 2] = where


@piece
def across(nearby, course, place, i, g, e, c):
    """Coordinate ``c`` of a grain from the point of the image of the mesh that entry ``e`` is in: the same bits whenever it was
    listed."""
    number, went = nearby.image[e, c], place[i, c] - nearby.then[g, c]
    number += 1 if went > course.half_period[c] else 0
    number -= 1 if went < -course.half_period[c] else 0
    return (place[i, c] - course.now[3, c]) - number * course.period[c]


@piece
def from_image(nearby, course, place, i, g, e):
    """Place of a grain from the point of that image."""
    return (
        across(nearby, course, place, i, g, e, 0),
        across(nearby, course, place, i, g, e, 1),
        across(nearby, course, place, i, g, e, 2),
    )


@piece
def a_step_before(course, motion, i, dx, dy, dz):
    """The same a step before, in the frame of the mesh as it was then."""
    dx = dx - course.dt * motion[i, 0] + (course.now[3, 0] - course.before[3, 0])
    dy = dy - course.dt * motion[i, 1] + (course.now[3, 1] - course.before[3, 1])
    dz = dz - course.dt * motion[i, 2] + (course.now[3, 2] - course.before[3, 2])
    return into(course.before, dx, dy, dz)
