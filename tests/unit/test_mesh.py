"""Meshes: where grains touch them, in closed form; how many contacts there are; no grain goes through; no mesh that is none."""

import sys
import warnings

import meshes
import numpy as np
import pytest
from scenes import NOTHING, SOFT, fingerprint, simulation

import barchan as bc
from barchan.errors import OverlapError, SceneError
from barchan.measure import contact_table, triangle_forces, triangle_torques
from barchan.parallel import virtual_ranks
from barchan.walls import Servo
from barchan.walls.topology import welded

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

#: A cube of edge 4 around (10, 10, 10).
CUBE = meshes.box((8, 8, 8), (12, 12, 12))
DIAGONAL = np.ones(3) / np.sqrt(3.0)


def touching(mesh, *places, radius=0.5):
    """A mesh and grains that do not touch each other, with their forces."""
    sim = simulation(dt=1e-5)
    sim.add_wall(mesh)
    sim.add_grains(places, radius)
    sim.prepare()
    return sim


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("foot", "normal"),
    [
        ((10.3, 9.9, 12), (0, 0, 1)),
        ((12, 10, 10), (1, 0, 0)),
        ((12, 12, 9), (1, 1, 0)),
        ((12, 12, 9), (1, 2, 0)),
        ((12, 12, 12), (1, 1, 1)),
        ((12, 12, 12), (3, 1, 2)),
        ((8, 8, 8), (-1, -1, -0.01)),
        ((8, 11, 8), (-1, 0, 0)),
    ],
)
@pytest.mark.parametrize("sheet", [False, True])
def test_a_cube_is_touched_once_where_it_is_nearest(foot, normal, sheet):
    """On its faces, edges and corners; as a closed mesh, and as a sheet, which lacks a face elsewhere."""
    normal = np.array(normal) / np.linalg.norm(normal)
    triangles = CUBE[1][[k for k in range(12) if k not in (4, 5) or not sheet]]  # without the face y = 8
    sim = touching(bc.Mesh(CUBE[0], triangles), np.add(foot, 0.47 * normal))
    wall = sim.walls[0]
    assert wall.is_closed != sheet and wall.patches == (5 if sheet else 6)
    assert sim.grains.force[0] == pytest.approx(1000.0 * 0.03 * normal, rel=1e-9, abs=1e-9)
    assert wall.contacts == 1 and wall.pressing == pytest.approx(30.0)
    assert wall.torque == pytest.approx(np.cross(np.array(foot) - wall.point, wall.force), abs=1e-9)


def test_in_a_corner_there_is_a_contact_with_each_side():
    """As with three planes, to rounding, friction included: a grain slides about in the corner of a box."""
    sims = []
    for walls in ([bc.Mesh(*CUBE, inside=True)], [bc.Plane((8, 8, 8), normal) for normal in np.eye(3)]):
        sim = simulation(gravity=(-30, -40, -50))
        for wall in walls:
            sim.add_wall(wall)
        sim.add_grains([(8.49, 8.49, 8.49)], 0.5, velocity=(0.3, 0.2, 0.1), omega=(1, 2, 3))
        sim.run(300)
        sims.append(sim)
    assert sims[0].walls[0].contacts == 3 and np.abs(contact_table(sims[0])["memory"]).max() > 1e-4
    for name in ("position", "velocity", "omega", "force", "torque"):
        one, other = (sim.grains.view(name) for sim in sims)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * np.abs(other).max())
    by_side = [np.argmin(np.abs(np.subtract(table["point"], 8.0)), axis=1) for table in map(contact_table, sims)]
    one, other = (contact_table(sim)["memory"][np.argsort(sides)] for sim, sides in zip(sims, by_side))
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * np.abs(other).max())


def test_a_sheet_is_touched_from_both_sides_and_at_its_rim():
    mesh = bc.Mesh(*meshes.floor("two", 4.0))
    sim = touching(mesh, (1, 1, 0.47), (3, 1, 0.47), (2, 4.47, 0.0))
    np.testing.assert_allclose(sim.grains.force, 30.0 * np.array([(0, 0, 1), (0, 0, 1), (0, 1, 0)]), atol=1e-9)
    below = bc.Mesh(meshes.floor("two", 4.0)[0] + (0, 0, 5), meshes.floor("two", 4.0)[1])
    np.testing.assert_allclose(touching(below, (1, 1, 4.53)).grains.force, [(0, 0, -30.0)], atol=1e-9)


