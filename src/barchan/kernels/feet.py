"""Where grains touch a mesh.

A grain touches a mesh where its distance from it is least: at a *foot*. Each patch of the mesh has one at most (that is how
patches are made, ``walls/topology.py``); it counts if no triangle that it lies on leads nearer, and if no nearer one stands for
it: on one smooth surface, of feet whose directions differ by less than the feature angle the nearest alone counts. So a plane cut
into triangles is one contact, an edge that sticks out is one, a corner that goes in is two, and a grain that rests on bumps has
one with each. Where a foot goes on to another patch, the memory of the contact goes with it.
"""

from math import inf, sqrt

from barchan.kernels.compiler import kernel, on_one_thread, piece, prange
from barchan.kernels.meshes import a_step_before, from_image, into, out_of, way_of
from barchan.kernels.triangles import EDGE, FACE, VERTEX, beside_triangle, crosses, from_feature, nearest_of, outwards

#: Two feet nearer than this, relative to the radius, are one.
SAME = 1e-9

#: Where a contact is, relative to the radius, that another one stands for.
AWAY = 1e6

#: A bound on a distance is taken for larger by this factor: rounding.
ROUNDED = 1.0 + 1e-9

#: How far a grain goes, relative to its radius, before its distances are taken anew (measured: half to twice that is as good).
STRAYED = 0.05

#: Nobody stands for it yet; there is nothing to stand for.
OPEN, NONE = -1, -2


@piece
def needed(i, g, nearby, course, motion, radius, slot, number, x, y, z):
    """Which entries matter in this step: those that were not farther than this when ``clear`` was taken. A contact that may begin
    is nearer than the radius, one that lasts no farther than it can have come since, and the centre goes through nothing that
    is farther than its way. ``x``, ``y``, ``z``: the grain, in the image of the first entry."""
    dx, dy, dz = x - nearby.at[g, 0], y - nearby.at[g, 1], z - nearby.at[g, 2]
    moved, far = sqrt(dx * dx + dy * dy + dz * dz), radius
    if course.dt > 0.0:
        far = max(far, way_of(motion, i, course))
    for c in range(nearby.group[g], nearby.group[g + 1]):
        if slot[number + c] != 0:
            least = inf
            for e in range(nearby.entry[c], nearby.entry[c + 1]):
                least = min(least, nearby.clear[e])
            far = max(far, least + moved)
    return moved, ROUNDED * (far + moved)


@piece
def find_feet(i, g, nearby, course, shape, place, motion, slot, number, apart, arm, found, stands):
    """The nearest point of each patch. ``found``: entry and feature; of a patch that the grain went through, an entry of a
    triangle there, and feature -1. Patches that are too far have none; entries that are, are infinitely far ``apart``."""
    way = way_of(motion, i, course) if course.dt > 0.0 else -1.0
    dx, dy, dz = from_image(nearby, course, place, i, g, nearby.entry[nearby.group[g]])
    px, py, pz = into(course.now, dx, dy, dz)
    moved, far = needed(i, g, nearby, course, motion, place[i, 3], slot, number, px, py, pz)
    anew = moved > STRAYED * place[i, 3]
    for c in range(nearby.group[g], nearby.group[g + 1]):
        best, through = inf, -1
        found[c, 0], found[c, 1], stands[c], arm[c, 3] = nearby.entry[c], FACE, NONE, inf
        for e in range(nearby.entry[c], nearby.entry[c + 1]):
            apart[e] = inf
            if nearby.clear[e] > far and not anew:
                continue
            dx, dy, dz = from_image(nearby, course, place, i, g, e)
            x, y, z = into(course.now, dx, dy, dz)
            distance, feature, qx, qy, qz = nearest_of(shape, nearby.triangle[e], x, y, z)
            apart[e] = distance
            if distance < best:
                best, found[c, 0], found[c, 1], stands[c] = distance, e, feature, OPEN
                arm[c, 0], arm[c, 1], arm[c, 2], arm[c, 3] = x - qx, y - qy, z - qz, distance
            if distance <= way:
                ax, ay, az = a_step_before(course, motion, i, dx, dy, dz)
                if crosses(shape, nearby.triangle[e], ax, ay, az, x, y, z, SAME * place[i, 3]):
                    through = e
        if through >= 0:
            found[c, 0], found[c, 1], stands[c] = through, -1, c
    if anew:
        nearby.at[g, 0], nearby.at[g, 1], nearby.at[g, 2] = px, py, pz
        for e in range(nearby.entry[nearby.group[g]], nearby.entry[nearby.group[g + 1]]):
            if nearby.clear[e] >= 0.0:
                nearby.clear[e] = apart[e]


