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


@helper
def nearest_image(dx, dy, dz, length, half, tilt):
    """Minimum image of a difference; what is beyond a face may lie aside, as in ``Box.tilt``."""
    above, below = dz > half[2], dz < -half[2]
    dz = dz - length[2] if above else dz
    dz = dz + length[2] if below else dz
    dx = dx - tilt[1] if above else dx
    dx = dx + tilt[1] if below else dx
    dy = dy - tilt[2] if above else dy
    dy = dy + tilt[2] if below else dy
    above, below = dy > half[1], dy < -half[1]
    dy = dy - length[1] if above else dy
    dy = dy + length[1] if below else dy
    dx = dx - tilt[0] if above else dx
    dx = dx + tilt[0] if below else dx
    above, below = dx > half[0], dx < -half[0]
    dx = dx - length[0] if above else dx
    dx = dx + length[0] if below else dx
    return dx, dy, dz


@kernel(parallel=True)
def kick_drift_wrap(place, motion, spin, image, force, torque, low, length, half, tilt, dt):
    """v(n-1/2) -> v(n+1/2), x(n) -> x(n+1), omega likewise; frozen grains (inverse mass 0) keep their velocity.

    ``place``, ``motion``, ``spin`` and ``image`` are modified.

    Returns (largest square of a velocity, grains outside the box or not finite).
    """
    fastest = 0.0
    bad = 0
    for i in prange(force.shape[0]):
        inside = True
        for c in (2, 1, 0):
            motion[i, c] += dt * motion[i, 3] * force[i, c]
            spin[i, c] += dt * spin[i, 3] * torque[i, c]
            x = place[i, c] + dt * motion[i, c]
            if not (x >= low[c] and x < low[c] + length[c]):  # rare: through a face, outside, or not a number
                x, turns = fold(x, low[c], length[c], half[c])
                image[i, c] += turns
                inside = inside and x >= low[c] and x <= low[c] + length[c]
                if c == 2:  # beyond it all lies aside
                    place[i, 1] -= turns * tilt[2]
                if c > 0:
                    place[i, 0] -= turns * tilt[c - 1]
            place[i, c] = x
        bad += 0 if inside else 1
        fastest = max(fastest, motion[i, 0] * motion[i, 0] + motion[i, 1] * motion[i, 1] + motion[i, 2] * motion[i, 2])
    return fastest, bad


@helper
def carried_along(x, y, z, centre, ratio, slide):
    """Where a place is carried by a box that is deformed about its centre."""
    ax, ay, az = x - centre[0], y - centre[1], z - centre[2]
    x = centre[0] + ax * ratio[0] if ratio[0] != 1.0 else x
    y = centre[1] + ay * ratio[1] if ratio[1] != 1.0 else y
    z = centre[2] + az * ratio[2] if ratio[2] != 1.0 else z
    return x + (slide[0] * ay + slide[1] * az), y + slide[2] * az, z


@kernel(parallel=True)
def stretch(place, motion, image, seen, centre, ratio, slower, slide, drag, turns):
    """Places and velocities of grains in a box that is deformed about its centre; see ``Box.stretch``. Frozen grains keep their
    velocity. ``place``, ``motion``, ``image``, and ``seen``, where the grains were at the rebuild, (4, ...), are modified."""
    for i in prange(place.shape[0]):
        place[i, 0], place[i, 1], place[i, 2] = carried_along(place[i, 0], place[i, 1], place[i, 2], centre, ratio, slide)
        seen[0, i], seen[1, i], seen[2, i] = carried_along(seen[0, i], seen[1, i], seen[2, i], centre, ratio, slide)
        image[i, 0] += turns[0] * image[i, 1] + turns[1] * image[i, 2]
        image[i, 1] += turns[2] * image[i, 2]
        if motion[i, 3] != 0.0:
            vx, vy, vz = motion[i, 0], motion[i, 1], motion[i, 2]
            motion[i, 0] = vx * slower[0] - (drag[0] * vy + drag[1] * vz)
            motion[i, 1] = vy * slower[1] - drag[2] * vz
            motion[i, 2] = vz * slower[2]


kick_drift_wrap_alone = on_one_thread(kick_drift_wrap)


@kernel(parallel=True)
def displacements(place, seen, length, half, tilt):
    """Displacements since the grains were ``seen``: the largest along x, -x, y, -y, z, -z, and the square of the largest."""
    east = -1e300
    west = -1e300
    north = -1e300
    south = -1e300
    up = -1e300
    down = -1e300
    farthest = 0.0
    for i in prange(place.shape[0]):
        dx, dy, dz = place[i, 0] - seen[0, i], place[i, 1] - seen[1, i], place[i, 2] - seen[2, i]
        dx, dy, dz = nearest_image(dx, dy, dz, length, half, tilt)
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
def measure_travel(place, seen, point, point_then, length, half, tilt, travel):
    """Write how far grains and walls are from where they were then into ``travel``: along each axis and against it, and the
    square of the farthest."""
    travel[0], travel[1], travel[2], travel[3], travel[4], travel[5], travel[6] = displacements_alone(
        place, seen, length, half, tilt
    )
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
