"""Round walls and walls that turn: distances and normals in closed form, velocities, and no contact that is missed."""

import numpy as np
import pytest
from scenes import fingerprint, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.measure import contact_table

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

CENTRE = np.array([10.0, 10.0, 10.0])
OVERLAP = 0.03

CYLINDER = bc.Cylinder, {"point": CENTRE, "axis": (0, 0, 2), "radius": 4.0}
SPHERE = bc.Sphere, {"point": CENTRE, "radius": 4.0}

#: Around (10, 10, 10): a wall, where a grain of radius 0.5 overlaps it by 0.03, and the normal there.
PLACES = {
    "in a cylinder": (CYLINDER, (3.53, 0, 1), (-1, 0, 0)),
    "across it": (CYLINDER, (0, -3.53, -2), (0, 1, 0)),
    "around a cylinder": ((CYLINDER[0], CYLINDER[1] | {"inside": False}), (0, 4.47, 3), (0, 1, 0)),
    "in a sphere": (SPHERE, (0, 0.6 * 3.53, 0.8 * 3.53), (0, -0.6, -0.8)),
    "around a sphere": ((SPHERE[0], SPHERE[1] | {"inside": False}), (-0.6 * 4.47, 0, 0.8 * 4.47), (-0.6, 0, 0.8)),
    # the generator from (r, z) = (1, 0) to (4, 4): its direction is (0.6, 0.8), across it (-0.8, 0.6) inwards and up
    "in a funnel": ((bc.Cone, {"point": CENTRE, "axis": (0, 0, 1), "radius_low": 1.0, "radius_high": 4.0, "length": 4.0}),
                    (2.5 - 0.8 * 0.47, 0, 2 + 0.6 * 0.47), (-0.8, 0, 0.6)),
    "below a funnel": ((bc.Cone, {"point": CENTRE, "axis": (0, 0, 1), "radius_low": 1.0, "radius_high": 4.0, "length": 4.0}),
                       (0, 2.5 + 0.8 * 0.47, 2 - 0.6 * 0.47), (0, 0.8, -0.6)),
    "on its upper rim": ((bc.Cone, {"point": CENTRE, "axis": (0, 0, 1), "radius_low": 1.0, "radius_high": 4.0, "length": 4.0}),
                         (4.0, 0, 4.47), (0, 0, 1)),
    "in a tube": ((bc.Cone, {"point": CENTRE, "axis": (1, 0, 0), "radius_low": 2.0, "radius_high": 2.0, "length": 6.0}),
                  (3, 0, -1.53), (0, 0, 1)),
    "on a ring": ((bc.Cone, {"point": CENTRE, "axis": (0, 0, 1), "radius_low": 1.0, "radius_high": 5.0, "length": 0.0}),
                  (0, 3, 0.47), (0, 0, 1)),
    "below a ring": ((bc.Cone, {"point": CENTRE, "axis": (0, 0, 1), "radius_low": 1.0, "radius_high": 5.0, "length": 0.0}),
                     (0, 3, -0.47), (0, 0, -1)),
}  # fmt: skip


@pytest.mark.nojit
@pytest.mark.parametrize("where", PLACES)
def test_a_grain_is_pushed_along_the_normal_by_its_overlap(where):
    (make, given), place, normal = PLACES[where]
    sim = simulation(dt=1e-5)
    wall = sim.add_wall(make(**given))
    sim.add_grains([CENTRE + place], 0.5)
    sim.prepare()
    force = sim.grains.force[0]
    assert force == pytest.approx(1000.0 * OVERLAP * np.array(normal), rel=1e-9, abs=1e-9)
    assert wall.force == pytest.approx(-force) and wall.contacts == 1
    assert wall.pressing == pytest.approx(1000.0 * OVERLAP) and wall.response.stiffness == pytest.approx(1000.0)
    contact = CENTRE + np.array(place) - 0.47 * np.array(normal)
    assert wall.torque == pytest.approx(np.cross(contact - wall.point, -force), abs=1e-9)


def test_the_funnel_has_a_hole():
    (make, given), *_ = PLACES["in a funnel"]
    sim = simulation(dt=5e-4, gravity=(0, 0, -10))
    sim.add_wall(make(**given))
    sim.add_grains(np.add(CENTRE, [(0.1, 0, 3), (2.0, 0, 3)]), 0.3)
    sim.run(3000)
    assert (sim.grains.position[:, 2] < 10.0).all(), "both fall through"


