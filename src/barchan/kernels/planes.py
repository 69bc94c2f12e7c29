"""Geometry of plane walls."""

from barchan.kernels.compiler import kernel, on_one_thread, prange


@kernel(parallel=True)
def measure_plane(grain, place, begin, end, point, normal, half, velocity, omega, surface):
    """Write distance, normals, wall velocity and curvature of the contacts ``begin`` to ``end`` into ``surface``, which
    is modified.

    Args:
        normal, half: unit normal at the full step and at the half step: they differ where the plane turns about ``point``.
        omega: angular velocity.
    """
    for k in prange(end - begin):
        i = grain[begin + k]
        column = begin + k
        dx, dy, dz = place[i, 0] - point[0], place[i, 1] - point[1], place[i, 2] - point[2]
        distance = dx * normal[0] + dy * normal[1] + dz * normal[2]
        surface[0, column] = distance
        for c in range(3):
            surface[1 + c, column] = normal[c]
            surface[4 + c, column] = half[c]
        cx, cy, cz = dx - distance * normal[0], dy - distance * normal[1], dz - distance * normal[2]
        surface[7, column] = velocity[0] + (omega[1] * cz - omega[2] * cy)
        surface[8, column] = velocity[1] + (omega[2] * cx - omega[0] * cz)
        surface[9, column] = velocity[2] + (omega[0] * cy - omega[1] * cx)
        surface[10, column] = 0.0


measure_plane_alone = on_one_thread(measure_plane)


@kernel()
def near_plane(place, frozen, point, normal, reach, found):
    """Write the rows of the grains whose surface is nearer to a plane than ``reach``, and which can move, into ``found``,
    ascending; returns how many there are."""
    count = 0
    for i in range(place.shape[0]):
        distance = 0.0
        for c in range(3):
            distance += (place[i, c] - point[c]) * normal[c]
        found[count] = i
        count += (distance < place[i, 3] + reach) & (frozen[i] == 0)
    return count
