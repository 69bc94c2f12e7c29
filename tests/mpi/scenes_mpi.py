"""Small scenes of every kind of flow, for several ranks and for one: dense, gas, chute, laboratory, avalanche."""

import warnings

import numpy as np
import states
from meshed import meshed

import barchan as bc
from barchan.checkpoint import collect
from barchan.experiments.avalanche import Avalanche, build, stages
from barchan.walls import Massive, Path, Proportional, Servo, Vibration


def dense(**options):
    """Coordination above 6, two materials, frozen grains, two walls, one of which moves."""
    return states.dense(bc.laws.hertz_standard, **options)


def steady(**options):
    """The same in gravity that does not turn: many steps in one call."""
    sim = dense(**options)
    sim.gravity = states.GRAVITY["steady"]
    return sim


def rolling(**options):
    """Contacts with couples and damped grains, many steps in one call."""
    sim = states.dense(bc.laws.hertz_mindlin_rolling, **options)
    sim.gravity, sim.damping = states.GRAVITY["steady"], bc.Damping(local=0.1, viscous=1.0)
    return sim


def sticky(**options):
    """Contacts that last beyond touching, many steps in one call."""
    sim = states.dense(bc.laws.jkr, **options)
    sim.gravity = states.GRAVITY["steady"]
    return sim


def gas(**options):
    """400 fast grains in a box that is periodic on all sides: they cross borders all the time, and touch rarely."""
    box = bc.Box((0, 0, 0), (16, 12, 10), (True, True, True))
    soft = bc.Material("m", density=1.0, kn=2e5, kt=6e4, gamma_n=5.0, gamma_t=5.0, friction=0.5)
    sim = bc.Simulation(box, bc.laws.hertz_standard, soft, dt=2e-4, **options)
    cells = np.stack(np.meshgrid(*map(np.arange, (10, 8, 5)), indexing="ij"), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(2)
    velocity = random.normal(0.0, 8.0, cells.shape)
    sim.add_grains(cells * (1.6, 1.5, 2.0) + 0.7, random.uniform(0.4, 0.6, len(cells)), velocity=velocity)
    return sim


def chute(**options):
    """Grains that slide and roll over a frozen base, few contacts each."""
    box = bc.Box((0, 0, -1), (20, 10, 30), (True, True, False))
    hard = bc.Material("m", density=1.0, kn=2e5, kt=2.0 / 7.0 * 2e5, gamma_n=50.0, friction=0.5)
    sim = bc.Simulation(box, bc.laws.linear_standard, hard, dt=1e-4, gravity=(0.45, 0.0, -0.9), **options)
    cells = np.stack(np.meshgrid(*map(np.arange, (18, 9, 5)), indexing="ij"), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(4)
    position = cells * (1.1, 1.1, 1.01) + (0.6, 0.6, 0.0) + random.uniform(-0.02, 0.02, cells.shape)
    velocity = np.outer(cells[:, 2], (2.0, 0.2, 0.0))
    sim.add_grains(position, 0.5, velocity=velocity, frozen=cells[:, 2] == 0)
    return sim


def laboratory(**options):
    """All kinds of walls and controls at once, a law with couples, two materials, damping, grains that come and go."""
    law = bc.laws.hertz_mindlin_rolling
    sim = bc.Simulation(bc.Box((-2, -2, -2), (14, 14, 20)), law, states.materials(law), 3e-4, (0.5, 0.2, -3.0), **options)
    sim.max_overlap, sim.damping = 1.0, bc.Damping(local=0.1, viscous=0.2)
    random = np.random.default_rng(5)
    cells = np.stack(np.meshgrid(*map(np.arange, (9, 9, 6)), indexing="ij"), axis=-1).reshape(-1, 3)
    cells = cells[((cells[:, :2] - 4) ** 2).sum(axis=1) < 15.5] + 1.0
    material = random.integers(0, 2, len(cells))
    velocity = random.normal(0.0, 3.0, cells.shape)
    sim.add_grains(cells + random.uniform(-0.05, 0.05, cells.shape), random.uniform(0.4, 0.5, len(cells)), material, velocity)
    side = sim.add_wall(bc.Cylinder((5, 5, 0), (0, 0, 1), 4.5, omega=(0, 0, 2.0), material="m1"))
    floor = sim.add_wall(bc.Plane((5, 5, 0.5), (0, 0, 1), omega=(0.1, 0, 0)))
    top = sim.add_wall(bc.Plane((0, 0, 6.5), (0, 0, -1), velocity=(0.5, 0, 0)))
    ball = sim.add_wall(bc.Sphere((5.1, 4.9, 3.5), 0.4, inside=False))
    cone = sim.add_wall(bc.Cone((5, 5, 1.4), (0, 0, 1), 1.0, 3.0, 1.5, omega=(0, 0, 1), material="m1"))
    side.control = Servo(max_speed=2.0, stress=lambda sim: 50.0 + 1000.0 * sim.time, area=lambda sim: 6.0 * side.radius)
    top.control = Massive(mass=20.0, damping=5.0, force=100.0)
    floor.control = Vibration((0.05, 0, 0.02), 25.0)
    ball.control = Proportional(1e-3, force=50.0, max_speed=3.0, start=20)
    cone.control = Path(lambda time: (0, 0, 0.2 * time))
    feed = bc.Feed(radius=0.3, rate=200.0, total=6, material="m1", velocity=(0, 0, -1))
    sim.actions = [
        bc.Inlet("from above", ((1, 1, 10), (9, 9, 12)), feed, bc.Every(30)),
        bc.Outlet("to the side", (9.2, 0, 0), (1, 0, 0), bc.Every(10)),
    ]
    return sim


def avalanche(threads=1, comm=None):
    """The experiment, coarse and short: its right wall is removed after 150 steps."""
    scene = Avalanche.make({"coarse_graining": 12.0, "equilibrate": 0.004, "duration": 0.006})
    sim = build(scene, threads, comm)
    for stage in stages(scene):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            stage.begin(sim)
            sim.run(stage.end - sim.step_number)
    return sim


OF_ALL_KINDS = dense, steady, rolling, sticky, gas, chute, laboratory, states.bonded, states.flow, states.sheared, meshed
SCENES = {made.__name__: made for made in OF_ALL_KINDS}


def state_after(name, steps, change=None, **options):
    """The state of a scene after some steps, on all ranks."""
    if name == "avalanche":
        return collect(avalanche(**options))
    sim = SCENES[name](**options)
    if change:
        change(sim)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(steps)
    return collect(sim)
