"""A plane cut into triangles gives a plane's forces and memory; meshes of round walls converge to these; energy is kept."""

import meshes
import numpy as np
import pytest

import barchan as bc
from barchan.measure import EnergyAccount, EnergyBudget, contact_table

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

ELASTIC = {"youngs_modulus": 4e5, "poisson_ratio": 0.3, "restitution": 0.6, "friction": 0.4}
LAWS = {
    "linear": (bc.laws.linear, {"kn": 5e3, "kt": 1.5e3, "gamma_n": 60.0, "gamma_t": 20.0, "friction": 0.4}),
    "hertz_mindlin": (bc.laws.hertz_mindlin, ELASTIC),
    "hertz_mindlin_rolling": (bc.laws.hertz_mindlin_rolling, ELASTIC | {"rolling_friction": 0.1, "rolling_damping": 0.3}),
    "jkr": (bc.laws.jkr, ELASTIC | {"work_of_adhesion": 0.05}),
}
UP = {"flat": (0.0, 0.0, 1.0), "inclined": (0.3, -0.5, 1.0)}


def rollers(law, wall, normal):
    """Grains that are thrown onto a wall through the origin, slide and begin to roll, far from each other."""
    function, properties = LAWS[law]
    sim = bc.Simulation(bc.Box((-20,) * 3, (20,) * 3), function, bc.Material("a", density=10.0, **properties), 2e-4)
    sim.gravity = tuple(-100.0 * normal)
    sim.add_wall(wall)
    rng = np.random.default_rng(3)
    flat = np.stack([*np.meshgrid(np.arange(-4, 5, 2.0), np.arange(-4, 5, 2.0)), np.full((5, 5), 0.29)], axis=-1).reshape(-1, 3)
    velocity = rng.normal(size=(25, 3)) * (3.0, 3.0, 0.1)
    sim.add_grains(meshes.turned(flat, normal), 0.3, velocity=meshes.turned(velocity, normal), omega=rng.normal(size=(25, 3)) * 5)
    return sim


@pytest.mark.parametrize("up", UP)
@pytest.mark.parametrize(
    ("law", "kind"), [*((law, "random") for law in LAWS), *(("linear", k) for k in ("two", "slivers", "split"))]
)
def test_a_plane_cut_into_triangles_is_a_plane(law, kind, up):
    """Forces and torques to 1e-12 of the largest contact force, and memory as well, while grains roll over hundreds of edges.
    Places and velocities are made the same again at every look: how rounding grows along a path is not what is asked."""
    normal = np.array(UP[up]) / np.linalg.norm(UP[up])
    vertices, triangles = meshes.floor(kind)
    mesh = bc.Mesh(meshes.turned(vertices - (10, 10, 0), normal), triangles, point=(0, 0, 0))
    sims = [rollers(law, wall, normal) for wall in (mesh, bc.Plane((0, 0, 0), normal))]
    rolled, largest = 0.0, {"force": 0.0, "memory": 0.0}
    one, other = (sim.grains for sim in sims)
    for _ in range(75):
        tables = []
        for sim in sims:
            sim.run(20)
            tables.append(contact_table(sim))
        for name in largest:
            largest[name] = max(largest[name], np.abs(tables[1][name]).max())
        for name, arm in (("force", 1.0), ("torque", 0.3)):
            np.testing.assert_allclose(
                one.sorted_by_id(name), other.sorted_by_id(name), rtol=0.0, atol=1e-12 * largest["force"] * arm
            )
        assert (tables[0]["first"] == tables[1]["first"]).all() and len(tables[1]["first"]) >= 8
        for name in largest:
            np.testing.assert_allclose(tables[0][name], tables[1][name], rtol=0.0, atol=1e-12 * largest[name])
        assert sims[0].walls[0].contacts == sims[1].walls[0].contacts
        rolled = max(rolled, np.abs(other.sorted_by_id("omega")).max())
        rows = np.argsort(one.view("id"))
        for name in ("position", "velocity", "omega"):
            getattr(one, name)[rows] = other.sorted_by_id(name)
    assert largest["memory"] > 1e-4 and rolled > 3.0
    assert sims[0].walls[0].force == pytest.approx(sims[1].walls[0].force, rel=1e-12)
    assert sims[0].walls[0].torque == pytest.approx(sims[1].walls[0].torque, rel=1e-10)


def test_a_plane_that_moves_and_turns_is_a_plane_that_moves_and_turns():
    vertices, triangles = meshes.floor("random")
    motion = {"velocity": (0.5, 0.2, 0.3), "omega": (0.3, -0.2, 0.1)}
    mesh = bc.Mesh(vertices - (10, 10, 0), triangles, point=(0, 0, 0), **motion)
    sims = [rollers("linear", wall, np.array([0.0, 0.0, 1.0])) for wall in (mesh, bc.Plane((0, 0, 0), (0, 0, 1), **motion))]
    for _ in range(10):
        for sim in sims:
            sim.run(100)
        one, other = (sim.grains for sim in sims)
        for name in ("force", "torque"):
            np.testing.assert_allclose(one.sorted_by_id(name), other.sorted_by_id(name), rtol=0.0, atol=1e-10)
    assert (other.sorted_by_id("force")[:, 0] != 0.0).sum() > 15


