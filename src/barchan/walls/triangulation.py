"""Triangles made ready for the loops: planes, normals at edges and vertices, patches, tree."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.triangles import Tree, Triangles
from barchan.walls.topology import (
    FLAT,
    Edges,
    checked_triangles,
    oriented,
    patches_of,
    pieces_of,
    planes_of,
    rims_of,
    warn_of_holes,
    welded,
)
from barchan.walls.tree import tree_around


class Triangulation(NamedTuple):
    """``shape``: ``Triangles``; ``tree`` around them; ``order`` (triangles,): the number of each as the user counts."""

    shape: Triangles
    tree: Tree
    order: np.ndarray


def triangulation(vertices, triangles, angle, inside, period):
    """What the loops need of a mesh, in its own frame.

    Args:
        vertices: (v, 3) from the point of the mesh [length].
        triangles: (t, 3) numbers of vertices.
        angle: feature angle in degrees.
        inside: grains are within the closed mesh.
        period: (3,) of the box, 0 where it is not periodic [length]: across it, what fits together is one surface.

    Raises:
        SceneError: the triangles are none, or grains shall be inside and there are holes.
    """
    vertices, corners = checked_triangles(vertices, triangles)
    edges = Edges(welded(vertices)[corners])
    is_closed = bool((edges.owners == 2).all())
    if is_closed:
        _refuse_mixed(edges)
        outwards = volume(vertices, corners) >= 0.0
        corners = corners if outwards != inside else corners[:, [0, 2, 1]]
    elif inside:
        _refuse_holes(vertices, corners, edges)
    else:
        warn_of_holes(vertices, corners, edges)
        corners = oriented(corners, edges)
    tree, order = tree_around(vertices[corners])
    return Triangulation(_shape(vertices, corners[order], angle, is_closed, period), tree, order)


def volume(vertices, corners):
    """Volume that closed triangles enclose, positive if their normals point outwards [length^3]."""
    a, b, c = (vertices[corners[:, k]] - vertices[0] for k in range(3))
    return float((a * np.cross(b, c)).sum()) / 6.0


def _refuse_mixed(edges):
    wrong = np.argwhere(~edges.alike)
    if len(wrong):
        one, k = wrong[0]
        raise SceneError(
            f"mesh: triangles {one} and {edges.beyond[one, k]} run along their common edge in one direction, so one of them is "
            f"turned over, and it is not known where the inside is ({len(wrong) // 2} such pairs). Swap two corners of one of "
            f"each, or repair the mesh where it was made"
        )


def _refuse_holes(vertices, corners, edges):
    triangle, k = np.argwhere(edges.owners != 2)[0]
    a, b = vertices[corners[triangle, k]], vertices[corners[triangle, (k + 1) % 3]]
    raise SceneError(
        f"mesh: inside = True needs a closed mesh; the edge from {a.tolist()} to {b.tolist()} [length, from its point] belongs "
        f"to {edges.owners[triangle, k]} triangle(s), not 2 ({np.count_nonzero(edges.owners != 2)} such). Close the mesh, or "
        f"leave inside out: then grains touch it from both sides"
    )


def _shape(vertices, corners, angle, is_closed, period):
    one, across = welded(vertices), welded(vertices, period)
    edges, periodic_edges = Edges(one[corners]), Edges(across[corners])
    facet, normal, offset = planes_of(vertices, corners, edges)
    piece, surface = pieces_of(normal, periodic_edges, angle)
    outer = rims_of(across[corners], piece, periodic_edges)[across[corners]].any(axis=1)
    patch = patches_of(vertices, corners, piece, facet, outer)
    places, after = vertices[corners], vertices[corners[:, [1, 2, 0]]]
    along = after - places
    inwards = np.cross(normal[:, None, :], along)
    inwards /= np.sqrt((inwards**2).sum(axis=2))[:, :, None]
    planes = np.empty((len(corners), 4, 4))
    planes[:, 0, :3], planes[:, 0, 3] = normal, offset
    planes[:, 1:, :3], planes[:, 1:, 3] = inwards, (inwards * places).sum(axis=2)
    known = edges.beyond >= 0
    flat = known & (facet[edges.beyond] == facet[:, None])
    slack = np.where(flat, FLAT * np.abs(vertices).max(), 0.0)
    beside = np.where((known & edges.alike)[:, :, None], normal[edges.beyond], 0.0)
    owner = np.empty(patch.max() + 1, dtype=np.int64)
    owner[patch] = surface
    of_vertices = _at_vertices(one[corners], along, normal)[one]
    rim = rims_of(across[corners], patch, periodic_edges)[across].astype(np.uint8)
    edge_normals = normal[:, None, :] + beside
    arrays = (vertices, corners, planes, slack, edge_normals, of_vertices, patch, owner, rim)
    return Triangles(*map(np.ascontiguousarray, arrays), int(is_closed))


def _at_vertices(corners, along, normal):
    """Normals of the triangles around each vertex, weighted with their angles there, (vertices, 3)."""
    before = -along[:, [2, 0, 1]]
    lengths = np.sqrt((along**2).sum(axis=2) * (before**2).sum(axis=2))
    angle = np.arccos(np.clip((along * before).sum(axis=2) / lengths, -1.0, 1.0))
    sums = np.zeros((corners.max() + 1, 3))
    np.add.at(sums, corners, angle[:, :, None] * normal[:, None, :])
    return sums
