"""Laguerre (radical Voronoi) cells: the space nearer to a grain than to any other, by the power distance d^2 - R^2.

A cell starts as its container and is cut by the radical plane of one grain after the other, nearest plane first, of equally
near ones that with the smaller id, until no further plane can reach it (the security radius of Rycroft, Chaos 19, 041111, 2009,
with radii). That order does not depend on how grains are stored or found, so neither does a bit of the result.

A cell is kept face by face, as polygons on end, twice: a cut reads one copy and writes the other. Each face is cut on its own and
the new one is spanned by all points where edges were cut, sorted by their angle around their mean: equally distant
grains, as in lattices, then give faces without area instead of a polyhedron that does not close.
"""

from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import helper, kernel, prange, subroutine

#: What lies beyond a face of the container: -1 - 2 axis - side.
CONTAINER = -1

#: Corners this near to a plane, over the size of the cell, are taken to lie on it; those this near to one another are one.
ON_PLANE, ONE_POINT = 1e-12, 1e-10

#: What ``_gather`` tells of a grain at whose place there is one that goes before it.
NO_CELL = -1

#: What ``find_laguerre_cells`` tells of a chunk whose rooms were too small: which.
TOO_FEW_FACES, TOO_FEW_CORNERS, TOO_FEW_NEAR = -1, -2, -3


class Sites(NamedTuple):
    """The grains that may share a face with others, sorted into a grid for each size class.

    ``place``: (n, 4) positions and radii [length]. ``id``: (n,). ``largest``: (classes,) radii [length]. ``low``, ``inverse``,
    ``shape``: (classes, 3) corner of each grid [length], 1 / edge of a cell and how many cells; ``first``: (classes,) number of
    its first cell, along x first. ``start``, ``rows``: (cells + 1,), (n,) where each cell begins, and its rows.
    """

    place: np.ndarray
    id: np.ndarray
    largest: np.ndarray
    low: np.ndarray
    inverse: np.ndarray
    shape: np.ndarray
    first: np.ndarray
    start: np.ndarray
    rows: np.ndarray


class Work(NamedTuple):
    """Room of each chunk to work in.

    ``corner``: (chunks, 2, corners, 4) x, y, z from the grain, height above the plane that cuts. ``face``: (chunks, 2, faces, 2)
    first corner, row of the grain beyond. ``cut``: (chunks, faces, 4) x, y, z, angle of the corners of a new face. ``near``:
    (chunks, candidates) distances of radical planes, a heap; ``which``: their rows.
    """

    corner: np.ndarray
    face: np.ndarray
    cut: np.ndarray
    near: np.ndarray
    which: np.ndarray


class Faces(NamedTuple):
    """What was found. ``volume``: (n,) of the cells [length^3]. ``size``: (n,) distance of the furthest corner [length].
    ``count``: (n,) faces of each. ``row``: (chunks, room) row of the grain beyond each face, or of which face of the container it
    is a part. ``area``: (chunks, room, 3) vector areas, outwards [length^2]."""

    volume: np.ndarray
    size: np.ndarray
    count: np.ndarray
    row: np.ndarray
    area: np.ndarray


class Plane(NamedTuple):
    """x . (nx, ny, nz) = h from the grain, and the row of the grain beyond it."""

    nx: float
    ny: float
    nz: float
    h: float
    row: int


@kernel(parallel=True)
def find_laguerre_cells(sites, low, high, guess, n, work, faces, found):
    """Cells of the first ``n`` sites within the container from ``low`` to ``high`` (3,), which holds their centres.

    ``work`` and ``faces`` are modified, and ``found`` (chunks,): how many faces each chunk has, or what it had too little room
    for. ``guess``: how far away planes may be that matter [length]; any will do.
    """
    chunks = found.shape[0]  # no part of a tuple: what a parallel loop writes there is lost
    for chunk in prange(chunks):
        begin, over = chunk * n // chunks, (chunk + 1) * n // chunks
        found[chunk] = _find_cells(chunk, begin, over, sites, low, high, guess, work, faces)


