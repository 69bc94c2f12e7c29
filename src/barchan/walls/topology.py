"""What hangs together in a mesh: which triangles share an edge, which lie in one plane, which are one smooth surface.

Smooth *surfaces* end at edges sharper than the feature angle, at holes, and where more than two triangles meet. Contacts are told
apart by *patches*, pieces of them so chosen that a grain touches each at one place at most: of a piece whose normals lie within
half the feature angle of one, two places where a grain rests would be in about one direction, and count once. That is so of its
inner triangles; those at its rim, where a grain may rest on an edge or a corner in any direction, are patches each, unless the
whole piece is flat and convex.
"""

import warnings
from math import cos, radians

import numpy as np

from barchan.errors import SceneError

#: Vertices so near to a plane, relative to the largest coordinate, lie in it: a plane cut into triangles is one again.
FLAT = 1e-12

#: Vertices that are nearer than this, relative to the extent of the mesh or to the period, are one to those who ask what hangs
#: together: rounding.
WELD = 1e-9

#: Open edges that are nearer, relative to the extent of the mesh, were one where it was drawn: most files have single precision.
CRACK = 1e-5

#: Holes are small if all their rims together, squared, are less than this of the area: flat sheets have 12.6 or more, a tube that
#: is 100 times as long as wide has 0.25.
SMALL = 0.1

#: Least height of a triangle relative to its longest edge: below, it has no direction.
THINNEST = 1e-12


def checked_triangles(vertices, triangles):
    """Vertices, of which none is there twice, and triangles of them.

    Raises:
        SceneError: a triangle has no such vertex, or no area; naming it.
    """
    given = np.asarray(triangles)
    if given.ndim != 2 or given.shape[1:] != (3,) or not len(given) or not np.issubdtype(given.dtype, np.integer):
        raise SceneError(
            f"mesh: triangles have shape {given.shape} and type {given.dtype}; they must be (k, 3) whole numbers, k >= 1: the "
            f"vertices of each"
        )
    wrong = np.flatnonzero(((given < 0) | (given >= len(vertices))).any(axis=1))
    if len(wrong):
        raise SceneError(
            f"mesh: triangle {wrong[0]} has vertices {given[wrong[0]].tolist()}; there are {len(vertices)}, numbered from 0 "
            f"({len(wrong)} such triangles)"
        )
    merged, number = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: no -0.0
    corners = number.reshape(-1)[given]
    edges = merged[corners[:, [1, 2, 0]]] - merged[corners]
    area = np.sqrt((np.cross(edges[:, 0], edges[:, 1]) ** 2).sum(axis=1))
    wrong = np.flatnonzero(~(area > THINNEST * (edges**2).sum(axis=2).max(axis=1)))
    if len(wrong):
        raise SceneError(
            f"mesh: triangle {wrong[0]}, {merged[corners[wrong[0]]].tolist()} [length], has no area ({len(wrong)} such "
            f"triangles). Leave such triangles out, or repair the mesh where it was made"
        )
    return merged, corners


def welded(vertices, period=(0.0, 0.0, 0.0), near=WELD):
    """A number for each vertex, the same for those at one place up to rounding, or a period away from each other, (v,).

    Args:
        period: along each axis, 0 where there is none [length].
        near: how near they are, relative to the extent of the mesh, or to the period.
    """
    extent = max(float(np.ptp(vertices, axis=0).max()), 1e-300)
    along = [_places_along(vertices[:, axis], near * (period[axis] or extent), period[axis]) for axis in range(3)]
    return np.unique(np.stack(along, axis=1), axis=0, return_inverse=True)[1].reshape(-1)


def _places_along(x, near, period):
    """A number for each coordinate, another one after every gap wider than ``near``."""
    x = x % period if period else x
    order = np.argsort(x, kind="stable")
    place = np.empty(len(x), dtype=np.int64)
    place[order] = np.cumsum(np.append(0, np.diff(x[order]) > near))
    if period and x[order[0]] + period - x[order[-1]] <= near:
        place[place == place[order[-1]]] = 0
    return place