def test_a_grain_wedged_in_a_channel_touches_its_smooth_surface_twice():
    """Two walls and a round bottom between them are one surface; the grain is as wide as the channel, high above its bottom."""
    angle = np.linspace(np.pi, 2.0 * np.pi, 13)
    profile = [(-1.0, 4.0), *zip(np.cos(angle), np.sin(angle)), (1.0, 4.0)]
    rows = [[(10 + x, y, 10 + z) for y in (2.0, 18.0)] for x, z in profile]
    sim = touching(bc.Mesh(*meshes.sheet(rows)), (10.01, 9.3, 12.5), radius=1.02)
    assert len(set(sim.walls[0]._mesh.shape.surface)) == 1
    assert sim.walls[0].contacts == 2 and sim.walls[0].pressing == pytest.approx(1000.0 * 0.04)
    assert sim.grains.force[0] == pytest.approx((-20.0, 0, 0), abs=1e-9)


def test_thin_plates_are_touched_from_one_side():
    """A closed plate thinner than the overlap: its back is not touched."""
    plate = bc.Mesh(*meshes.box((2, 2, 9.99), (18, 18, 10)))
    sim = touching(plate, (7, 9, 10.47), (12, 9, 9.99 - 0.47))
    assert plate.contacts == 2
    np.testing.assert_allclose(sim.grains.sorted_by_id("force"), [(0, 0, 30.0), (0, 0, -30.0)], atol=1e-9)


def box_distance(places, low, high):
    """Signed distance from a box."""
    q = np.maximum(np.subtract(low, places), np.subtract(places, high))
    return np.sqrt((np.maximum(q, 0.0) ** 2).sum(axis=1)) + np.minimum(q.max(axis=1), 0.0)


def test_distances_are_those_of_the_nearest_point_and_negative_in_a_solid():
    places = np.random.default_rng(3).uniform(5, 15, (2000, 3))
    expected = box_distance(places, 8.0, 12.0)
    np.testing.assert_allclose(bc.Mesh(*CUBE).distance(places), expected, atol=1e-14)
    np.testing.assert_allclose(bc.Mesh(CUBE[0], CUBE[1][:, ::-1]).distance(places), expected, atol=1e-14)
    np.testing.assert_allclose(bc.Mesh(*CUBE, inside=True).distance(places), -expected, atol=1e-14)
    vertices, triangles = meshes.ball(3.0, 4)
    far = bc.Mesh(vertices + 10, triangles).distance(places) - (np.linalg.norm(places - 10, axis=1) - 3.0)
    assert 0.0 <= far.max() < 0.02 and far.min() > -1e-12, "its triangles lie within the sphere"


@pytest.mark.parametrize(("around", "surfaces"), [(8, 8), (10, 1), (50, 1)])
def test_facets_of_a_cylinder_are_one_surface_those_of_a_prism_are_not(around, surfaces):
    mesh = bc.Mesh(*meshes.tube(3.0, 5.0, around))
    assert len(set(mesh._mesh.shape.surface)) == surfaces and not mesh.is_closed


@pytest.mark.parametrize("around", [10, 12, 50])
def test_a_grain_in_a_tube_has_one_contact_wherever_it_is(around):
    """Also where two facets are as near: at the corners of the prism, which go in. So on the outside, where they stick out."""
    vertices, triangles = meshes.tube(3.0, 10.0, around)
    angle, inner = np.linspace(0.0, 2.0 * np.pi, 4 * around, endpoint=False), 3.0 * np.cos(np.pi / around)
    for radius in (inner - 0.9, inner + 0.97):
        for phi in angle:
            place = (10 + radius * np.cos(phi), 10 + radius * np.sin(phi), 15.0)
            sim = touching(bc.Mesh(np.add(vertices, 10), triangles), place, radius=1.0)
            assert sim.walls[0].contacts == 1, (radius, phi)


def test_a_plane_in_the_mesh_is_one_plane_whatever_its_triangles():
    for kind in ("two", "regular", "random", "slivers", "split"):
        vertices, triangles = meshes.floor(kind)
        mesh = bc.Mesh(meshes.turned(vertices, (0.3, -0.5, 1.0)), triangles)
        assert mesh.patches == 1 and len(np.unique(mesh._mesh.shape.planes[:, 0], axis=0)) == 1, kind


