"""Meshes for tests: vertices and triangles."""

import numpy as np


def joined(*parts):
    """Several meshes as one."""
    begin = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] + k for part, k in zip(parts, begin)])


def sheet(rows):
    """A sheet through rows of points, (m, n, 3)."""
    rows = np.asarray(rows, dtype=float)
    number = np.arange(rows.shape[0] * rows.shape[1]).reshape(rows.shape[:2])
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return rows.reshape(-1, 3), np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def floor(kind, length=20.0):
    """The square from (0, 0, 0) to (length, length, 0), cut in several ways."""
    rng = np.random.default_rng(5)
    if kind == "two":
        return sheet([[(0, 0, 0), (0, length, 0)], [(length, 0, 0), (length, length, 0)]])
    if kind == "split":  # at random points, again and again: needles
        vertices, triangles = floor("two", length)
        vertices, triangles = vertices.tolist(), triangles.tolist()
        for _ in range(400):
            a, b, c = triangles.pop(rng.integers(len(triangles)))
            u, v, w = rng.dirichlet((1, 1, 1))
            vertices.append([u * p + v * q + w * r for p, q, r in zip(vertices[a], vertices[b], vertices[c])])
            new = len(vertices) - 1
            triangles += [[a, b, new], [b, c, new], [c, a, new]]
        return np.array(vertices), np.array(triangles)
    line = np.linspace(0.0, length, 41)
    if kind == "slivers":
        line = np.sort(np.concatenate([line, line[1:-1] + 1e-6]))
    rows = np.stack([*np.meshgrid(line, np.linspace(0.0, length, 41), indexing="ij"), np.zeros((len(line), 41))], axis=-1)
    if kind == "random":
        rows[1:-1, 1:-1, :2] += rng.uniform(-0.15, 0.15, (len(line) - 2, 39, 2))
    vertices, triangles = sheet(rows)
    if kind == "random":
        half = len(triangles) // 2
        first, second = triangles[:half], triangles[half:]
        swap = rng.random(half) < 0.5  # the other diagonal
        a, b, c, d = first[swap, 0], first[swap, 1], first[swap, 2], second[swap, 2]
        first[swap], second[swap] = np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)
    return vertices, triangles


def box(low, high):
    """The closed surface of a box, normals outwards."""
    corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], dtype=float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def tube(radius, length, around, along=1):
    """The mantle of a prism around z, from 0 to ``length``, its corners at ``radius``."""
    angle = np.linspace(0.0, 2.0 * np.pi, around + 1)
    z = np.linspace(0.0, length, along + 1)
    rows = np.stack(np.broadcast_arrays(radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None], z), axis=-1)
    rows[-1] = rows[0]
    return sheet(rows)


def ball(radius, times):
    """An octahedron whose triangles are cut into four ``times`` times, its corners on a sphere around the origin."""
    vertices = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=float)
    places = vertices[[(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]]
    for _ in range(times):
        a, b, c = (places[:, k] for k in range(3))
        ab, bc, ca = (0.5 * (p + q) for p, q in ((a, b), (b, c), (c, a)))
        places = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        places /= np.sqrt((places**2).sum(axis=2))[:, :, None]
    return radius * places.reshape(-1, 3), np.arange(3 * len(places)).reshape(-1, 3)


def turned(vertices, normal):
    """Vertices turned so that z becomes ``normal``, about the origin."""
    z = np.asarray(normal) / np.linalg.norm(normal)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return vertices @ np.array([x, np.cross(z, x), z])