ROUND = {
    "in a sphere": (bc.Sphere((0, 0, 0), 3.0), lambda n: bc.Mesh(*meshes.ball(3.0, n), inside=True)),
    "around a sphere": (bc.Sphere((0, 0, 0), 3.0, inside=False), lambda n: bc.Mesh(*meshes.ball(3.0, n))),
    "in a cylinder": (
        bc.Cylinder((0, 0, 0), (0, 0, 1), 3.0),
        lambda n: bc.Mesh(meshes.tube(3.0, 12.0, 6 * 2**n)[0] - (0, 0, 6), meshes.tube(3.0, 12.0, 6 * 2**n)[1]),
    ),
    "around a cylinder": (
        bc.Cylinder((0, 0, 0), (0, 0, 1), 3.0, inside=False),
        lambda n: bc.Mesh(meshes.tube(3.0, 12.0, 6 * 2**n)[0] - (0, 0, 6), meshes.tube(3.0, 12.0, 6 * 2**n)[1]),
    ),
}


def orbit(name, wall):
    """A grain is pressed against a round wall, slides along it, and rolls."""
    function, properties = LAWS["linear"]
    sim = bc.Simulation(bc.Box((-20,) * 3, (20,) * 3), function, bc.Material("a", density=10.0, **properties), 2e-4)
    sim.gravity = (0, 0, 0)
    sim.add_wall(wall)
    inside = name.startswith("in ")
    sim.gravity = (40.0 if inside else -40.0, 0, 0)
    sim.add_grains([(2.69 if inside else 3.29, 0.1, 0.05)], 0.3, velocity=(0, 2.0, 0.7))
    return sim


@pytest.mark.parametrize("name", ROUND)
def test_meshes_converge_to_round_walls(name):
    """Where the grain is after it has gone over dozens of facets: with 4 times as many along, less than a fifth of the error."""
    exact, make = ROUND[name]
    sim = orbit(name, exact)
    sim.run(1500)
    errors = []
    for n in (3, 4, 5):
        other = orbit(name, make(n))
        for _ in range(15):
            other.run(100)
            assert other.walls[0].contacts <= 1
        errors.append(np.abs(other.grains.view("position") - sim.grains.view("position")).max())
    assert np.abs(sim.grains.view("omega")).max() > 1.0
    assert errors[2] < 0.2 * errors[0] and errors[2] < 0.01, errors


@pytest.mark.parametrize("kind", ["a rough bed", "a closed cage"])
def test_frictionless_grains_keep_their_energy_over_edges_that_stick_out_and_go_in(kind):
    """Forces are the slope of a potential, which has kinks where two places are as near: over 20,000 steps less than 1e-3."""
    properties = {"kn": 5e3, "kt": 1e-6, "gamma_n": 0.0, "friction": 0.0}
    sim = bc.Simulation(bc.Box((-3,) * 3, (3,) * 3), bc.laws.linear, bc.Material("a", density=10.0, **properties), 1e-4)
    vertices, triangles = meshes.ball(2.0, 1) if kind == "a closed cage" else meshes.box((-2,) * 3, (2,) * 3)
    if kind == "a rough bed":
        inner = meshes.box((-0.5,) * 3, (0.5,) * 3)
        vertices, triangles = meshes.joined((vertices, triangles), (inner[0], inner[1][:, ::-1]))
    sim.add_wall(bc.Mesh(vertices, triangles, inside=True))
    places = np.array([(1.2, 0.1, 0.2), (-1.1, 0.2, -0.4), (0.1, 1.2, 0.3), (0.2, -1.1, -0.1), (0.3, 0.2, 1.1), (0, -0.3, -1.2)])
    sim.add_grains(places, 0.25, velocity=1.5 * np.roll(places, 1, axis=1))
    sim.prepare()
    budget = EnergyBudget()
    energies = []
    for _ in range(10):
        sim.run(2000)
        budget.compute(sim)
        energies.append(budget.total)
    assert np.ptp(energies) < 1e-3 * energies[0]


@pytest.mark.parametrize("motion", [{"velocity": (0.3, 0.1, 0.4)}, {"omega": (0.2, 1.5, 0.3)}], ids=["moves", "turns"])
def test_work_of_a_mesh(motion):
    """A closed mesh that shoves grains aside, and one that stirs them: nothing is left over but the error of the step."""
    residuals = []
    for dt in (4e-4, 2e-4):
        sand = bc.Material("a", density=1.0, kn=1e4, kt=3e3, gamma_n=20.0, gamma_t=5.0, friction=0.5)
        sim = bc.Simulation(bc.Box((-9,) * 3, (9,) * 3), bc.laws.linear, sand, dt, (0.0, 0.0, -5.0), threads=1)
        sim.writers = [EnergyAccount()]
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
        sim.add_wall(bc.Mesh(*meshes.box((-1.5, -0.3, 0.1), (1.5, 0.3, 0.9)), **motion))
        sim.add_grains([(x, y, 0.5) for x in (-1.0, 0.0, 1.0) for y in (-0.85, 0.85)], 0.5)
        sim.run(round(1.0 / dt))
        found = sim.writers[0].compute(sim)
        residuals.append(found.residual / found.largest)
        assert found.walls > 0.05
    assert abs(residuals[0]) < 1e-4 and abs(residuals[1]) < 0.6 * abs(residuals[0])