def test_memory_goes_over_edges_that_stick_out():
    """Grains are sent over the edges of a cube to all sides: one contact in every step, whose memory changes by what it slips in
    a step, also where the foot goes from a patch to a lower or a higher one."""
    changes = 0
    for way in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        sim = simulation(gravity=(0, 0, -20), dt=5e-4, properties=SOFT | {"kn": 1e4, "kt": 3e3, "gamma_n": 60.0, "friction": 0.6})
        sim.add_wall(bc.Mesh(*CUBE))
        sim.add_grains([(10 + 1.73 * way[0], 10 + 1.73 * way[1], 12.5)], 0.5, velocity=(*np.multiply(way, 1.0), 0))
        sim.run(200)
        memory, keys = [], []
        for _ in range(1200):
            sim.run(1)
            table = contact_table(sim)
            if not len(table["memory"]):
                break
            assert len(table["memory"]) == 1
            memory.append(table["memory"][0])
            keys.append(int(table["second"][0]))
            lowest = sim.contacts.surface[3, sim.contacts.surface[0] < 1.0][0]
        jumps = np.abs(np.diff(memory, axis=0)).max(axis=1)
        assert lowest < 0.9, "it does not go over the edge"
        assert jumps.max() < 0.1 * np.abs(memory).max(), "the memory is lost"
        changes += np.count_nonzero(np.diff(keys))
    assert changes > 0


def test_memory_goes_along_a_cylinder():
    """A grain slides down in a mesh of 90 facets, from patch to patch, always with all its friction."""
    vertices, triangles = meshes.tube(3.0, 12.0, 90)
    sim = simulation(bc.Box((-20,) * 3, (20,) * 3), dt=2e-4, gravity=(0, -20, 0), properties=SOFT | {"friction": 0.1})
    sim.add_wall(bc.Mesh(vertices, triangles))
    sim.add_grains([(2.49 * np.cos(-2.6), 2.49 * np.sin(-2.6), 6)], 0.5)
    sim.run(200)
    memory, keys = [], []
    for _ in range(5000):
        sim.run(1)
        table = contact_table(sim)
        assert len(table["memory"]) <= 1
        memory.append(np.linalg.norm(table["memory"]))
        keys.append(int(table["second"][0]) if len(table["memory"]) else 0)
    changes = np.flatnonzero((np.diff(keys) != 0) & (np.array(keys[1:]) != 0) & (np.array(keys[:-1]) != 0))
    memory = np.array(memory)
    assert np.count_nonzero(memory[changes] > 0.2 * memory.max()) >= 10
    assert np.abs(np.diff(memory))[changes].max() < 0.05 * memory.max(), "more than the turn of the normal from facet to facet"


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_a_grain_on_the_rim_of_a_hole_remembers_each_of_its_contacts(turn):
    """It lies in a square hole of a flat plate, which is one surface, and touches its four edges, wherever triangles end. As the
    plate turns below it, each contact stores what it slips there: the angle times its distance from the axis."""
    x, y = np.meshgrid([-2.0, -0.3, 0.3, 2.0], [-2.0, -0.3, 0.3, 2.0], indexing="ij")
    vertices, triangles = meshes.sheet(np.stack([x, y, 0.0 * x], axis=-1))
    sim = simulation(dt=1e-4, properties={"kn": 1000.0, "kt": 300.0, "friction": 10.0})
    frame = np.array([(np.cos(turn), np.sin(turn), 0), (-np.sin(turn), np.cos(turn), 0), (0, 0, 1)])
    plate = bc.Mesh(vertices @ frame + 10.0, np.delete(triangles, [4, 13], axis=0), omega=(0, 0, 0.01))
    sim.add_wall(plate)
    sim.add_grains([(10, 10, 10 + np.sqrt(0.48**2 - 0.3**2))], 0.5, mass=1e9, inertia=1e9)
    sim.run(200)
    table = contact_table(sim)
    assert plate.contacts == 4 and len(set(table["second"].tolist())) == 4
    slip = np.linalg.norm(table["memory"].reshape(4, -1), axis=1)
    np.testing.assert_allclose(slip, 0.3 * 0.01 * 200e-4, rtol=1e-5)