@piece
def drop_hidden(i, g, nearby, course, shape, place, apart, arm, found, stands):
    """Feet at the rim of a patch from where another patch leads nearer are none: that patch stands for them. Those at the back
    of a solid are none, unless the grain's centre is in it."""
    begin, end = nearby.group[g], nearby.group[g + 1]
    nearest = inf
    for c in range(begin, end):
        nearest = min(nearest, arm[c, 3])
    for c in range(begin, end):
        t, feature = nearby.triangle[found[c, 0]], found[c, 1]
        if stands[c] == OPEN and shape.solid != 0 and arm[c, 3] > nearest:
            nx, ny, nz = outwards(shape, t, feature)
            if arm[c, 0] * nx + arm[c, 1] * ny + arm[c, 2] * nz < 0.0:
                stands[c] = NONE
        if stands[c] == OPEN and feature > FACE:
            k = feature - EDGE if feature < VERTEX else feature - VERTEX
            a, b = shape.corners[t, k], shape.corners[t, (k + 1) % 3]
            b = b if feature < VERTEX else a
            if shape.rim[a] != 0 and shape.rim[b] != 0:
                stands[c] = leading_nearer(c, i, g, nearby, course, shape, place, apart, arm)


@piece
def leading_nearer(c, i, g, nearby, course, shape, place, apart, arm):
    """The contact of another patch that has a triangle on which the foot of ``c`` lies, and which is nearer: the nearest of
    these; ``OPEN`` if there is none. Triangles are convex: a nearer point of one is a way there that leads nearer all along.
    Places are compared, not vertices: parts of a mesh may only lie side by side, as images across periodic faces do."""
    best, nearer, near = arm[c, 3], OPEN, SAME * place[i, 3]
    for other in range(nearby.group[g], nearby.group[g + 1]):
        if other != c:
            for e in range(nearby.entry[other], nearby.entry[other + 1]):
                if apart[e] < best:
                    dx, dy, dz = from_image(nearby, course, place, i, g, e)
                    x, y, z = into(course.now, dx, dy, dz)
                    x, y, z = x - arm[c, 0], y - arm[c, 1], z - arm[c, 2]
                    t = nearby.triangle[e]
                    if not beside_triangle(shape, t, x, y, z, near) and nearest_of(shape, t, x, y, z)[0] <= near:
                        best, nearer = apart[e], other
    return nearer


@piece
def together(arm, one, other, radius):
    """Are two feet at one place?"""
    dx, dy, dz = arm[one, 0] - arm[other, 0], arm[one, 1] - arm[other, 1], arm[one, 2] - arm[other, 2]
    return dx * dx + dy * dy + dz * dz <= (SAME * radius) ** 2


@piece
def on_one_surface(one, other, g, nearby, shape, radius, arm, stands):
    """Do two feet lie on one smooth surface? Where several surfaces meet, a foot lies on all of them."""
    for a in range(nearby.group[g], nearby.group[g + 1]):
        if stands[a] == one and together(arm, a, one, radius):
            mine = shape.surface[shape.patch[nearby.triangle[nearby.entry[a]]]]
            for b in range(nearby.group[g], nearby.group[g + 1]):
                if stands[b] == other and together(arm, b, other, radius):
                    if shape.surface[shape.patch[nearby.triangle[nearby.entry[b]]]] == mine:
                        return True
    return False


@piece
def choose(g, nearby, shape, radius, cosine, arm, stands):
    """Of the feet that are left, from the nearest on, each counts and stands for those at the same place, unless one that counts
    is on its surface in about its direction: then that one stands for them, the nearest of these. Of two at one distance the
    lower patch is first."""
    begin, end = nearby.group[g], nearby.group[g + 1]
    while True:
        first = -1
        for c in range(begin, end):
            if stands[c] == OPEN and (first < 0 or arm[c, 3] < arm[first, 3]):
                first = c
        if first < 0:
            break
        for c in range(begin, end):
            if stands[c] == OPEN and together(arm, c, first, radius):
                stands[c] = first
        heir = first
        for c in range(begin, end):
            if stands[c] == c and c != first and (heir == first or arm[c, 3] < arm[heir, 3]):
                along = arm[c, 0] * arm[first, 0] + arm[c, 1] * arm[first, 1] + arm[c, 2] * arm[first, 2]
                if along >= cosine * arm[c, 3] * arm[first, 3]:
                    if on_one_surface(c, first, g, nearby, shape, radius, arm, stands):
                        heir = c
        stands[first] = heir


