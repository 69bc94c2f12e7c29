"""Where energy goes: each term in closed form, and nothing left over but the error of the time step."""

from math import exp, pi, sqrt

import numpy as np
import pytest

import barchan as bc
from barchan.errors import SceneError
from barchan.experiments.compression import Compression
from barchan.experiments.compression.setup import build, stages
from barchan.measure import EnergyAccount, EnergyBudget

LAWS = list(bc.laws.SHIPPED.values())
VALUES = {"kn": 2e4, "kt": 6e3, "gamma_n": 20.0, "gamma_t": 0.0, "friction": 1e9, "youngs_modulus": 2e5, "poisson_ratio": 0.25}
VALUES |= {
    "restitution": 1.0,
    "work_of_adhesion": 30.0,
    "rolling_friction": 0.2,
    "twisting_friction": 0.1,
    "rolling_damping": 0.0,
}
MASS = 4.0 / 3.0 * pi * 0.5**3


def scene(law, dt, gravity=(0.0, 0.0, 0.0), **properties):
    """An empty box that knows its account."""
    material = bc.Material("m", density=1.0, **properties)
    sim = bc.Simulation(bc.Box((-9,) * 3, (9,) * 3), law, material, dt, gravity, threads=1)
    sim.writers.append(EnergyAccount())
    return sim


def account(sim):
    return sim.writers[0].compute(sim)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_energy_is_the_integral_of_the_force(law):
    """Of the normal force at rest over the overlap; of the tangential force over the slip, at one overlap and without limit."""
    properties = {name: VALUES[name] for name in law.properties}
    known = dict(zip(law.parameters, law.pair_parameters(properties, properties, "here")))
    still, radii = (0.0, 0.0, 0.0), {"radius_first": 0.5, "radius_second": 0.4, "radius_eff": 0.2 / 0.9, "mass_eff": 0.2}
    memory = {name: still if width == 3 else 0.0 for name, width in law.history.items()}
    values = radii | known | {"normal": (1.0, 0.0, 0.0), "normal_half": (1.0, 0.0, 0.0), "normal_velocity": 0.0, "dt": 1e-3}
    values |= dict.fromkeys(("tangential_velocity", "slip_velocity_half", "relative_omega"), still) | memory

    def call(**changed):
        return law(**{name: (values | changed)[name] for name in (*law.quantities, *law.parameters, *law.history)})

    def energy(overlap, **remembered):
        given = values | {"overlap": overlap} | remembered
        wanted = law.energy.__code__.co_varnames[: law.energy.__code__.co_argcount]
        return law.energy(**{name: given[name] for name in wanted})

    overlap, step = 0.02, 1e-6
    slope = (energy(overlap + step)[0] - energy(overlap - step)[0]) / (2.0 * step)
    assert slope == pytest.approx(call(overlap=overlap)[0], rel=1e-7)
    name, slid, work, rate = next(iter(law.history)), still, 0.0, (0.0, 0.3, -0.1)
    moving = {"tangential_velocity": still, "slip_velocity_half": rate, "overlap": overlap}
    for _ in range(20):
        before = call(overlap=overlap, dt=0.0, **{name: slid})[1]
        _, after, *rest = call(**moving, **{name: slid})
        slid = rest[int(law.couple)]
        work -= 1e-3 * sum(0.5 * (b + a) * v for b, a, v in zip(before, after, rate))
    if "slip_velocity_half" in law.quantities:
        assert energy(overlap, **{name: slid})[1] == pytest.approx(work, rel=1e-9) and work > 0.0


def test_free_fall():
    """Gravity's work is m g times the way; v(n) of the leap-frog is exact."""
    sim = scene(bc.laws.linear, 1e-3, (0.0, 0.0, -2.0), kn=1e3, kt=1e3, friction=0.0)
    sim.add_grains([(0, 0, 8)], 0.5)
    sim.run(1)
    before = sim.grains.position[0, 2]
    sim.run(500)
    found = account(sim)
    assert found.gravity == pytest.approx(2.0 * MASS * (before - sim.grains.position[0, 2]), rel=1e-12)
    assert abs(found.residual) < 1e-12 * found.gravity


def test_dashpot_of_a_head_on_impact():
    """m* v^2 / 2 (1 - e^2)."""
    sim = scene(bc.laws.hertz_mindlin, 2e-5, youngs_modulus=1e5, poisson_ratio=0.3, friction=0.5, restitution=0.6)
    sim.add_grains([(-0.501, 0, 0), (0.501, 0, 0)], 0.5, velocity=[(1.0, 0, 0), (-1.0, 0, 0)])
    sim.run(3000)
    found = account(sim)
    assert found.dashpots == pytest.approx(MASS * (1.0 - 0.6**2), rel=1e-3)
    assert found.friction == pytest.approx(0.0, abs=1e-9) and abs(found.residual) < 1e-3 * found.start


