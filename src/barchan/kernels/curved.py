"""Geometry of walls that are round about an axis or a point: cylinders, spheres and cones."""

from math import sqrt

from barchan.kernels.compiler import helper, kernel, prange


@helper
def split(dx, dy, dz, ax, ay, az, along):
    """Distance from an axis (``along`` 1) or a point (0), the unit vector away from it, and the coordinate along the axis."""
    z = along * (dx * ax + dy * ay + dz * az)
    dx, dy, dz = dx - z * ax, dy - z * ay, dz - z * az
    r = sqrt(dx * dx + dy * dy + dz * dz)
    if r == 0.0:  # on the axis every direction across is as good
        dx, dy, dz = (0.0, -az, ay) if abs(ax) < 0.5 else (-az, 0.0, ax)
        if along == 0.0:
            dx, dy, dz = 1.0, 0.0, 0.0
        scale = 1.0 / sqrt(dx * dx + dy * dy + dz * dz)
        return r, dx * scale, dy * scale, dz * scale, z
    return r, dx / r, dy / r, dz / r, z


@helper
def from_round(dx, dy, dz, ax, ay, az, along, radius, side):
    """Distance from a cylinder (``along`` 1) or sphere (0), and its normal there: outwards for ``side`` 1, inwards for -1."""
    r, ux, uy, uz, _ = split(dx, dy, dz, ax, ay, az, along)
    return side * (r - radius), side * ux, side * uy, side * uz


@helper
def from_cone(dx, dy, dz, ax, ay, az, low, high, length):
    """Distance from the shell of a cone between its rims, the unit vector away from the nearest point of it, the radius there
    and how much of the vector is away from the axis."""
    r, ux, uy, uz, z = split(dx, dy, dz, ax, ay, az, 1.0)
    slope = high - low
    part = ((r - low) * slope + z * length) / (slope * slope + length * length)
    part = min(max(part, 0.0), 1.0)
    radius = low + part * slope
    across, up = r - radius, z - part * length
    distance = sqrt(across * across + up * up)
    if distance == 0.0:  # a centre on the shell itself: as if it were inside
        across, up, norm = -length, slope, sqrt(slope * slope + length * length)
    else:
        norm = distance
    across, up = across / norm, up / norm
    return distance, across * ux + up * ax, across * uy + up * ay, across * uz + up * az, radius, across


@kernel(parallel=True)
def measure_round(grain, place, motion, begin, end, point, axis, shape, drive, dt, surface):
    """Write the geometry of the contacts ``begin`` to ``end`` of a cylinder or sphere into ``surface``, which is modified.

    Args:
        shape: (3,) radius, side, 1 for a cylinder or 0 for a sphere.
        drive: (7,) velocity, angular velocity, rate at which the radius grows.
    """
    for k in prange(end - begin):
        i, column = grain[begin + k], begin + k
        radius, side, along = shape[0], shape[1], shape[2]
        dx, dy, dz = place[i, 0] - point[0], place[i, 1] - point[1], place[i, 2] - point[2]
        distance, nx, ny, nz = from_round(dx, dy, dz, axis[0], axis[1], axis[2], along, radius, side)
        vx, vy, vz = drive[0], drive[1], drive[2]
        hx = dx - 0.5 * dt * (motion[i, 0] - vx)
        hy = dy - 0.5 * dt * (motion[i, 1] - vy)
        hz = dz - 0.5 * dt * (motion[i, 2] - vz)
        _, hx, hy, hz = from_round(hx, hy, hz, axis[0], axis[1], axis[2], along, radius, side)
        growth = side * drive[6]
        _fill(surface, column, distance, nx, ny, nz, hx, hy, hz)
        _fill_velocity(surface, column, dx, dy, dz, drive, growth)
        surface[10, column] = side * (1.0 - 0.5 * along) / radius


