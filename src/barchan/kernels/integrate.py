"""Moves grains by one step of the leap-frog, equations (11) and (12), and folds them into the box."""

from math import sqrt

from barchan.kernels.compiler import helper, kernel, on_one_thread, prange


@helper
def fold(x, low, length, half):
    """``x`` folded into the period that begins at ``low``, and the image it came from; ``half`` is infinite if there is none."""
    turns = 0
    if half < 1e300:
        if x < low:
            x += length
            turns -= 1
        if x >= low + length:
            x = max(x - length, low)  # rounding must not take it below the face
            turns += 1
    return x, turns


@helper
def nearest(d, length, half):
    """Minimum image of a difference."""
    if d > half:
        d -= length
    if d < -half:
        d += length
    return d


@kernel(parallel=True)
def kick_drift_wrap(place, motion, spin, image, force, torque, low, length, half, dt):
    """v(n-1/2) -> v(n+1/2), x(n) -> x(n+1), omega likewise; frozen grains (inverse mass 0) keep their velocity.

    ``place``, ``motion``, ``spin`` and ``image`` are modified.

    Returns (largest square of a velocity, grains outside the box or not finite).
    """
    fastest = 0.0
    bad = 0
    for i in prange(force.shape[0]):
        inside = True
        for c in range(3):
            motion[i, c] += dt * motion[i, 3] * force[i, c]
            spin[i, c] += dt * spin[i, 3] * torque[i, c]
            x = place[i, c] + dt * motion[i, c]
            if not (x >= low[c] and x < low[c] + length[c]):  # rare: through a face, outside, or not a number
                x, turns = fold(x, low[c], length[c], half[c])
                image[i, c] += turns
                inside = inside and x >= low[c] and x <= low[c] + length[c]
            place[i, c] = x
        bad += 0 if inside else 1
        fastest = max(fastest, motion[i, 0] * motion[i, 0] + motion[i, 1] * motion[i, 1] + motion[i, 2] * motion[i, 2])
    return fastest, bad


@kernel(parallel=True)
def stretch(place, motion, seen, centre, ratio, slower):
    """Places and velocities of grains in a box that is stretched about its centre; see ``Box.stretch``. Frozen grains keep their
    velocity. ``place``, ``motion``, and ``seen``, where the grains were at the rebuild, (4, ...), are modified."""
    for i in prange(place.shape[0]):
        for c in range(3):
            if ratio[c] != 1.0:
                place[i, c] = centre[c] + (place[i, c] - centre[c]) * ratio[c]
                seen[c, i] = centre[c] + (seen[c, i] - centre[c]) * ratio[c]
            motion[i, c] *= slower[c] if motion[i, 3] != 0.0 else 1.0


kick_drift_wrap_alone = on_one_thread(kick_drift_wrap)


@kernel(parallel=True)
def displacements(place, seen, length, half):
    """Displacements since the grains were ``seen``: the largest along x, -x, y, -y, z, -z, and the square of the largest."""
    east = -1e300
    west = -1e300
    north = -1e300
    south = -1e300
    up = -1e300
    down = -1e300
    farthest = 0.0
    for i in prange(place.shape[0]):
        dx = nearest(place[i, 0] - seen[0, i], length[0], half[0])
        dy = nearest(place[i, 1] - seen[1, i], length[1], half[1])
        dz = nearest(place[i, 2] - seen[2, i], length[2], half[2])
        east = max(east, dx)
        west = max(west, -dx)
        north = max(north, dy)
        south = max(south, -dy)
        up = max(up, dz)
        down = max(down, -dz)
        farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return east, west, north, south, up, down, farthest


displacements_alone = on_one_thread(displacements)


@helper
def measure_travel(place, seen, point, point_then, length, half, travel):
    """Write how far grains and walls are from where they were then into ``travel``: along each axis and against it, and the
    square of the farthest."""
    travel[0], travel[1], travel[2], travel[3], travel[4], travel[5], travel[6] = displacements_alone(place, seen, length, half)
    for w in range(point.shape[0]):
        square = 0.0
        for c in range(3):
            d = point[w, c] - point_then[w, c]
            square += d * d
            travel[2 * c], travel[2 * c + 1] = max(travel[2 * c], d), max(travel[2 * c + 1], -d)
        travel[6] = max(travel[6], square)


@helper
def approach_after(travel):
    """Bound on the approach of two surfaces that travelled no further; see ``Staleness``."""
    x, y, z = travel[0] + travel[1], travel[2] + travel[3], travel[4] + travel[5]
    return min(2.0 * sqrt(travel[6]), sqrt(x * x + y * y + z * z))