def test_the_surface_moves_with_the_mesh():
    """Velocity and rotation about its point, and a mesh that has turned by a quarter is touched there."""
    sim = simulation(dt=1e-3)
    wall = sim.add_wall(bc.Mesh(*meshes.box((8, 9, 9), (12, 11, 11)), omega=(0, 0, 0.5 * np.pi / 0.1), velocity=(0, 0, 1.0)))
    sim.add_grains([(10, 14, 10.1)], 0.5)
    sim.run(100)
    sim.grains.position[0] = np.add(wall.point, (0.2, 2.47, 0))
    sim.prepare()
    assert sim.contacts.surface[1:4, 0] == pytest.approx((0, 1, 0), abs=1e-12)
    assert sim.contacts.surface[0, 0] == pytest.approx(0.47, abs=1e-12)
    expected = np.add((0, 0, 1), np.cross((0, 0, 0.5 * np.pi / 0.1), (0.2, 2.0, 0)))
    assert sim.contacts.surface[7:10, 0] == pytest.approx(expected, abs=1e-11)
    assert wall.places.reshape(-1, 3).max(axis=0) == pytest.approx(np.add(wall.point, (1, 2, 1)))


MOVING = {
    "a paddle that turns": lambda: bc.Mesh(*meshes.box((1, 4.5, 1), (9, 5.5, 9)), omega=(0, 1.0, 4.0)),
    "a ball that flies": lambda: bc.Mesh(*meshes.ball(1.5, 2), velocity=(20, 18, 15), omega=(3, 2, 1)),
    "a sheet that falls": lambda: bc.Mesh(
        meshes.floor("regular", 10.0)[0] + (0, 0, 9), meshes.floor("regular")[1], velocity=(0, 0, -20)
    ),
}


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("name", MOVING)
def test_no_contact_with_a_moving_mesh_is_missed(name, periodic):
    """The same bits as with a rebuild in every step, in which no list can be stale; and grains are touched."""
    sims = []
    for _ in range(2):
        sim = simulation(bc.Box(*((-1, -1, -1), (10, 10, 10)) if periodic else ((-20,) * 3, (30,) * 3), (periodic,) * 3), dt=4e-4)
        sim.max_overlap = np.inf
        random = np.random.default_rng(7)
        cells = np.stack(np.meshgrid(*3 * [np.arange(7)], indexing="ij"), axis=-1).reshape(-1, 3)
        place = 1.0 + 1.2 * cells + random.uniform(-0.05, 0.05, cells.shape)
        sim.add_grains(place, random.choice([0.2, 0.4], len(cells)), velocity=random.normal(scale=0.3, size=cells.shape))
        sim.add_wall(MOVING[name]())
        sims.append(sim)
    seldom, always = sims
    always.staleness.also_when = lambda step: True
    touched = 0
    for _ in range(12):
        for sim in sims:
            sim.run(20)
        assert fingerprint(seldom) == fingerprint(always)
        touched = max(touched, seldom.walls[0].contacts)
    assert touched > 6 and seldom.staleness.rebuilds < 200


@pytest.mark.parametrize("speed", [30.0, 300.0, 3e3, 1.7e4])
@pytest.mark.parametrize("mesh", [
    lambda: bc.Mesh(meshes.floor("random", 20.0)[0] + (0, 0, 10), meshes.floor("random")[1]),
    lambda: bc.Mesh(*meshes.box((2, 2, 9.999), (18, 18, 10))),
])  # fmt: skip
def test_no_grain_goes_through_however_fast_it_is(mesh, speed):
    """Up to 17 times its diameter in a step."""
    sim = simulation(properties=NOTHING)
    sim.add_wall(mesh())
    sim.add_grains([(10.1, 9.7, 19.0)], 0.5, velocity=(0.3, 0.1, -speed))
    with pytest.raises(OverlapError, match=r"grain 0 and wall 0 at .* allowed are 20 %"):
        sim.run(2000)
    assert sim.grains.position[0, 2] < 10.5


