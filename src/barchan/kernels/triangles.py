"""Geometry of triangles: the nearest point of one, and which are near a place. All in the frame of their mesh."""

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from barchan.kernels.compiler import kernel, piece, prange


class Tree(NamedTuple):
    """Boxes around boxes around triangles, in the order in which they are looked at: ``low``, ``high`` (nodes, 3); ``skip``
    (nodes,) the node to go on with if nothing in it is near; ``first``, ``count`` (nodes,) the triangles of one that is not
    divided, else count 0."""

    low: np.ndarray
    high: np.ndarray
    skip: np.ndarray
    first: np.ndarray
    count: np.ndarray


class Triangles(NamedTuple):
    """Triangles in the order of their tree.

    ``vertices`` (v, 3); ``corners`` (t, 3); ``planes`` (t, 4, 4): normal and offset of the plane, then for each edge the normal
    in that plane that points inwards, and its offset; ``slack`` (t, 3): how far beyond an edge a foot may be by rounding and
    still count as in the triangle, where the next one lies in the same plane, else 0; ``edge_normals`` (t, 3, 3) and
    ``vertex_normals`` (v, 3): which way is out at edges and vertices (Baerentzen & Aanaes 2005, IEEE TVCG 11, 243); ``patch``
    (t,); ``surface`` (patches,); ``rim`` (v,): 1 where patches meet or end; ``solid``: 1 if the mesh is closed, and has a front
    and a back.
    """

    vertices: np.ndarray
    corners: np.ndarray
    planes: np.ndarray
    slack: np.ndarray
    edge_normals: np.ndarray
    vertex_normals: np.ndarray
    patch: np.ndarray
    surface: np.ndarray
    rim: np.ndarray
    solid: int


#: What is nearest: the face, edge 1 + k, or vertex 4 + k of a triangle.
FACE, EDGE, VERTEX = 0, 1, 4


@piece
def nearest_of(shape, t, x, y, z):
    """Distance from triangle ``t``, what of it is nearest, and the nearest point. Neighbours find the same bits on their edge."""
    planes = shape.planes
    height = x * planes[t, 0, 0] + y * planes[t, 0, 1] + z * planes[t, 0, 2] - planes[t, 0, 3]
    within, best, feature, qx, qy, qz = True, inf, FACE, 0.0, 0.0, 0.0
    for k in range(3):
        inwards = x * planes[t, 1 + k, 0] + y * planes[t, 1 + k, 1] + z * planes[t, 1 + k, 2] - planes[t, 1 + k, 3]
        if inwards + shape.slack[t, k] < 0.0:
            within = False
            here, there = shape.corners[t, k], shape.corners[t, (k + 1) % 3]
            a, b = min(here, there), max(here, there)
            ax, ay, az = shape.vertices[a, 0], shape.vertices[a, 1], shape.vertices[a, 2]
            bx, by, bz = shape.vertices[b, 0], shape.vertices[b, 1], shape.vertices[b, 2]
            ex, ey, ez = bx - ax, by - ay, bz - az
            part = ((x - ax) * ex + (y - ay) * ey + (z - az) * ez) / (ex * ex + ey * ey + ez * ez)
            kind = EDGE + k
            if part <= 0.0:
                px, py, pz = ax, ay, az
                kind = VERTEX + (k if a == here else (k + 1) % 3)
            elif part >= 1.0:
                px, py, pz = bx, by, bz
                kind = VERTEX + (k if b == here else (k + 1) % 3)
            else:
                px, py, pz = ax + part * ex, ay + part * ey, az + part * ez
            distance = sqrt((x - px) * (x - px) + (y - py) * (y - py) + (z - pz) * (z - pz))
            if distance < best:
                best, feature, qx, qy, qz = distance, kind, px, py, pz
    if within:
        qx, qy, qz = x - height * planes[t, 0, 0], y - height * planes[t, 0, 1], z - height * planes[t, 0, 2]
        return abs(height), FACE, qx, qy, qz
    return best, feature, qx, qy, qz


@piece
def beside_triangle(shape, t, x, y, z, far):
    """True only if a place is farther from triangle ``t`` than ``far``, found at little cost from its planes."""
    planes, far = shape.planes, 1.000001 * far
    height = x * planes[t, 0, 0] + y * planes[t, 0, 1] + z * planes[t, 0, 2] - planes[t, 0, 3]
    if abs(height) > far:
        return True
    for k in range(1, 4):
        if x * planes[t, k, 0] + y * planes[t, k, 1] + z * planes[t, k, 2] - planes[t, k, 3] < -far:
            return True
    return False


