"""The engine against ``reference_dem``: every law that it knows, random packings, forces after a step and states after 200.

Both scenes are polydisperse (radius ratio 3), have two materials with an override for their pair, walls, frozen grains
(one of which moves as told), random velocities and spins.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from reference_dem import LAWS, ReferenceDEM

import barchan as bc
from barchan.laws import SHIPPED
from barchan.measure import contact_table

#: Collisions of the chosen speeds overlap by more than 5 % here and there, which the engine warns about; it does not matter.
pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

DT = 5e-4
STEPS = 200

#: Properties of the first material, by what a law asks for; all laws are about as stiff as 1000 force/length.
VISCOELASTIC = {
    "linear": {"kn": 1000.0, "kt": 300.0, "gamma_n": 20.0, "gamma_t": 8.0, "friction": 0.3},
    "silbert": {"kn": 5000.0, "kt": 1500.0, "gamma_n": 150.0, "gamma_t": 60.0, "friction": 0.3},
    "hertz": {"kn": 10000.0, "kt": 3000.0, "gamma_n": 300.0, "gamma_t": 120.0, "friction": 0.3},
}
ELASTIC = {"youngs_modulus": 14000.0, "poisson_ratio": 0.3, "friction": 0.3, "restitution": 0.8}


def materials_for(law):
    """Two materials that differ in everything, and what holds for their pair."""
    family = law.removesuffix("_standard")
    if family == "hertz_mindlin":
        other = {"youngs_modulus": 9000.0, "poisson_ratio": 0.1, "friction": 0.6, "restitution": 0.6}
        return [ELASTIC, other], {"youngs_modulus": 12000.0, "restitution": 0.9}
    first = VISCOELASTIC[family]
    factors = {"kn": 0.6, "kt": 0.8, "gamma_n": 2.0, "gamma_t": 3.0, "friction": 2.0}
    return [first, {name: factors[name] * value for name, value in first.items()}], {"kt": 0.4 * first["kt"], "friction": 0.5}


def grow_packing(rng, count, low, high, periodic, walls):
    """Positions and radii of a loose cluster: each grain is put beside one that is there or at a wall, overlapping it by at
    most 4 % of the smaller diameter, or missing it by a little, so that contacts will form and break."""
    length = np.subtract(high, low)
    position, radius = [], []
    while len(radius) < count:
        r = rng.uniform(0.25, 0.75)
        point = rng.uniform(low, high)
        if rng.random() < 0.3:
            wall = walls[rng.integers(len(walls))]
            point = point + wall.normal * (rng.uniform(0.97, 1.01) * r - (point - wall.point) @ wall.normal)
        elif radius:
            beside = rng.integers(len(radius))
            direction = rng.normal(size=3)
            gap = rng.uniform(-0.06, 0.03) * min(r, radius[beside])
            point = position[beside] + (r + radius[beside] + gap) * direction / np.linalg.norm(direction)
        point = np.where(periodic, low + (point - low) % length, point)
        outside = (point < low) | (point > high)
        on_walls = all((point - wall.point) @ wall.normal > 0.96 * r for wall in walls)
        if outside.any() or not on_walls:
            continue
        if radius:
            away = point - np.array(position)
            away -= np.where(periodic, length * np.round(away / length), 0.0)
            room = np.sqrt((away**2).sum(axis=1)) - np.array(radius) - r
            if (room < -0.08 * np.minimum(radius, r)).any():
                continue
        position.append(point)
        radius.append(r)
    return np.array(position), np.array(radius)


def make_scene(kind, seed):
    """Everything but the law, as plain data. ``channel``: periodic along x and z between two walls; ``bin``: no periods, a
    floor, an inclined wall, four upright ones and a lid that moves down."""
    rng = np.random.default_rng(seed)

    def wall(point, normal, material, velocity=(0.0, 0.0, 0.0)):
        normal = np.array(normal) / np.linalg.norm(normal)
        return SimpleNamespace(point=np.array(point, dtype=float), normal=normal, material=material, velocity=np.array(velocity))

    if kind == "channel":
        low, high, periodic = (-1.0, 0.0, 2.0), (3.0, 3.6, 6.2), (True, False, True)
        walls = [wall((0, 0.02, 0), (0, 1, 0), 0, (0.4, 0.0, -0.3)), wall((0, 3.58, 0), (0, -1, 0), 1)]
    else:
        low, high, periodic = (-2.0, 0.0, 0.0), (4.2, 3.8, 4.0), (False, False, False)
        walls = [
            wall((0, 0, 0.02), (0, 0, 1), 1),
            wall((0.8, 0.0, 0.0), (2.0, 0.3, 1.0), 0),
            wall((4.15, 0, 0), (-1, 0, 0), 0),
            wall((0, 0.05, 0), (0, 1, 0), 0),
            wall((0, 3.75, 0), (0, -1, 0), 1),
            wall((0, 0, 3.9), (0.1, 0, -1), 0, (0.0, 0.0, -0.5)),
        ]
    count = 60
    position, radius = grow_packing(rng, count, low, high, np.array(periodic), walls)
    frozen = np.arange(count) % 9 == 4
    velocity, omega = rng.normal(scale=0.9, size=(count, 3)), rng.normal(scale=2.5, size=(count, 3))
    velocity[frozen], omega[frozen] = 0.0, 0.0
    velocity[4] = (0.3, 0.1, -0.2)  # a grain that moves as told, whatever pushes it
    if kind == "channel":  # shift all along the periods, so that a grain leaves at high x and one at low z
        for axis, sign, face in ((0, 1.0, high), (2, -1.0, low)):
            leaving = np.argmax(sign * velocity[:, axis])
            position[:, axis] += face[axis] - sign * 0.01 - position[leaving, axis]
            position[:, axis] = low[axis] + (position[:, axis] - low[axis]) % (high[axis] - low[axis])
    material = (rng.random(count) < 0.5).astype(int)
    mass = 4.0 / 3.0 * np.pi * radius**3 * np.array([1.0, 2.5])[material]
    grains = {
        "position": position,
        "velocity": velocity,
        "omega": omega,
        "radius": radius,
        "mass": mass,
        "inertia": 0.4 * mass * radius**2,
        "material": material,
        "frozen": frozen,
    }
    return SimpleNamespace(low=low, high=high, periodic=periodic, walls=walls, grains=grains)


def both(law, kind, gravity, seed):
    """The same scene in the engine and in the reference."""
    scene = make_scene(kind, seed)
    (first, second), pair = materials_for(law)
    sim = bc.Simulation(
        bc.Box(scene.low, scene.high, scene.periodic),
        SHIPPED[law],
        [bc.Material("first", density=1.0, **first), bc.Material("second", density=2.5, **second)],
        DT,
        gravity,
    )
    sim.materials.set_pair("second", "first", **pair)
    for row in range(len(scene.grains["radius"])):  # one by one, so that ids are the reference's row numbers
        sim.add_grains(**{name: values[row] for name, values in scene.grains.items()})
    for wall in scene.walls:
        sim.add_wall(bc.Plane(wall.point, wall.normal, wall.material, wall.velocity))
    sim.skin = 0.08  # thin, so that the list is rebuilt on the way
    function = gravity if callable(gravity) else lambda time: gravity
    reference = ReferenceDEM(
        law, [first, second], {(0, 1): pair}, scene.low, scene.high, scene.periodic, scene.grains, scene.walls, DT, function
    )
    return sim, reference


def largest(vectors):
    return max(np.sqrt((np.asarray(v) ** 2).sum()) for v in vectors)


def assert_forces_equal(sim, reference, tolerance):
    """Forces, torques and contact forces to ``tolerance`` of the largest contact force (times the largest radius)."""
    scale = largest(contact.force for contact in reference.contacts.values())
    assert np.abs(sim.grains.sorted_by_id("force") - reference.force).max() <= tolerance * scale
    assert np.abs(sim.grains.sorted_by_id("torque") - reference.torque).max() <= tolerance * scale * reference.radius.max()
    table = contact_table(sim)
    assert list(zip(table["first"].tolist(), table["second"].tolist())) == sorted(reference.contacts)
    expected = np.array([reference.contacts[key].force for key in sorted(reference.contacts)])
    assert np.abs(table["force"] - expected).max() <= tolerance * scale


def assert_states_equal(sim, reference, tolerance):
    """Every part of the state to ``tolerance`` of its scale: positions of the largest radius, velocities, angular velocities
    and contact memory each of the largest among them."""
    grains = sim.grains
    away = sim.box.difference(grains.sorted_by_id("position"), reference.position)
    assert np.abs(away).max() <= tolerance * reference.radius.max()
    assert (grains.sorted_by_id("image") == reference.image).all()
    for name in ("velocity", "omega"):
        expected = getattr(reference, name)
        assert np.abs(grains.sorted_by_id(name) - expected).max() <= tolerance * largest(expected), name
    memory = np.array([reference.memory[key] for key in sorted(reference.memory)])
    assert np.abs(contact_table(sim)["memory"] - memory).max() <= tolerance * largest(memory)


def advance(sim, reference, steps):
    """Advance both; returns contacts that formed, that broke, that slid and that stuck, as sets over all steps."""
    formed, broke, slid, stuck = set(), set(), set(), set()
    for _ in range(steps):
        before = set(reference.contacts)
        reference.step()
        after = set(reference.contacts)
        formed, broke = formed | (after - before), broke | (before - after)
        slid |= {key for key in after if reference.contacts[key].slides}
        stuck |= {key for key in after if not reference.contacts[key].slides}
    sim.run(steps)
    return formed, broke, slid, stuck


def has_both(keys):
    """Contacts between grains and contacts at walls are among the keys."""
    return any(partner >= 0 for _, partner in keys) and any(partner < 0 for _, partner in keys)


@pytest.mark.parametrize("kind", ["channel", "bin"])
@pytest.mark.parametrize("law", LAWS)
def test_forces_after_one_step_and_states_after_200(law, kind):
    sim, reference = both(law, kind, (0.5, -1.0, -4.0), seed=len(law) + len(kind))
    sim.prepare()
    assert_forces_equal(sim, reference, 1e-12)  # F(0), before anything moves
    advance(sim, reference, 1)
    assert_forces_equal(sim, reference, 1e-12)
    rebuilds = sim.staleness.rebuilds
    formed, broke, slid, stuck = advance(sim, reference, STEPS - 1)
    assert_forces_equal(sim, reference, 1e-9)
    assert_states_equal(sim, reference, 1e-9)
    # The comparison means something only if things happened on the way.
    assert len(formed) > 10 and len(broke) > 10, "contacts form and break"
    assert has_both(slid) and has_both(stuck), "contacts of both kinds slide and stick"
    assert sim.staleness.rebuilds >= rebuilds + 2, "memory went through rebuilds"
    if kind == "channel":
        assert reference.image[:, 0].any() and reference.image[:, 2].any(), "grains cross the periodic faces"


@pytest.mark.bounds
def test_gravity_as_a_function_of_time():
    """The force of step n has the gravity of t_n: a weight that changes sign within the run tells any other level apart."""

    def gravity(time):
        return 30.0 * np.cos(90.0 * time), -4.0 + 200.0 * time, 10.0 * np.sin(50.0 * time)

    sim, reference = both("silbert", "channel", gravity, seed=3)
    advance(sim, reference, 1)
    assert_forces_equal(sim, reference, 1e-12)
    advance(sim, reference, STEPS - 1)
    assert_forces_equal(sim, reference, 1e-9)
    assert_states_equal(sim, reference, 1e-9)


@pytest.mark.bounds
def test_memory_is_kept_when_the_run_is_cut_and_primed_again():
    """Between runs, an edited velocity makes the forces be evaluated anew with dt = 0; the memory must not advance."""
    sim, reference = both("hertz", "bin", (0.0, 0.0, -4.0), seed=5)
    advance(sim, reference, 60)
    kick = np.array([0.2, -0.1, 0.3])
    sim.grains.velocity[sim.grains.row_of(7)] += kick
    reference.velocity[7] += kick
    reference.compute_forces(0.0)
    sim.prepare()
    assert_forces_equal(sim, reference, 1e-9)
    advance(sim, reference, 60)
    assert_states_equal(sim, reference, 1e-9)