@pytest.mark.parametrize(("make", "share"), [(CYLINDER, 0.5), (SPHERE, 1.0)])
@pytest.mark.parametrize("inside", [True, False])
def test_curvature_reaches_the_law(make, share, inside):
    """Hertz: F = 4/3 E* sqrt(R*) overlap^(3/2) with 1/R* = 1/r -+ the mean curvature of the wall."""
    glass = bc.Material("g", density=1.0, youngs_modulus=1e5, poisson_ratio=0.25, friction=0.0)
    sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), bc.laws.hertz_mindlin, glass, dt=1e-5)
    sim.add_wall(make[0](**make[1], inside=inside))
    sim.add_grains(np.add(CENTRE, [(3.53 if inside else 4.47, 0, 0)]), 0.5)
    sim.prepare()
    effective = 1.0 / (1.0 / 0.5 + (-share if inside else share) / 4.0)
    modulus = 1e5 / (2.0 * (1.0 - 0.25**2))
    assert abs(sim.grains.force[0, 0]) == pytest.approx(4.0 / 3.0 * modulus * effective**0.5 * OVERLAP**1.5, rel=1e-9)


@pytest.mark.nojit
@pytest.mark.parametrize("where", ["in a cylinder", "around a sphere", "in a tube"])
def test_the_surface_moves_with_all_motions_of_the_wall(where):
    """Velocity, rotation about its own axis and growth add up at the contact."""
    (make, given), place, normal = PLACES[where]
    axis = np.array(given.get("axis", (0, 0, 1)))
    more = {} if make is bc.Cone else {"radial_velocity": 0.25}
    sim = simulation()
    wall = sim.add_wall(make(**given, velocity=(0.1, 0.2, 0.3), omega=1.5 * axis, **more))
    sim.add_grains([CENTRE + place], 0.5)
    sim.prepare()
    outwards = np.array(place) - (np.array(place) @ wall.axis * wall.axis if make is not bc.Sphere else 0.0)
    outwards = outwards / np.sqrt(outwards @ outwards)
    contact = np.array(place) - 0.47 * np.array(normal)
    expected = np.array([0.1, 0.2, 0.3]) + np.cross(1.5 * axis, contact) + (0.25 * outwards if more else 0.0)
    assert sim.contacts.surface[7:10, 0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.nojit
def test_the_normal_at_the_half_step_is_that_of_the_grain_half_a_step_before():
    sim = simulation(dt=0.01)
    sim.check_dt = False
    sim.add_wall(bc.Cylinder(CENTRE, (0, 0, 1), 4.0, velocity=(0, 1.0, 0)))
    sim.add_grains(np.add(CENTRE, [(3.6, 0, 0)]), 0.5, velocity=(0, 3.0, 0))
    sim.run(1)
    grain, wall = sim.grains, sim.walls[0]
    before = (grain.position[0] - wall.point - 0.005 * (grain.velocity[0] - wall.velocity))[:2]
    assert sim.contacts.surface[4:6, 0] == pytest.approx(-before / np.sqrt(before @ before), rel=1e-12)


def test_a_plane_turns_about_its_point():
    """A quarter turn in 100 steps; the velocity of the surface at a contact is omega x r."""
    sim = simulation(dt=1e-3)
    wall = sim.add_wall(bc.Plane((10, 10, 1), (0, 0, 1), omega=(0.0, 0.5 * np.pi / 0.1, 0.0)))
    sim.add_grains([(12, 10, 15)], 0.5)
    sim.run(100)
    assert wall.normal == pytest.approx([1, 0, 0], abs=1e-12) and np.linalg.norm(wall.normal) == pytest.approx(1.0, abs=1e-15)
    tilted = simulation()
    wall = tilted.add_wall(bc.Plane((10, 10, 1), (0, 0, 1), omega=(0, 0.3, 0)))
    tilted.add_grains([(12, 10, 1.45)], 0.5)
    tilted.prepare()
    assert tilted.contacts.surface[7:10, 0] == pytest.approx([0, 0, -0.6], abs=1e-12)


@pytest.mark.nojit
def test_a_plane_that_turns_has_its_normal_of_the_half_step_too():
    sim = simulation(dt=1e-3)
    sim.add_wall(bc.Plane((10, 10, 1), (0, 0, 1), omega=(0, 2.0, 0)))
    sim.add_grains([(10, 10, 1.45)], 0.5)
    sim.run(1)
    normal, half = sim.contacts.surface[1:4, 0], sim.contacts.surface[4:7, 0]
    assert normal == pytest.approx([np.sin(2e-3), 0, np.cos(2e-3)], abs=1e-14)
    assert half == pytest.approx([np.sin(1e-3), 0, np.cos(1e-3)], abs=1e-14)


MOVING = {
    "a plane that turns": lambda: bc.Plane((0, 0, 1.2), (0, 0, 1), omega=(2.0, 0, 0)),
    "a plane that closes in": lambda: bc.Plane((1, 0, 0), (1, 0, 0), velocity=(12, 0, 0)),
    "a cylinder that shrinks": lambda: bc.Cylinder((5, 5, 0), (0, 0, 1), 5.0, radial_velocity=-8.0),
    "a sphere that grows": lambda: bc.Sphere((5, 5, 5), 0.1, inside=False, radial_velocity=12.0),
    "a sphere that flies": lambda: bc.Sphere((0.2, 5, 5), 1.0, inside=False, velocity=(25, 0, 0), omega=(0, 0, 5)),
    "a tube that falls": lambda: bc.Cone((5, 5, 8), (0, 0, 1), 1.0, 3.0, 2.0, velocity=(0, 0, -20), omega=(0, 0, 9)),
}


def crowd(wall):
    """Grains of two sizes in a box, too few to stop the wall."""
    sim = simulation(bc.Box((-5, -5, -5), (15, 15, 15)), dt=4e-4)
    sim.max_overlap = 1.0
    random = np.random.default_rng(7)
    cells = np.stack(np.meshgrid(*3 * [np.arange(7)], indexing="ij"), axis=-1).reshape(-1, 3)
    place = 2.0 + cells + random.uniform(-0.05, 0.05, cells.shape)
    sim.add_grains(place, random.choice([0.2, 0.4], len(cells)), velocity=random.normal(scale=0.5, size=cells.shape))
    sim.add_wall(wall)
    return sim


@pytest.mark.parametrize("name", MOVING)
def test_no_contact_with_a_moving_wall_is_missed(name):
    """The same bits as with a rebuild in every step, in which no list can be stale; and grains are touched."""
    seldom, always = crowd(MOVING[name]()), crowd(MOVING[name]())
    always.staleness.also_when = lambda step: True
    touched = 0
    for _ in range(25):
        for sim in (seldom, always):
            sim.run(10)
        assert fingerprint(seldom) == fingerprint(always)
        touched = max(touched, seldom.walls[0].contacts)
    assert touched > 3 and seldom.staleness.rebuilds < 200


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: bc.Cylinder(CENTRE, (0, 0, 1), 0.0), r"cylinder: radius = 0.0 \[length\] must be a finite number > 0"),
        (lambda: bc.Cylinder(CENTRE, (0, 0, 0), 1.0), r"cylinder: axis = \(0, 0, 0\) has no direction"),
        (lambda: bc.Cylinder(CENTRE, (0, 0, 1), 1.0, "no"), "inside = 'no' must be True"),
        (lambda: bc.Sphere(CENTRE, np.nan), "sphere: radius = nan"),
        (lambda: bc.Sphere((0, 0), 1.0), "sphere: point = .* must be three finite numbers"),
        (lambda: bc.Cone(CENTRE, (0, 0, 1), -1.0, 1.0, 1.0), "cone: radius_low = -1.0 .* must be a finite number >= 0"),
        (lambda: bc.Cone(CENTRE, (0, 0, 1), 1.0, 1.0, 0.0), "with length 0 and two radii of 1 .* there is no shell"),
        (lambda: bc.Plane(CENTRE, (0, 0, 1), omega=(0, np.inf, 0)), "plane: omega = "),
    ],
)
def test_what_is_no_wall_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.parametrize(
    ("wall", "message"),
    [
        (lambda: bc.Cylinder((5, 5, 5), (0, 1, 0), 2.0), "wall 0 .cylinder.: it is round across x, where the box is periodic"),
        (lambda: bc.Sphere((5, 5, 5), 2.0), "it is round across x"),
        (lambda: bc.Plane((0, 0, 0), (0, 0, 1), omega=(0, 1, 0)), "towards x, where the box is periodic"),
        (lambda: bc.Cylinder((5, 5, 5), (1, 0, 0), 2.0, omega=(0, 1, 0)), "must be along its axis"),
    ],
)
def test_a_wall_that_does_not_fit_the_box_is_refused(wall, message):
    with pytest.raises(SceneError, match=message):
        simulation(bc.Box((0, 0, 0), (9, 9, 9), (True, False, False))).add_wall(wall())


def test_a_wall_in_no_scene_has_no_load():
    with pytest.raises(SceneError, match="this plane is in no scene yet"):
        _ = bc.Plane((0, 0, 0), (0, 0, 1)).force


def test_a_load_is_refused_once_the_scene_was_changed():
    sim = simulation()
    wall = sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    sim.add_grains([(5, 5, 1.47)], 0.5)
    with pytest.raises(SceneError, match="the scene was changed since its contacts were computed"):
        _ = wall.contacts
    sim.run(1)
    before = wall.pressing
    assert before > 0.0 and contact_table(sim)["force"][0, 2] == before
    wall.velocity = (0, 0, 1)
    sim.add_grains([(8, 8, 8)], 0.5)
    with pytest.raises(SceneError, match="changed"):
        _ = wall.force