def test_friction_of_a_sphere_that_slides_until_it_rolls():
    """On a plane with v0 and no spin: 5/7 of v0 is left, m v0^2 / 7 goes to friction."""
    sim = scene(bc.laws.linear, 5e-5, (0.0, 0.0, -10.0), kn=1e5, kt=1e5, gamma_n=200.0, gamma_t=10.0, friction=0.3)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains([(-8, 0, 0.5 - 10.0 * MASS / 1e5)], 0.5, velocity=(2.0, 0, 0))
    sim.run(6000)
    found, rolls = account(sim), sim.grains.velocity[0, 0]
    assert rolls == pytest.approx(5.0 / 7.0 * 2.0, rel=1e-3)
    assert found.friction == pytest.approx(MASS * 2.0**2 / 7.0, rel=2e-3)


def test_springs_are_no_friction():
    """An oblique impact that sticks, without dashpot: friction 0, and the kinetic energy comes back to what it was."""
    sim = scene(bc.laws.linear, 1e-5, kn=1e4, kt=3e3, friction=1e9)
    sim.add_grains([(-0.4, -0.301, 0), (0.4, 0.301, 0)], 0.5, velocity=[(0.5, 0.2, 0), (-0.5, -0.2, 0)])
    sim.run(300)
    squeezed = account(sim)
    stored, springs = squeezed.elastic, squeezed.friction
    assert stored > 0.1 * squeezed.start and abs(springs) < 1e-4 * squeezed.start
    assert abs(squeezed.residual) < 1e-4 * squeezed.start


def test_viscous_damping_of_a_grain_that_flies():
    """m v0^2 / 2 (1 - exp(-2 c t))."""
    sim = scene(bc.laws.linear, 1e-4, kn=1e3, kt=1e3, friction=0.0)
    sim.damping = bc.Damping(viscous=2.0)
    sim.add_grains([(-8, 0, 0)], 0.5, velocity=(3.0, 0, 0), omega=(0.0, 4.0, 0.0))
    sim.run(1)
    start, time = account(sim).start, sim.time
    sim.run(4999)
    assert account(sim).damping == pytest.approx(start * (1.0 - exp(-4.0 * (sim.time - time))), rel=1e-3)


@pytest.mark.parametrize("squeeze", ["wall", "frozen grain", "cylinder that shrinks"])
def test_work_of_what_moves_as_told(squeeze):
    """A grain squeezed slowly: the work is what the contacts store."""
    sim = scene(bc.laws.linear, 1e-4, kn=1e4, kt=1e3, gamma_n=5.0, friction=0.5)
    sim.add_grains([(0, 0, 0.5)], 0.5)
    if squeeze == "cylinder that shrinks":
        sim.add_wall(bc.Cylinder((0.2, 0, 0), (0, 0, 1), 0.7, radial_velocity=-0.02))
    else:
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    if squeeze == "wall":
        sim.add_wall(bc.Plane((0, 0, 1.0), (0, 0, -1), velocity=(0, 0, -0.02)))
    if squeeze == "frozen grain":
        sim.add_grains([(0, 0, 1.5)], 0.5, velocity=(0, 0, -0.02), frozen=True)
    sim.run(9000 if squeeze == "cylinder that shrinks" else 5000)
    found = account(sim)
    if squeeze != "cylinder that shrinks":
        stiffness = 0.5 * 1e4  # two contacts in a row
        assert found.walls == pytest.approx(0.5 * stiffness * (0.02 * sim.time) ** 2, rel=0.01)
        assert found.elastic == pytest.approx(found.walls, rel=0.01)
    assert found.walls > 1e-5 and abs(found.residual) < 1e-3 * found.largest


def test_a_frozen_grain_that_rises_costs_gravity_nothing():
    """It moves as it is told, and touches nobody."""
    sim = scene(bc.laws.linear, 1e-3, (0.0, 0.0, -2.0), kn=1e3, kt=1e3, friction=0.0)
    sim.add_grains([(0, 0, 0), (3, 0, 0)], 0.5, velocity=[(0, 0, 1), (0, 0, 0)], frozen=[True, False])
    sim.run(500)
    found, fallen = account(sim), -sim.grains.sorted_by_id("position")[1, 2]
    assert sim.grains.sorted_by_id("position")[0, 2] == pytest.approx(0.5)
    assert found.gravity == pytest.approx(2.0 * MASS * fallen, rel=1e-2) and found.walls == 0.0
    assert abs(found.residual) < 1e-12 * found.gravity


