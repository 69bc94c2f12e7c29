"""The servo follows a ramp of stress on six sides without tuning: few grains or many, soft or stiff, loose or dense."""

import numpy as np
import pytest

import barchan as bc
from barchan.experiments.cell import Cell
from barchan.preflight import stable_time_step
from barchan.walls import Servo

RADIUS, DENSITY = 1e-3, 2500.0

#: Stress at the end over Young's modulus: contacts then overlap by about half a percent.
STRAIN = 1e-3

#: The largest speed of a wall as an inertial number of the stress at the start.
CLOSING = 1e-2


def sample(across, modulus, gap, friction):
    """Grains on a loose cubic lattice in a cell, all moving a little; returns the simulation and its cell."""
    material = bc.Material(
        "grain", density=DENSITY, youngs_modulus=modulus, poisson_ratio=0.2, friction=friction, restitution=0.5
    )
    random, edge = np.random.default_rng(1), 2.0 * RADIUS * gap
    size = across * edge
    sim = bc.Simulation(bc.Box((-size,) * 3, (2.0 * size,) * 3), bc.laws.hertz_mindlin, material, dt=1e-12)
    cell = Cell.add(sim, (size,) * 3, "grain")
    cells = np.stack(np.meshgrid(*3 * [np.arange(across)], indexing="ij"), axis=-1).reshape(-1, 3)
    jitter = random.uniform(-0.5, 0.5, cells.shape) * (gap - 1.0) * 2.0 * RADIUS
    speed = CLOSING * across * np.sqrt(0.05 * STRAIN * modulus / DENSITY)
    sim.add_grains((cells + 0.5) * edge + jitter, random.uniform(0.8, 1.0, len(cells)) * RADIUS)
    sim.grains.velocity = random.normal(scale=0.1 * speed, size=cells.shape)
    sim.dt = 0.5 * stable_time_step(sim.law, sim.materials.table(sim.law), sim.grains, 1)
    return sim, cell, speed


def worst_error(across, modulus, gap, friction, steps):
    """Largest root mean square, of six walls, of stress over target less 1: along a ramp to twenty times the stress at the start,
    after its first 5 %."""
    sim, cell, speed = sample(across, modulus, gap, friction)
    end, ramp = STRAIN * modulus, [np.inf]

    def target(sim):
        return end * (0.05 + 0.95 * max(0.0, sim.step_number - ramp[0]) / steps)

    for axis, pair in enumerate(cell.pairs()):
        for wall in pair:
            wall.control = Servo(max_speed=speed, stress=target, area=cell.area(axis))
    while abs(cell.stresses(sim) / target(sim) - 1.0).max() > 0.01 if sim.step_number else True:  # seated, and no grain flies
        sim.run(2000)
        assert sim.step_number < 4 * steps, "it is never seated"
    sim.run(2000)
    ramp[0], errors = sim.step_number, []
    for _ in range(200):
        sim.run(steps // 200)
        errors.append(cell.stresses(sim) / target(sim) - 1.0)
    return float(np.sqrt((np.array(errors[10:]) ** 2).mean(axis=0)).max())


def test_the_servo_follows_a_ramp():
    assert worst_error(6, 1e8, 1.05, 0.3, 30_000) < 0.01


@pytest.mark.validate
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("gap", [1.02, 1.3], ids=["dense", "loose"])
@pytest.mark.parametrize("modulus", [1e6, 1e11], ids=["soft", "stiff"])
def test_the_servo_follows_a_ramp_whatever_the_sample(modulus, gap, friction):
    assert worst_error(10, modulus, gap, friction, 40_000) < 0.01


@pytest.mark.validate
@pytest.mark.parametrize("across", [30, 58])
def test_the_servo_follows_a_ramp_in_large_samples(across):
    """27,000 and 195,000 grains, in as many more steps as waves need to cross them."""
    assert worst_error(across, 1e8, 1.05, 0.3, 2000 * across) < 0.01