@kernel(parallel=True)
def measure_cone(grain, place, motion, begin, end, point, axis, shape, drive, dt, surface):
    """The same for the shell of a cone; ``shape``: (3,) radii of its rims and its length."""
    for k in prange(end - begin):
        i, column = grain[begin + k], begin + k
        low, high, length = shape[0], shape[1], shape[2]
        dx, dy, dz = place[i, 0] - point[0], place[i, 1] - point[1], place[i, 2] - point[2]
        distance, nx, ny, nz, radius, across = from_cone(dx, dy, dz, axis[0], axis[1], axis[2], low, high, length)
        hx = dx - 0.5 * dt * (motion[i, 0] - drive[0])
        hy = dy - 0.5 * dt * (motion[i, 1] - drive[1])
        hz = dz - 0.5 * dt * (motion[i, 2] - drive[2])
        _, hx, hy, hz, _, _ = from_cone(hx, hy, hz, axis[0], axis[1], axis[2], low, high, length)
        _fill(surface, column, distance, nx, ny, nz, hx, hy, hz)
        _fill_velocity(surface, column, dx, dy, dz, drive, 0.0)
        surface[10, column] = 0.5 * across / max(radius, place[i, 3])


@helper
def _fill(surface, column, distance, nx, ny, nz, hx, hy, hz):
    surface[0, column] = distance
    surface[1, column], surface[2, column], surface[3, column] = nx, ny, nz
    surface[4, column], surface[5, column], surface[6, column] = hx, hy, hz


@helper
def _fill_velocity(surface, column, dx, dy, dz, drive, growth):
    """Velocity of the wall at the contact: v + omega x (contact - point), and what its radius grows."""
    distance, nx, ny, nz = surface[0, column], surface[1, column], surface[2, column], surface[3, column]
    cx, cy, cz = dx - distance * nx, dy - distance * ny, dz - distance * nz
    wx, wy, wz = drive[3], drive[4], drive[5]
    surface[7, column] = drive[0] + wy * cz - wz * cy + growth * nx
    surface[8, column] = drive[1] + wz * cx - wx * cz + growth * ny
    surface[9, column] = drive[2] + wx * cy - wy * cx + growth * nz


@kernel()
def near_round(place, frozen, point, axis, shape, reach, found):
    """Write the rows of the grains whose surface is nearer to a cylinder or sphere than ``reach``, and which can move, into
    ``found``, ascending; returns how many there are."""
    count = 0
    for i in range(place.shape[0]):
        dx, dy, dz = place[i, 0] - point[0], place[i, 1] - point[1], place[i, 2] - point[2]
        distance, _, _, _ = from_round(dx, dy, dz, axis[0], axis[1], axis[2], shape[2], shape[0], shape[1])
        found[count] = i
        count += (distance < place[i, 3] + reach) & (frozen[i] == 0)
    return count


@kernel()
def near_cone(place, frozen, point, axis, shape, reach, found):
    """The same for the shell of a cone."""
    count = 0
    for i in range(place.shape[0]):
        dx, dy, dz = place[i, 0] - point[0], place[i, 1] - point[1], place[i, 2] - point[2]
        distance, _, _, _, _, _ = from_cone(dx, dy, dz, axis[0], axis[1], axis[2], shape[0], shape[1], shape[2])
        found[count] = i
        count += (distance < place[i, 3] + reach) & (frozen[i] == 0)
    return count


@kernel(parallel=True)
def distances_round(points, point, axis, shape, found):
    """Write the distances of points (k, 3) from a cylinder or sphere into ``found`` (k,)."""
    for i in prange(points.shape[0]):
        dx, dy, dz = points[i, 0] - point[0], points[i, 1] - point[1], points[i, 2] - point[2]
        found[i], _, _, _ = from_round(dx, dy, dz, axis[0], axis[1], axis[2], shape[2], shape[0], shape[1])


@kernel(parallel=True)
def distances_cone(points, point, axis, shape, found):
    """The same from the shell of a cone."""
    for i in prange(points.shape[0]):
        dx, dy, dz = points[i, 0] - point[0], points[i, 1] - point[1], points[i, 2] - point[2]
        found[i], _, _, _, _, _ = from_cone(dx, dy, dz, axis[0], axis[1], axis[2], shape[0], shape[1], shape[2])