def one_grain():
    sim = scene(bc.laws.linear, 1e-3, kn=1e3, kt=1e3, friction=0.0)
    sim.add_grains([(0, 0, 0)], 0.5)
    return sim


def test_an_account_refuses_what_it_cannot_know():
    sim = one_grain()
    with pytest.raises(SceneError, match=r"has seen no step; put it into sim.writers and run"):
        account(sim)
    sim.run(2)
    kept, sim.writers = sim.writers, []
    sim.run(1)
    with pytest.raises(SceneError, match="step 3: EnergyAccount 'energy' saw step 2 last; it must see every step"):
        kept[0].compute(sim)
    sim.writers = kept
    with pytest.raises(SceneError, match=r"saw step 2 last; it must see every step.*before checkpoints"):
        sim.run(1)
    sim = one_grain()
    sim.run(2)
    sim.add_grains([(3, 0, 0)], 0.5)
    with pytest.raises(SceneError, match="began with 1 grains, there are 2 now"):
        sim.run(1)
    with pytest.raises(SceneError, match="name = 3 must be a text"):
        EnergyAccount(3)


def test_the_budget_of_a_state_knows_springs():
    """Two grains pressed together and slid by u: k_n d^2 / 2 + k_t u^2 / 2."""
    sim = scene(bc.laws.linear, 1e-4, kn=1e4, kt=3e3, friction=1e9)
    sim.add_grains([(0, 0, 0), (0.9, 0, 0)], 0.5, frozen=[True, False])
    sim.grains.velocity[1] = (0.0, 0.5, 0.0)
    sim.run(20)
    slid = sqrt(float((sim.contacts.memory()[:, 0] ** 2).sum()))
    overlap = 1.0 - float(np.linalg.norm(sim.grains.position[1] - sim.grains.position[0]))
    expected = 0.5 * 1e4 * overlap**2 + 0.5 * 3e3 * slid**2
    assert EnergyBudget().compute(sim).elastic == pytest.approx(expected, rel=1e-12) and slid > 5e-4


@pytest.mark.validate
@pytest.mark.filterwarnings("ignore:.*overlap by more than")
def test_a_compression_at_its_default_step_keeps_account():
    """Six servo walls press a small sample, from loose on: at most 1e-3 of the largest term is left over."""
    values = {"grains": 250, "width": 9e-3, "height": 8e-3, "stress_rate": 10e6, "rain": 50e-3}
    scene = Compression.make(values)
    sim = build(scene, 1)
    for stage in stages(scene):
        stage.begin(sim)
        if stage.name == "seat":
            sim.writers.append(EnergyAccount())
        sim.run(stage.end - sim.step_number)
    found = account(sim)
    assert found.walls > 10.0 * found.start and found.elastic > found.friction > 0.0
    assert abs(found.residual) < 1e-3 * found.largest


def test_bonds_give_back_what_they_store_until_they_break():
    """A body that rings, then one that is shot to pieces: what bonds take is what the cracks released, but for the error of the
    time step."""
    taken = {}
    for strength, dt in ((1e12, 2e-4), (1e12, 1e-4), (150.0, 1e-4)):
        glue = bc.Bond(bc.laws.parallel_bond, kn=2e4, ks=1e4, tensile_strength=strength, shear_strength=strength)
        material = bc.Material("m", density=1.0, kn=1e-9, kt=1e-9, gamma_n=0.0, gamma_t=0.0, friction=0.0)
        sim = bc.Simulation(bc.Box((-9,) * 3, (9,) * 3), bc.laws.linear, material, dt, threads=1, bonds=glue)
        sim.max_overlap = np.inf
        sim.writers.append(EnergyAccount())
        place = np.stack(np.meshgrid(*3 * [np.arange(3.0)], indexing="ij"), axis=-1).reshape(-1, 3)
        random = np.random.default_rng(1)
        sim.add_grains(place, 0.5, velocity=random.normal(scale=1.5, size=place.shape), omega=random.normal(size=place.shape))
        assert sim.install_bonds(overlap=-0.01) == 54
        sim.run(round(0.2 / dt))
        told, cracks = account(sim), bc.bonds.cracks.table(sim)
        taken[strength, dt] = told.breaking
        assert told.bonded > 0.0 and abs(told.residual) < 1e-3 * told.start
        if strength == 150.0:
            assert len(cracks["step"]) > 10
            assert told.breaking == pytest.approx(cracks["energy"].sum(), rel=0.03)
            assert told.breaking > 0.02 * told.start
    assert abs(taken[1e12, 1e-4]) < 0.3 * abs(taken[1e12, 2e-4]) < 3e-4 * told.start