class Edges:
    """Edges of triangles: number k of a triangle leads from its corner k to the next.

    Attributes:
        beyond: (triangles, 3) the triangle beyond each edge; -1 where there is none, or more than one.
        alike: (triangles, 3) bool, True where the two run along their edge in opposite directions, as neighbours of one
            orientation do.
        owners: (triangles, 3) how many triangles the edge belongs to.
    """

    def __init__(self, corners):
        after = corners[:, [1, 2, 0]]
        low, high = np.minimum(corners, after).ravel(), np.maximum(corners, after).ravel()
        order = np.lexsort((high, low))
        begins = np.append(True, (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0))
        number = np.empty(len(order), dtype=np.int64)
        number[order] = np.cumsum(begins) - 1
        count = np.bincount(number)
        self.owners = count[number].reshape(-1, 3)
        first = order[np.flatnonzero(begins)]
        second = order[np.minimum(np.flatnonzero(begins) + 1, len(order) - 1)]
        other = np.where(first[number] == np.arange(len(order)), second[number], first[number])
        self.beyond = np.where(count[number] == 2, other // 3, -1).reshape(-1, 3)
        upwards = (corners < after).ravel()
        self.alike = (upwards != upwards[other]).reshape(-1, 3) & (self.beyond >= 0)


def warn_of_holes(vertices, corners, edges):
    """Warn if a mesh has open edges where it looks as if it should have none."""
    triangle, k = np.nonzero(edges.owners == 1)
    ends = np.stack([corners[triangle, k], corners[triangle, (k + 1) % 3]], axis=1)
    near = np.sort(welded(vertices, near=CRACK)[ends], axis=1)
    _, which, count = np.unique(near, axis=0, return_inverse=True, return_counts=True)
    cracks = np.count_nonzero((count[which.reshape(-1)] > 1) & (near[:, 0] != near[:, 1]))
    if cracks:
        warnings.warn(
            f"mesh: {cracks} of {len(ends)} open edges nearly meet others, within {CRACK:g} of its extent: it has cracks, at "
            f"which grains touch both sides. Merge vertices where it was made",
            stacklevel=5,
        )
        return
    rim = np.sqrt(((vertices[ends[:, 1]] - vertices[ends[:, 0]]) ** 2).sum(axis=1)).sum()
    a, b, c = (vertices[corners[:, k]] for k in range(3))
    area = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum()
    if 0.0 < rim**2 < SMALL * area:
        warnings.warn(
            f"mesh: it has holes, {len(ends)} edges of one triangle only, but small ones: it is a sheet, which grains touch from "
            f"both sides. If it should be closed, repair it where it was made",
            stacklevel=5,
        )


def oriented(corners, edges):
    """Triangles turned so that neighbours have one orientation; where that cannot be, on a strip of Moebius, edges stay that are
    not ``alike``."""
    beyond, alike, turned = edges.beyond.tolist(), edges.alike.tolist(), [None] * len(corners)
    for seed in range(len(corners)):
        if turned[seed] is None:
            turned[seed], waiting = False, [seed]
            while waiting:
                here = waiting.pop()
                for there, same in zip(beyond[here], alike[here]):
                    if there >= 0 and turned[there] is None:
                        turned[there] = turned[here] if same else not turned[here]
                        waiting.append(there)
    return np.where(np.array(turned)[:, None], corners[:, [0, 2, 1]], corners)


def regions(beyond, order, joins):
    """Number of the region of each triangle: grown from seeds, taken in an order, over edges.

    Args:
        beyond: (triangles, 3) over which edges it may grow, the triangle beyond; -1: not over this one.
        joins: function (seed, triangle) -> does the triangle belong to the region of the seed?
    """
    region, count, beyond = [-1] * len(beyond), 0, beyond.tolist()
    for seed in order.tolist():
        if region[seed] < 0:
            region[seed], waiting = count, [seed]
            while waiting:
                for there in beyond[waiting.pop()]:
                    if there >= 0 and region[there] < 0 and joins(seed, there):
                        region[there] = count
                        waiting.append(there)
            count += 1
    return np.array(region)


def planes_of(vertices, corners, edges):
    """Facets: connected triangles in one plane, which is that of the largest of them.

    Returns:
        (number of each triangle's facet, unit normals (triangles, 3), offsets (triangles,): v . normal of points of the plane).
    """
    a, b, c = (vertices[corners[:, k]] for k in range(3))
    own = np.cross(b - a, c - a)
    area = np.sqrt((own**2).sum(axis=1))
    normal = own / area[:, None]
    offset = (a * normal).sum(axis=1)
    near = FLAT * np.abs(vertices).max()
    places, normals, offsets, across = (array.tolist() for array in (vertices[corners], normal, offset, own))

    def joins(seed, there):
        (x, y, z), o, (p, q, r) = normals[seed], offsets[seed], across[there]
        flat = all(abs(u * x + v * y + w * z - o) <= near for u, v, w in places[there])
        return flat and p * x + q * y + r * z > 0.0

    order = np.argsort(-area, kind="stable")
    facet = regions(np.where(edges.alike, edges.beyond, -1), order, joins)
    seed = np.empty(facet.max() + 1, dtype=np.int64)
    seed[facet[order[::-1]]] = order[::-1]  # the largest comes last
    return facet, normal[seed[facet]], offset[seed[facet]]


def pieces_of(normal, edges, angle):
    """Pieces of smooth surfaces whose normals are alike, and these surfaces, for a feature angle in degrees.

    Returns:
        (number of each triangle's piece, number of each triangle's surface).
    """
    dihedral = np.einsum("tkc,tc->tk", normal[edges.beyond], normal)
    smooth = np.where(edges.alike & (dihedral >= cos(radians(angle)) - 1e-12), edges.beyond, -1)
    normals, least = normal.tolist(), cos(radians(0.5 * angle))

    def joins(seed, there):
        (x, y, z), (p, q, r) = normals[seed], normals[there]
        return p * x + q * y + r * z >= least

    order = np.arange(len(normal))
    return regions(smooth, order, joins), regions(smooth, order, lambda seed, there: True)


def rims_of(corners, piece, edges):
    """True for vertices where pieces meet, or end, (vertices,)."""
    lowest, highest = np.full(corners.max() + 1, piece.max() + 1), np.full(corners.max() + 1, -1)
    for k in range(3):
        np.minimum.at(lowest, corners[:, k], piece)
        np.maximum.at(highest, corners[:, k], piece)
    rim = lowest < highest
    for end in (corners, corners[:, [1, 2, 0]]):
        rim[end[edges.owners != 2]] = True
    return rim


def patches_of(vertices, corners, piece, facet, outer):
    """Patches: what lies within a piece, and each triangle at its rim; a piece that is one convex facet as a whole.

    Args:
        piece, facet: (triangles,) numbers.
        outer: (triangles,) bool, at the rim of its piece.

    Returns:
        Number of each triangle's patch, (triangles,).
    """
    first, last = np.full(piece.max() + 1, facet.max() + 1), np.full(piece.max() + 1, -1)
    np.minimum.at(first, piece, facet)
    np.maximum.at(last, piece, facet)
    order = np.argsort(piece, kind="stable")
    for triangles in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1):
        if len(triangles) > 1 and first[piece[triangles[0]]] == last[piece[triangles[0]]]:
            outer[triangles] &= not _is_convex(vertices, corners[triangles])
    own = piece.max() + 1 + np.arange(len(piece))
    return np.unique(np.where(outer, own, piece), return_inverse=True)[1].reshape(-1)


def _is_convex(vertices, corners):
    """Whether triangles of one orientation in one plane are a convex polygon: its rim is one line, which turns one way, once."""
    triangle, k = np.nonzero(Edges(corners).owners == 1)
    start, end = corners[triangle, k], corners[triangle, (k + 1) % 3]
    order = np.argsort(start)
    follower = order[np.searchsorted(start[order], end) % len(start)]
    if (start[follower] != end).any() or len(np.unique(start)) != len(start):
        return False
    a, b, c = vertices[corners[0]]
    normal = np.cross(b - a, c - a) / np.sqrt((np.cross(b - a, c - a) ** 2).sum())
    one = vertices[end] - vertices[start]
    turn, along = np.cross(one, one[follower]) @ normal, (one * one[follower]).sum(axis=1)
    chord = np.sqrt(((one + one[follower]) ** 2).sum(axis=1))
    outwards = turn >= -10.0 * FLAT * np.abs(vertices).max() * chord
    return bool(outwards.all() and abs(np.arctan2(turn, along).sum() - 2.0 * np.pi) < 1.0)