def test_grains_that_pass_beside_a_sheet_go_on():
    sim = simulation(properties=NOTHING)
    sim.add_wall(bc.Mesh(meshes.floor("two", 10.0)[0] + (0, 0, 10), meshes.floor("two")[1]))
    sim.add_grains([(10.6, 5.0, 19.0), (15, 5, 19)], 0.5, velocity=(0, 0, -3e3))
    sim.run(4)
    assert (sim.grains.position[:, 2] < 8.0).all()


def test_a_sheet_that_is_faster_than_grains_are_large_is_noticed():
    sim = simulation(properties=NOTHING)
    sim.add_wall(bc.Mesh(meshes.floor("two", 20.0)[0] + (0, 0, 1), meshes.floor("two")[1], velocity=(0, 0, 4e3)))
    sim.add_grains([(10, 9, 10)], 0.5)
    with pytest.raises(OverlapError, match="grain 0 and wall 0"):
        sim.run(4)


def test_a_mesh_across_periodic_faces_is_touched_in_all_its_images():
    """A hilly floor that fits the period, beside one of nine such pieces in a box that is not periodic there."""
    line = np.linspace(0.0, 6.0, 13)
    x, y = np.meshgrid(line, line, indexing="ij")
    hills = np.stack([x, y, 1.0 + 0.3 * np.sin(2 * np.pi * x / 6.0) * np.cos(2 * np.pi * y / 6.0)], axis=-1)
    rng = np.random.default_rng(2)
    places = np.column_stack([rng.uniform(0, 6, (300, 2)), rng.uniform(1.2, 1.6, 300)])
    one = bc.Mesh(*meshes.sheet(hills))
    sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), (True, True, False)), properties=SOFTER)
    sim.max_overlap = np.inf
    sim.add_wall(one)
    nine = meshes.joined(*(meshes.sheet(np.add(hills, (6 * a, 6 * b, 0))) for a in (0, 1, 2) for b in (0, 1, 2)))
    other = simulation(bc.Box((0, 0, 0), (18, 18, 6)), properties=SOFTER)
    other.max_overlap = np.inf
    other.add_wall(bc.Mesh(*nine))
    for s, shift in ((sim, (0, 0, 0)), (other, (6, 6, 0))):
        s.add_grains(places[:1] + shift, 0.4)
        s.prepare()
    for place in places:
        for s, shift in ((sim, (0, 0, 0)), (other, (6, 6, 0))):
            s.grains.position[0] = place + shift
            s.prepare()
        assert sim.walls[0].contacts == other.walls[0].contacts
        np.testing.assert_allclose(sim.grains.force, other.grains.force, atol=1e-9)
    np.testing.assert_allclose(sim.walls[0].distance(places), other.walls[0].distance(np.add(places, (6, 6, 0))), atol=1e-13)


SOFTER = {"kn": 1000.0, "kt": 300.0, "friction": 0.0}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: bc.Mesh([(0, 0)], [(0, 0, 0)]), r"vertices have shape \(1, 2\); they must be \(v, 3\) finite numbers"),
        (lambda: bc.Mesh(np.full((3, 3), np.nan), [(0, 1, 2)]), "must be .* finite"),
        (lambda: bc.Mesh(CUBE[0], [(0, 1, 8)]), r"triangle 0 has vertices \[0, 1, 8\]; there are 8, numbered from 0"),
        (lambda: bc.Mesh(CUBE[0], [(0.0, 1, 2)]), "type float64; they must be"),
        (lambda: bc.Mesh(CUBE[0], np.zeros((0, 3), int)), r"shape \(0, 3\)"),
        (lambda: bc.Mesh(CUBE[0], [(0, 1, 2), (0, 3, 3)]), r"triangle 1, .* has no area \(1 such"),
        (lambda: bc.Mesh(CUBE[0], CUBE[1][1:], inside=True), r"True needs a closed mesh; the edge .* belongs to 1 tri.*3 such"),
        (lambda: bc.Mesh(CUBE[0], [CUBE[1][0][::-1], *CUBE[1][1:]]), "triangles 0 and . run along their .*3 such pairs"),
        (lambda: bc.Mesh(*CUBE, inside="no"), "inside = 'no' must be True"),
        (lambda: bc.Mesh(*CUBE, feature_angle=120), "feature_angle = 120 .degrees. must be between 0 and 90"),
        (lambda: simulation(bc.Box((0, 0), (9, 9))).add_wall(bc.Mesh(*CUBE)), "wall 0 .mesh.: a mesh needs three dimensions"),
    ],
)  # fmt: skip
def test_what_is_no_mesh_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.parametrize(("factor", "ok"), [(3.5e-3, False), (5e-3, True), (1.0, True), (4e7, False)])
def test_a_mesh_is_of_a_size_that_grains_can_touch(factor, ok):
    """Extents of 0.014, 0.02, 4 and 1.6e8 for grains of radius 0.5 in a box of 4 or 1e7."""
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4)) if factor < 10.0 else bc.Box((0, 0, 0), (1e7, 1e7, 1e7)))
    sim.add_wall(bc.Mesh(np.multiply(CUBE[0] - 10.0, factor) + 2.5, CUBE[1]))
    sim.add_grains([(1, 1, 1)], 0.5)
    sim.max_overlap = np.inf
    if ok:
        sim.run(1)
    else:
        with pytest.raises(
            SceneError, match=r"wall 0 .mesh.: it extends over .* typical grain has a radius of 0.5: is its unit right"
        ):
            sim.run(1)


