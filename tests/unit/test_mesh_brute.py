"""Contacts with meshes beside a plain reference: every place of the mesh from which no way leads nearer to the centre of a grain,
and of those on one smooth surface in one direction the nearest. A place where surfaces meet is on all of them."""

import meshes
import numpy as np
import pytest
from scenes import simulation

import barchan as bc

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

RADIUS, ANGLE = 0.5, 40.0


def nearest(place, corners):
    """Distance and nearest point of each triangle, of which ``corners`` are (3, t, 3)."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = ((place - corners[0]) * normal).sum(axis=1)
    foot = place - height[:, None] * normal
    distance, found, within = np.full(len(normal), np.inf), np.zeros_like(normal), np.ones(len(normal), dtype=bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        along = end - start
        within &= ((foot - start) * np.cross(normal, along)).sum(axis=1) >= -1e-13
        part = np.clip(((place - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        here = start + part[:, None] * along
        away = np.linalg.norm(place - here, axis=1)
        found[away < distance] = here[away < distance]
        distance = np.minimum(distance, away)
    return np.where(within, np.abs(height), distance), np.where(within[:, None], foot, found)


def surfaces(vertices, triangles):
    """Number of the smooth surface of each triangle."""
    _, corner = np.unique(np.rint(vertices / 1e-8), axis=0, return_inverse=True)
    corner = corner.reshape(-1)[triangles]
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    owners, surface = {}, np.arange(len(triangles))
    for t, (i, j, k) in enumerate(corner.tolist()):
        for edge in ((i, j), (j, k), (k, i)):
            owners.setdefault(tuple(sorted(edge)), []).append((t, edge))
    for pair in owners.values():
        if len(pair) == 2:
            (one, edge), (other, beyond) = pair
            if (-1.0 if edge == beyond else 1.0) * normal[one] @ normal[other] >= np.cos(np.radians(ANGLE)):
                surface[surface == surface[other]] = surface[one]
    return surface


def expected(place, corners, surface):
    """Feet of the contacts, the nearest first, and their distances."""
    distance, foot = nearest(place, corners)
    chosen, met = [], {}
    for t in np.argsort(distance, kind="stable"):
        if distance[t] >= RADIUS:
            break
        on = nearest(foot[t], corners)[0] < 1e-9 * RADIUS
        is_foot, met[t] = distance[on].min() >= distance[t] - 1e-12, set(surface[on])
        for other in chosen:
            along = (place - foot[t]) @ (place - foot[other]) / (distance[t] * distance[other])
            is_foot &= not met[t] & met[other] or along < np.cos(np.radians(ANGLE))
            is_foot &= np.linalg.norm(foot[t] - foot[other]) > 1e-9 * RADIUS
        if is_foot:
            chosen.append(t)
    return foot[chosen], distance[chosen]


def shaken(mesh, size):
    vertices = mesh[0] + np.random.default_rng(4).uniform(-size, size, mesh[0].shape)
    return vertices, mesh[1]


def soup(shared):
    """Triangles that go through each other, with vertices of their own or of others."""
    random = np.random.default_rng(9)
    if not shared:
        return random.uniform(-1, 1, (24, 3)), np.arange(24).reshape(8, 3)
    return random.uniform(-1, 1, (8, 3)), np.array([random.choice(8, 3, replace=False) for _ in range(14)])


def fan(count, height, rim=0.0):
    """Slivers around one vertex; with a ``rim`` that goes up and down, a saddle."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    around = np.stack([np.cos(angle), np.sin(angle), rim * np.cos(2.0 * angle)], axis=1)
    number = np.arange(count)
    return np.vstack([[0, 0, height], around]), np.stack([0 * number, 1 + number, 1 + (number + 1) % count], axis=1)


def rough(edge, height):
    """A sheet of random heights, up to ``height`` edges."""
    line = edge * np.arange(int(2.4 / edge) + 8)
    x, y = np.meshgrid(line, line, indexing="ij")
    return meshes.sheet(np.stack([x, y, edge * np.random.default_rng(3).uniform(-height, height, x.shape)], axis=-1))


def holed():
    """A plate with a square hole that is narrower than the grain."""
    x, y = np.meshgrid([-2.0, -0.3, 0.3, 2.0], [-2.0, -0.3, 0.3, 2.0], indexing="ij")
    vertices, triangles = meshes.sheet(np.stack([x, y, 0.0 * x], axis=-1))
    return vertices, np.delete(triangles, [4, 13], axis=0)


LINE = np.linspace(0.0, 6.0, 9)
FLOOR = meshes.sheet(np.stack([*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((9, 9))], axis=-1))
SHEET = meshes.box((-2, -2, -2), (2, 2, 2))
JUNCTION = np.array([(0, -3, 0), (0, 3, 0), (3, -3, 0), (3, 3, 0), (-3, -3, 0), (-3, 3, 0), (0, -3, 3), (0, 3, 3)], dtype=float)
NASTY = {
    "two hundred slivers at a vertex": fan(200, 0.2),
    "a flat fan": fan(200, 0.0),
    "a saddle": fan(40, 0.0, 0.1),
    "two sheets nearer than an overlap": meshes.joined(FLOOR, (FLOOR[0] + (0, 0, 0.02), FLOOR[1])),
    "three sheets at one edge": (JUNCTION, np.array([(0, 2, 1), (2, 3, 1), (0, 1, 4), (4, 1, 5), (0, 1, 6), (6, 1, 7)])),
    "vertices apart by rounding": shaken(meshes.ball(2.0, 2), 1e-13),
    "a box without a side": (SHEET[0], SHEET[1][2:]),
    "a triangle that is there twice": (FLOOR[0], np.concatenate([FLOOR[1], FLOOR[1][:50]])),
    "triangles through each other": soup(shared=False),
    "the same with common vertices": soup(shared=True),
    "bumps as large as the grain": rough(1.25, 1.0),
    "steep bumps half as large": rough(0.25, 1.0),
    "many low bumps": rough(0.125, 0.4),
    "a hole narrower than the grain": holed(),
}


@pytest.mark.parametrize("name", NASTY)
def test_contacts_are_those_of_the_reference(name):
    vertices, triangles = NASTY[name]
    random = np.random.default_rng(1)
    corners, surface = np.stack([vertices[triangles[:, k]] for k in range(3)]), surfaces(vertices, triangles)
    sim = simulation(bc.Box((-20,) * 3, (20,) * 3), dt=1e-5, properties={"kn": 1000.0, "kt": 1e-9, "friction": 0.0})
    sim.max_overlap = np.inf
    mesh = sim.add_wall(bc.Mesh(vertices, triangles, feature_angle=ANGLE))
    sim.add_grains([(10, 10, 10)], RADIUS)
    touched = 0
    for _ in range(60):
        weight = random.dirichlet((0.6, 0.6, 0.6))
        away = random.normal(size=3)
        place = weight @ corners[:, random.integers(len(triangles))]
        place = place + random.uniform(0.9, 1.0) * RADIUS * away / np.linalg.norm(away)
        if mesh.is_closed and mesh.distance(place[None])[0] < 0.0:
            continue
        sim.grains.position[0] = place
        sim.prepare()
        foot, distance = expected(place, corners, surface)
        force = (1000.0 * (RADIUS - distance) / distance) @ (place - foot)
        assert mesh.contacts == len(foot), place
        np.testing.assert_allclose(sim.grains.force[0], force, rtol=0.0, atol=1e-9 * 1000.0 * RADIUS)
        touched += len(foot) > 0
    assert touched >= 25