@piece
def outwards(shape, t, feature):
    """Which way is out there: a vector of any length."""
    if feature == FACE:
        return shape.planes[t, 0, 0], shape.planes[t, 0, 1], shape.planes[t, 0, 2]
    if feature < VERTEX:
        k = feature - EDGE
        return shape.edge_normals[t, k, 0], shape.edge_normals[t, k, 1], shape.edge_normals[t, k, 2]
    v = shape.corners[t, feature - VERTEX]
    return shape.vertex_normals[v, 0], shape.vertex_normals[v, 1], shape.vertex_normals[v, 2]


@piece
def from_feature(shape, t, feature, x, y, z):
    """Distance from the plane, the line or the point that a feature is part of, and the unit vector away from it. Of a solid:
    outwards, and the distance is negative behind it."""
    nx, ny, nz = outwards(shape, t, feature)
    if feature == FACE:
        distance = x * nx + y * ny + z * nz - shape.planes[t, 0, 3]
        if shape.solid == 0 and distance < 0.0:
            return -distance, -nx, -ny, -nz
        return distance, nx, ny, nz
    k = feature - EDGE if feature < VERTEX else feature - VERTEX
    a, b = shape.corners[t, k], shape.corners[t, (k + 1) % 3]
    a, b = (min(a, b), max(a, b)) if feature < VERTEX else (a, a)
    px, py, pz = shape.vertices[a, 0], shape.vertices[a, 1], shape.vertices[a, 2]
    dx, dy, dz = x - px, y - py, z - pz
    if feature < VERTEX:
        ex, ey, ez = shape.vertices[b, 0] - px, shape.vertices[b, 1] - py, shape.vertices[b, 2] - pz
        part = (dx * ex + dy * ey + dz * ez) / (ex * ex + ey * ey + ez * ez)
        dx, dy, dz = x - (px + part * ex), y - (py + part * ey), z - (pz + part * ez)
    distance = sqrt(dx * dx + dy * dy + dz * dz)
    if distance == 0.0:  # a centre on it: any way but along it is as good
        norm = sqrt(nx * nx + ny * ny + nz * nz)
        return 0.0, nx / norm, ny / norm, nz / norm
    inverse = 1.0 / distance
    if shape.solid != 0 and dx * nx + dy * ny + dz * nz < 0.0:
        distance, inverse = -distance, -inverse
    return distance, dx * inverse, dy * inverse, dz * inverse


@piece
def crosses(shape, t, ax, ay, az, bx, by, bz, near):
    """Does the way from a to b lead through triangle ``t``, or past its rim nearer than ``near``?"""
    planes = shape.planes
    above = ax * planes[t, 0, 0] + ay * planes[t, 0, 1] + az * planes[t, 0, 2] - planes[t, 0, 3]
    below = bx * planes[t, 0, 0] + by * planes[t, 0, 1] + bz * planes[t, 0, 2] - planes[t, 0, 3]
    if above * below >= 0.0:
        return False
    part = above / (above - below)
    x, y, z = ax + part * (bx - ax), ay + part * (by - ay), az + part * (bz - az)
    for k in range(1, 4):
        if x * planes[t, k, 0] + y * planes[t, k, 1] + z * planes[t, k, 2] - planes[t, k, 3] < -near:
            return False
    return True


@piece
def beside_box(tree, node, x, y, z):
    """Square of the distance from a box."""
    dx = max(tree.low[node, 0] - x, 0.0, x - tree.high[node, 0])
    dy = max(tree.low[node, 1] - y, 0.0, y - tree.high[node, 1])
    dz = max(tree.low[node, 2] - z, 0.0, z - tree.high[node, 2])
    return dx * dx + dy * dy + dz * dz


@kernel(parallel=True)
def distances_mesh(places, shape, tree, found):
    """Write the distances of places (k, 3) from a mesh into ``found`` (k,); negative in a solid."""
    for i in prange(places.shape[0]):
        x, y, z = places[i, 0], places[i, 1], places[i, 2]
        best, node = inf, 0
        while node < tree.skip.shape[0]:
            if beside_box(tree, node, x, y, z) > best * best:
                node = tree.skip[node]
                continue
            for t in range(tree.first[node], tree.first[node] + tree.count[node]):
                distance, feature, _, _, _ = nearest_of(shape, t, x, y, z)
                if distance < best:
                    best = distance
                    found[i], _, _, _ = from_feature(shape, t, feature, x, y, z)
            node += 1