@subroutine
def _find_cells(chunk, begin, over, sites, low, high, guess, work, faces):
    """Cells of one chunk; how many faces they have, or what there was too little room for."""
    corner, face, cut = work.corner[chunk], work.face[chunk], work.cut[chunk]
    near, which = work.near[chunk], work.which[chunk]
    total, far = 0, guess
    for i in range(begin, over):
        found, far = _find_cell(i, sites, low, high, far, corner, face, cut, near, which)
        if found < 0:
            return found
        side, n_faces = found % 2, found // 2
        faces.volume[i] = _measure(corner[side], face[side], n_faces, total, faces.row[chunk], faces.area[chunk])
        faces.size[i], faces.count[i] = _size(corner[side], face[side, n_faces, 0]), n_faces
        total += n_faces
    return total


@subroutine
def _find_cell(i, sites, low, high, far, corner, face, cut, near, which):
    """Twice the number of faces of the cell of grain ``i``, and 1 if they are in the second copy; how far planes that matter
    were."""
    x, y, z = sites.place[i, 0], sites.place[i, 1], sites.place[i, 2]
    while True:
        n_near = _gather(i, far, sites, near, which)
        if n_near > near.shape[0]:
            return TOO_FEW_NEAR, far
        if n_near == NO_CELL:
            face[0, 0, 0] = 0
            return 0, far
        side, n_faces = (
            0,
            _container(corner[0], face[0], (low[0] - x, low[1] - y, low[2] - z), (high[0] - x, high[1] - y, high[2] - z)),
        )
        size = _size(corner[0], face[0, n_faces, 0])
        while n_near > 0 and near[0] <= size:
            h, j = near[0], which[0]
            n_near = _drop_first(near, which, sites.id, n_near)
            dx, dy, dz = sites.place[j, 0] - x, sites.place[j, 1] - y, sites.place[j, 2] - z
            d = np.sqrt(dx * dx + dy * dy + dz * dz)
            left = _clip(corner, face, cut, side, n_faces, size, Plane(dx / d, dy / d, dz / d, h, j))
            if left == n_faces * 2 + side:
                continue
            if left < 0:
                return left, far
            side, n_faces = left % 2, left // 2
            size = _size(corner[side], face[side, n_faces, 0])
        if size <= far:
            return 2 * n_faces + side, 1.1 * size if n_faces > 0 else far
        far = min(1.001 * size, 2.0 * far)


@subroutine
def _gather(i, far, sites, near, which):
    """Put all grains whose radical plane with ``i`` is at most ``far`` away into the heap; returns how many there are, negative
    if another has the cell."""
    x, y, z, radius = sites.place[i, 0], sites.place[i, 1], sites.place[i, 2], sites.place[i, 3]
    count = 0
    for c in range(sites.largest.shape[0]):
        rest = far * far + sites.largest[c] * sites.largest[c] - radius * radius
        if rest < 0.0:
            continue  # grains so much smaller have their plane further away, wherever they are
        distance = far + np.sqrt(rest)
        west, east = _cells_between(x - distance, x + distance, 0, c, sites)
        south, north = _cells_between(y - distance, y + distance, 1, c, sites)
        bottom, top = _cells_between(z - distance, z + distance, 2, c, sites)
        for cz in range(bottom, top + 1):
            for cy in range(south, north + 1):
                line = sites.first[c] + (cz * sites.shape[c, 1] + cy) * sites.shape[c, 0]
                for k in range(sites.start[line + west], sites.start[line + east + 1]):
                    j = sites.rows[k]
                    dx, dy, dz = sites.place[j, 0] - x, sites.place[j, 1] - y, sites.place[j, 2] - z
                    square = dx * dx + dy * dy + dz * dz
                    if square == 0.0 and j != i and _has_the_cell(j, i, sites):
                        return NO_CELL
                    h = 0.5 * (square + (radius - sites.place[j, 3]) * (radius + sites.place[j, 3])) / np.sqrt(square)
                    if square > 0.0 and h <= far:
                        if count < near.shape[0]:
                            _add(near, which, sites.id, count, h, j)
                        count += 1
    return count


@helper
def _has_the_cell(j, i, sites):
    """Of two grains at one place, whether ``j`` has the cell: the larger, of equal ones that with the smaller id."""
    return sites.place[j, 3] > sites.place[i, 3] or (sites.place[j, 3] == sites.place[i, 3] and sites.id[j] < sites.id[i])


@helper
def _cells_between(low, high, axis, c, sites):
    """First and last cell of a grid along an axis between two coordinates; none if they lie beside it."""
    last = sites.shape[c, axis] - 1.0
    below = np.floor((low - sites.low[c, axis]) * sites.inverse[c, axis])
    above = np.floor((high - sites.low[c, axis]) * sites.inverse[c, axis])
    return int(min(max(below, 0.0), last + 1.0)), int(min(max(above, -1.0), last))