def test_cracks_and_small_holes_are_told():
    """A ball without one triangle, and one whose triangles lack common vertices by the rounding of a file; sheets are none."""
    vertices, triangles = meshes.ball(3.0, 3)
    with pytest.warns(UserWarning, match="mesh: it has holes, 3 edges of one triangle only, but small ones"):
        bc.Mesh(vertices, triangles[1:])
    with pytest.warns(UserWarning, match="mesh: 1[0-9]{3} of 1[0-9]{3} open edges nearly meet others.* it has cracks"):
        bc.Mesh(vertices + np.random.default_rng(1).uniform(-1e-6, 1e-6, vertices.shape), triangles)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bc.Mesh(vertices + np.random.default_rng(1).uniform(-1e-12, 1e-12, vertices.shape), triangles, inside=True)
        for kind in ("two", "regular", "slivers", "random"):
            bc.Mesh(*meshes.floor(kind))
        bc.Mesh(*meshes.tube(1.0, 100.0, 20, 30))
        bc.Mesh(*CUBE)


def test_places_are_those_of_the_triangles_as_they_were_given():
    """In their order, however they are sorted within; where the mesh is once it has moved and turned by half a turn."""
    vertices, triangles = meshes.ball(2.0, 2)
    mesh = bc.Mesh(vertices, triangles, velocity=(0.5, 0, 0), omega=(0, 0, np.pi))
    for sign in (1, -1):
        given = vertices[triangles].mean(axis=1) * (sign, sign, 1) + (0.0 if sign > 0 else 0.5, 0, 0)
        np.testing.assert_allclose(mesh.places.mean(axis=1), given, rtol=0.0, atol=1e-12)
        mesh.move(1.0)


def test_vertices_that_meet_across_a_period_are_one():
    """Also where rounding takes one of them to the other end."""
    places = np.array([(0.0, 1, 2), (6.0, 1, 2), (6.0 - 1e-13, 1, 2), (-1e-14, 1.0 + 1e-12, 2), (3, 1, 2)])
    for shift in (0.0, 1e-3, 2.5):
        assert len(set(welded(np.add(places, (shift, 0, 0)), (6.0, 0, 0))[:4].tolist())) == 1
        assert len(set(welded(np.add(places, (shift, 0, 0))).tolist())) == 3


def lid(wall, control=None):
    """Grains in a row on a floor, and a wall above them."""
    sim = simulation(dt=1e-3, properties=SOFT | {"gamma_n": 20.0})
    sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    wall.control = control
    sim.add_wall(wall)
    sim.add_grains([(x, 10.0, 1.49) for x in (6.0, 8.0, 10.0, 12.0)], 0.5)
    return sim