@piece
def hand_over(i, g, nearby, stands, number, column, slot, history, changed):
    """Where a contact that touched is one no more, the one that stands for it takes up its memory, unless it has one."""
    for c in range(nearby.group[g], nearby.group[g + 1]):
        if slot[number + c] != 0 and stands[c] != c:
            heir = stands[c]
            while heir >= 0 and stands[heir] != heir:
                heir = stands[heir]
            if heir >= 0 and slot[number + heir] == 0:
                for row in range(history.shape[0]):
                    history[row, column + heir] = history[row, column + c]
                slot[number + heir], slot[number + c], changed[i] = column + heir, 0, 1


@piece
def fill(i, g, c, column, nearby, course, shape, place, motion, found, surface):
    """Write the geometry of a contact that counts: distance, normals, velocity of the wall there, curvature."""
    entry, feature = found[c, 0], found[c, 1]
    t, through = nearby.triangle[entry], feature < 0
    feature = FACE if through else feature
    dx, dy, dz = from_image(nearby, course, place, i, g, entry)
    x, y, z = into(course.now, dx, dy, dz)
    distance, nx, ny, nz = from_feature(shape, t, feature, x, y, z)
    hx, hy, hz = nx, ny, nz
    if course.dt > 0.0:
        ax, ay, az = a_step_before(course, motion, i, dx, dy, dz)
        _, hx, hy, hz = from_feature(shape, t, feature, 0.5 * (x + ax), 0.5 * (y + ay), 0.5 * (z + az))
    if through and distance > 0.0:  # back to where it came from
        distance, nx, ny, nz = -distance, -nx, -ny, -nz
        hx, hy, hz = nx, ny, nz
    nx, ny, nz = out_of(course.now, nx, ny, nz)
    hx, hy, hz = out_of(course.half, hx, hy, hz)
    surface[0, column] = distance
    surface[1, column], surface[2, column], surface[3, column] = nx, ny, nz
    surface[4, column], surface[5, column], surface[6, column] = hx, hy, hz
    cx, cy, cz = dx - distance * nx, dy - distance * ny, dz - distance * nz
    wx, wy, wz = course.drive[3], course.drive[4], course.drive[5]
    surface[7, column] = course.drive[0] + (wy * cz - wz * cy)
    surface[8, column] = course.drive[1] + (wz * cx - wx * cz)
    surface[9, column] = course.drive[2] + (wx * cy - wy * cx)
    surface[10, column] = 0.0


@kernel(parallel=True)
def measure_mesh(grain, place, motion, begin, number, column, nearby, course, shape, cosine, apart, arm, found, stands, slot,
                 history, changed, surface):  # fmt: skip
    """Write the geometry of the contacts of a mesh, which begin with ``begin``, into ``surface``, and move the memory of those
    that go on to another patch: ``slot``, ``history`` and ``changed`` are modified.

    Args:
        number, column: of the first of them among all contacts, and of its column.
        cosine: of the feature angle.
        apart, arm, found, stands: room: (entries,) distances; (contacts, 4) vector from the foot and its length, (contacts, 2)
            entry and feature, and (contacts,) which contact stands for it: itself if it counts.
    """
    for g in prange(nearby.group.shape[0] - 1):
        i = grain[begin + nearby.group[g]]
        find_feet(i, g, nearby, course, shape, place, motion, slot, number, apart, arm, found, stands)
        drop_hidden(i, g, nearby, course, shape, place, apart, arm, found, stands)
        choose(g, nearby, shape, place[i, 3], cosine, arm, stands)
        hand_over(i, g, nearby, stands, number, column, slot, history, changed)
        for c in range(nearby.group[g], nearby.group[g + 1]):
            if stands[c] == c:
                fill(i, g, c, begin + c, nearby, course, shape, place, motion, found, surface)
            else:
                for row in range(11):
                    surface[row, begin + c] = 0.0
                surface[0, begin + c] = AWAY * place[i, 3]
                surface[3, begin + c] = surface[6, begin + c] = 1.0


measure_mesh_alone = on_one_thread(measure_mesh)