@kernel(parallel=True)
def find_site_cells(place, sites, cell):
    """Write the cell of each site into ``cell`` (n,)."""
    for i in prange(place.shape[0]):
        c = 0
        while place[i, 3] > sites.largest[c]:
            c += 1
        number = 0
        for axis in range(2, -1, -1):
            along = np.floor((place[i, axis] - sites.low[c, axis]) * sites.inverse[c, axis])
            number = number * sites.shape[c, axis] + int(min(max(along, 0.0), sites.shape[c, axis] - 1.0))
        cell[i] = sites.first[c] + number


@helper
def _before(h, j, other, k, id):
    """Whether a plane is cut before another: the nearer first, then that of the smaller id, of its images that with the smaller
    row."""
    return h < other or (h == other and (id[j] < id[k] or (id[j] == id[k] and j < k)))


@helper
def _add(near, which, id, count, h, j):
    """Add a plane to a heap of ``count``."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if not _before(h, j, near[above], which[above], id):
            break
        near[at], which[at] = near[above], which[above]
        at = above
    near[at], which[at] = h, j


@subroutine
def _drop_first(near, which, id, count):
    """Take the first plane from a heap of ``count``; returns how many are left."""
    last = count - 1
    h, j, at = near[last], which[last], 0
    while 2 * at + 1 < last:
        below = 2 * at + 1
        if below + 1 < last and _before(near[below + 1], which[below + 1], near[below], which[below], id):
            below += 1
        if not _before(near[below], which[below], h, j, id):
            break
        near[at], which[at] = near[below], which[below]
        at = below
    near[at], which[at] = h, j
    return last


@subroutine
def _container(corner, face, low, high):
    """Write the faces of a box from ``low`` to ``high``, three numbers each from the grain; returns how many."""
    for f in range(6):
        axis, upper = f // 2, f % 2
        across, along = (axis + 1) % 3, (axis + 2) % 3
        for k in range(4):
            q = k if upper else 3 - k
            corner[4 * f + k, axis] = high[axis] if upper else low[axis]
            corner[4 * f + k, across] = high[across] if q == 1 or q == 2 else low[across]
            corner[4 * f + k, along] = high[along] if q >= 2 else low[along]
        face[f, 0], face[f, 1] = 4 * f, CONTAINER - f
    face[6, 0] = 24
    return 6


@helper
def _size(corner, n_corners):
    """Distance of the corner that is furthest from the grain."""
    square = 0.0
    for k in range(n_corners):
        square = max(square, corner[k, 0] * corner[k, 0] + corner[k, 1] * corner[k, 1] + corner[k, 2] * corner[k, 2])
    return np.sqrt(square)


@subroutine
def _clip(corner, face, cut, side, n_faces, size, plane):
    """Cut the cell in copy ``side`` by a plane. Twice the number of faces that are left, and the copy where they are; that which
    was there if the plane does not reach the cell; negative if there is too little room."""
    old, new = corner[side], corner[1 - side]
    beyond, here = ON_PLANE * size, False
    for k in range(face[side, n_faces, 0]):
        old[k, 3] = plane.nx * old[k, 0] + plane.ny * old[k, 1] + plane.nz * old[k, 2] - plane.h
        here |= old[k, 3] > beyond
    if not here:
        return 2 * n_faces + side
    left, n_corners, n_cut = 0, 0, 0
    for f in range(n_faces):
        begin, over = face[side, f, 0], face[side, f + 1, 0]
        if n_corners + 2 * (over - begin) > new.shape[0]:
            return TOO_FEW_CORNERS
        if n_cut + 2 * (over - begin) > cut.shape[0]:
            return TOO_FEW_FACES
        first = n_corners
        for k in range(begin, over):
            after = k + 1 if k + 1 < over else begin
            if old[k, 3] <= beyond:
                new[n_corners, 0], new[n_corners, 1], new[n_corners, 2] = old[k, 0], old[k, 1], old[k, 2]
                n_corners += 1
            if (old[k, 3] <= beyond) != (old[after, 3] <= beyond):
                part = old[k, 3] / (old[k, 3] - old[after, 3])
                for c in range(3):
                    new[n_corners, c] = cut[n_cut, c] = old[k, c] + part * (old[after, c] - old[k, c])
                n_corners, n_cut = n_corners + 1, n_cut + 1
        if n_corners - first >= 3:
            face[1 - side, left, 0], face[1 - side, left, 1] = first, face[side, f, 1]
            left += 1
        else:
            n_corners = first
    if left + 2 > face.shape[1]:
        return TOO_FEW_FACES
    if n_corners + n_cut > new.shape[0]:
        return TOO_FEW_CORNERS
    added = _new_face(cut, n_cut, new, n_corners, ONE_POINT * size, plane) if left > 0 else 0
    if added:
        face[1 - side, left, 0], face[1 - side, left, 1] = n_corners, plane.row
        left, n_corners = left + 1, n_corners + added
    face[1 - side, left, 0] = n_corners
    return 2 * left + 1 - side


@subroutine
def _new_face(cut, n_cut, new, begin, apart, plane):
    """Write the corners of the face that a cut has left, in order around its normal; returns how many, 0 if it has no area."""
    x = y = z = 0.0
    for k in range(n_cut):
        x, y, z = x + cut[k, 0], y + cut[k, 1], z + cut[k, 2]
    x, y, z = x / max(n_cut, 1), y / max(n_cut, 1), z / max(n_cut, 1)
    if abs(plane.nx) < 0.6:
        ux, uy, uz = 0.0, plane.nz, -plane.ny
    else:
        ux, uy, uz = -plane.nz, 0.0, plane.nx
    wx, wy, wz = plane.ny * uz - plane.nz * uy, plane.nz * ux - plane.nx * uz, plane.nx * uy - plane.ny * ux
    for k in range(n_cut):
        dx, dy, dz = cut[k, 0] - x, cut[k, 1] - y, cut[k, 2] - z
        cut[k, 3] = _turn(dx * ux + dy * uy + dz * uz, dx * wx + dy * wy + dz * wz)
    _sort_by_angle(cut, n_cut)
    n = 0
    for k in range(n_cut):
        if n == 0 or _apart(cut[k], new[begin + n - 1]) > apart:
            new[begin + n, 0], new[begin + n, 1], new[begin + n, 2] = cut[k, 0], cut[k, 1], cut[k, 2]
            n += 1
    if n > 1 and _apart(new[begin], new[begin + n - 1]) <= apart:
        n -= 1
    return n if n >= 3 else 0


@helper
def _turn(a, b):
    """A number that grows with the angle of (a, b), 0 to 4."""
    d = abs(a) + abs(b)
    along = a / d if d > 0.0 else 0.0
    return 1.0 - along if b >= 0.0 else 3.0 + along


@helper
def _apart(a, b):
    """How far two points are apart, along the axes together."""
    return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2])


@helper
def _sort_by_angle(cut, n):
    """Insertion sort: a face has few corners."""
    for i in range(1, n):
        x, y, z, angle = cut[i, 0], cut[i, 1], cut[i, 2], cut[i, 3]
        k = i - 1
        while k >= 0 and cut[k, 3] > angle:
            cut[k + 1, 0], cut[k + 1, 1], cut[k + 1, 2], cut[k + 1, 3] = cut[k, 0], cut[k, 1], cut[k, 2], cut[k, 3]
            k -= 1
        cut[k + 1, 0], cut[k + 1, 1], cut[k + 1, 2], cut[k + 1, 3] = x, y, z, angle


@subroutine
def _measure(corner, face, n_faces, begin, row, area):
    """Volume of a cell; write what lies beyond each face into ``row``, and its vector area into ``area``, from ``begin`` on, as
    far as there is room."""
    volume = 0.0
    for f in range(n_faces):
        first, ax, ay, az = face[f, 0], 0.0, 0.0, 0.0
        px, py, pz = corner[first, 0], corner[first, 1], corner[first, 2]
        for k in range(first + 1, face[f + 1, 0] - 1):
            ux, uy, uz = corner[k, 0] - px, corner[k, 1] - py, corner[k, 2] - pz
            wx, wy, wz = corner[k + 1, 0] - px, corner[k + 1, 1] - py, corner[k + 1, 2] - pz
            ax, ay, az = ax + 0.5 * (uy * wz - uz * wy), ay + 0.5 * (uz * wx - ux * wz), az + 0.5 * (ux * wy - uy * wx)
        volume += (ax * px + ay * py + az * pz) / 3.0
        if begin + f < row.shape[0]:
            row[begin + f], area[begin + f, 0], area[begin + f, 1], area[begin + f, 2] = face[f, 1], ax, ay, az
    return volume
