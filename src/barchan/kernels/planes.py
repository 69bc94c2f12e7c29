"""Geometry of plane walls."""

from barchan.kernels.compiler import kernel, on_one_thread, prange


@kernel(parallel=True)
def measure_plane(grain, place, begin, end, point, normal, velocity, surface):
    """Write distance, normals, wall velocity and curvature of the contacts ``begin`` to ``end`` into ``surface``, which
    is modified. A plane that moves without turning has the same normal at the half step."""
    for k in prange(end - begin):
        i = grain[begin + k]
        column = begin + k
        distance = 0.0
        for c in range(3):
            distance += (place[i, c] - point[c]) * normal[c]
        surface[0, column] = distance
        for c in range(3):
            surface[1 + c, column] = normal[c]
            surface[4 + c, column] = normal[c]
            surface[7 + c, column] = velocity[c]
        surface[10, column] = 0.0


measure_plane_alone = on_one_thread(measure_plane)


@kernel()
def near_plane(place, frozen, point, normal, skin, found):
    """Write the rows of the grains whose surface is nearer to a plane than ``skin``, and which can move, into ``found``,
    ascending; returns how many there are."""
    count = 0
    for i in range(place.shape[0]):
        distance = 0.0
        for c in range(3):
            distance += (place[i, c] - point[c]) * normal[c]
        found[count] = i
        count += (distance < place[i, 3] + skin) & (frozen[i] == 0)
    return count