def test_a_servo_pushes_a_mesh_as_it_pushes_a_plane():
    """To the force, on the same way, while it slides along itself; what presses on it is the force against its direction."""
    sims = []
    for wall in (
        bc.Mesh(meshes.floor("random")[0] + (0, 0, 2.1), meshes.floor("random")[1], velocity=(0.1, 0, 0), towards=(0, 0, -3)),
        bc.Plane((0, 0, 2.1), (0, 0, -1), velocity=(0.1, 0, 0)),
    ):
        sim = lid(wall, Servo(max_speed=2.0, force=60.0))
        sim.run(3000)
        sims.append(sim)
    mesh, plane = (sim.walls[1] for sim in sims)
    assert mesh.pressing == pytest.approx(60.0, rel=1e-3) and mesh.pressing == pytest.approx(plane.pressing, rel=1e-9)
    assert mesh.pressing == -mesh.force @ mesh.towards and mesh.towards.tolist() == [0.0, 0.0, -1.0]
    assert mesh.point[2] == pytest.approx(plane.point[2], rel=1e-9) and mesh.velocity[0] == 0.1
    assert mesh.response.stiffness == pytest.approx(plane.response.stiffness, rel=1e-9)


@pytest.mark.parametrize("wall", [bc.Mesh(*CUBE), bc.Cone((9, 9, 9), (0, 0, 1), 1.0, 2.0, 1.0)], ids=["mesh", "cone"])
def test_a_wall_that_does_not_know_where_to_is_not_pushed(wall):
    sim = lid(wall, Servo(max_speed=2.0, force=60.0))
    with pytest.raises(SceneError, match=r"wall 1 .(mesh|cone).: a Servo cannot push it, since it is not known where to; "):
        sim.run(1)


def test_forces_on_triangles_are_told_one_by_one(monkeypatch):
    """Three grains on known faces of a cube; their sum is the force on the mesh, on several ranks, too."""

    def program():
        mesh = bc.Mesh(*CUBE, point=(9, 9, 9))
        sim = touching(mesh, (9, 11, 12.47), (11, 9, 12.48), (12.47, 10.5, 9))
        return triangle_forces(sim, mesh), mesh.force, triangle_torques(sim, mesh), mesh.torque

    expected = np.zeros((12, 3))
    expected[[2, 3, 10, 11]] = np.nan  # on faces z = 12 and x = 12, either of two triangles
    for ranks, at_a_time in ((1, 10_000), (2, 10_000), (1, 5)):
        monkeypatch.setattr(sys.modules["barchan.measure.triangle_forces"], "AT_A_TIME", at_a_time)
        forces, force, torques, torque = virtual_ranks(ranks, program)[-1]
        np.testing.assert_allclose(forces.sum(axis=0), force, atol=1e-12)
        np.testing.assert_allclose(torques.sum(axis=0), torque, atol=1e-11)
        middle = 10.0 * np.cross((3, 1.5, 0), (-3, 0, 0)) / 10.0  # of the grain at x = 12, y = 10.5, z = 9
        np.testing.assert_allclose(torques[[10, 11]].sum(axis=0), 10.0 * middle, atol=1e-9)
        assert ((torques != 0.0).any(axis=1) <= (forces != 0.0).any(axis=1)).all()
        assert not forces[np.isfinite(expected).all(axis=1)].any()
        np.testing.assert_allclose(np.sort(forces[[2, 3], 2]), [-30.0, -20.0])
        assert sorted(forces[[10, 11], 0]) == pytest.approx([-30.0, 0.0])


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_the_time_step_has_to_suit_a_mesh_that_is_stiffer_than_the_grains(share):
    """0.17 sqrt(m/k) with the stiffness of grain and mesh: in that step a grain bounces without loss, a longer one is refused."""
    soft, hard = (bc.Material(name, density=1.0, kn=kn, kt=1.0, friction=0.0) for name, kn in (("soft", 1e2), ("hard", 1e6)))
    sim = bc.Simulation(bc.Box((0, 0, -1), (6, 6, 6)), bc.laws.linear, [soft, hard], dt=1.0, threads=1)
    sim.add_wall(bc.Mesh(*meshes.floor("two", 6.0), material="hard"))
    sim.add_grains((3, 2, 0.6), 0.5, "soft", velocity=(0, 0, -1.0))
    stiffness = sim.materials.table(bc.laws.linear)[list(bc.laws.linear.parameters).index("kn"), 1]
    sim.dt = share * 0.17 * np.sqrt(sim.grains.mass[0] / stiffness)
    if share > 1.0:
        with pytest.raises(SceneError, match="above the stable time step"):
            sim.run(1)
    else:
        for _ in range(int(0.6 / sim.dt)):
            sim.run(1)
        assert sim.grains.velocity[0, 2] == pytest.approx(1.0, rel=0.01) and stiffness > 1.9e2
