"""A large sample under six servo walls: ``python tests/reference/laboratory.py TILE COPIES STEPS [THREADS]``.

A periodic tile of TILE grains is compacted, COPIES^3 of them stand side by side in a cell, whose six servo walls follow a ramp of
stress for so many steps once they are seated. Prints what that took as JSON, and what 20 million steps would. The sample of
Marketos et al. (2013) has 1,428,532 grains; 4 copies of 22,321 each way are 12 more, which are left out.
"""

import json
import resource
import sys
import time

import numpy as np

import barchan as bc
from barchan.experiments.cell import Cell
from barchan.kernels.compiler import default_threads
from barchan.packing import Preparation, compact
from barchan.preflight import stable_time_step
from barchan.walls import Servo

RADIUS, DENSITY, MODULUS, SOLID_FRACTION = 1e-3, 2500.0, 1e8, 0.63
START, END, LONG = 5e3, 1e5, 226_000  # the ramp of stress [Pa], and in how many steps it would end

PAPER = 1_428_532  # grains

GRAIN = {"youngs_modulus": MODULUS, "poisson_ratio": 0.2, "friction": 0.3, "restitution": 0.5}


def simulation(box, threads):
    material = bc.Material("grain", density=DENSITY, **GRAIN)
    return bc.Simulation(box, bc.laws.hertz_mindlin, material, dt=1e-12, threads=threads)


def choose_step(sim):
    sim.dt = 0.5 * stable_time_step(sim.law, sim.materials.table(sim.law), sim.grains, 1)


def tile(count, threads):
    """Positions and radii of a dense periodic cube of grains, and its edge."""
    random, across = np.random.default_rng(1), int(np.ceil(count ** (1.0 / 3.0)))
    edge = 2.05 * RADIUS * across
    sim = simulation(bc.Box((0,) * 3, (edge,) * 3, (True,) * 3), threads)
    cells = np.stack(np.meshgrid(*3 * [np.arange(across)], indexing="ij"), axis=-1).reshape(-1, 3)
    cells = cells[np.sort(random.permutation(len(cells))[:count])]
    places = (cells + 0.5) * edge / across + random.uniform(-0.02, 0.02, cells.shape) * RADIUS
    sim.add_grains(places, random.uniform(0.8, 1.0, count) * RADIUS)
    sim.grains.velocity = random.normal(scale=0.2, size=(count, 3))
    choose_step(sim)
    sim.dt *= 0.7  # grains grow
    compact(sim, SOLID_FRACTION, "growth", Preparation(friction=0.1, rest=0.05), steps=6000)
    return sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("radius"), edge


def cell(position, radius, edge, copies, threads):
    """Copies of the tile, and six walls that touch the outermost grains."""
    size, wide = copies * edge, radius.max()
    sim = simulation(bc.Box((-0.5 * size,) * 3, (1.5 * size,) * 3), threads)
    walls = Cell.add(sim, (size,) * 3, "grain")
    for pair in walls.pairs():
        for wall in pair:
            wall.point = wall.point - wide * wall.normal
    shifts = edge * np.stack(np.meshgrid(*3 * [np.arange(copies)], indexing="ij"), axis=-1).reshape(-1, 3)
    places, radii = (position + shifts[:, None]).reshape(-1, 3), np.tile(radius, copies**3)
    sim.add_grains(places[:PAPER], radii[:PAPER])
    choose_step(sim)
    return sim, walls


def control(sim, walls, ramp):
    """Servo walls whose target rises from step ``ramp[0]`` on."""
    count = sim.grains.n ** (1.0 / 3.0)
    speed = 1e-3 * count * np.sqrt(START / DENSITY)

    def target(sim):
        return START + (END - START) * max(0.0, sim.step_number - ramp[0]) / LONG

    for axis, pair in enumerate(walls.pairs()):
        for wall in pair:
            wall.control = Servo(max_speed=speed, stress=target, area=walls.area(axis))
    return target


def main(count, copies, steps, threads):
    seconds, since = {}, time.perf_counter()

    def lap(name):
        nonlocal since
        now = time.perf_counter()
        seconds[name], since = now - since, now

    parts = tile(count, threads)
    lap("tile")
    sim, walls = cell(*parts, copies, threads)
    ramp = [np.inf]
    target = control(sim, walls, ramp)
    sim.prepare()
    lap("set-up")
    sim.damping = bc.Damping(local=0.5)  # a sample this wide would swing for long
    held = 0
    while held < 5:
        sim.run(200)
        held = held + 1 if abs(walls.stresses(sim) / target(sim) - 1.0).max() < 0.05 else 0
        print(sim.step_number, (walls.stresses(sim) / target(sim)).round(3).tolist(), file=sys.stderr, flush=True)
    sim.damping = bc.Damping()
    lap("seating")
    seated, ramp[0], errors, laps = sim.step_number, sim.step_number, [], []
    for _ in range(40):
        begin = time.perf_counter()
        sim.run(steps // 40)
        laps.append((time.perf_counter() - begin) / (steps // 40))
        errors.append(walls.stresses(sim) / target(sim) - 1.0)
        print(sim.step_number, laps[-1], errors[-1].round(3).tolist(), sim.staleness.rebuilds, file=sys.stderr, flush=True)
    lap("ramp")
    step = float(np.median(laps))
    told = {
        "grains": sim.grains.n,
        "threads": threads,
        "coordination": 2.0 * sim.touching / sim.grains.n,
        "steps": {"seating": seated, "ramp": sim.step_number - seated},
        "rebuilds": sim.staleness.rebuilds,
        "seconds": seconds,
        "seconds_a_step": step,
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "stress_from_to": [START, float(target(sim))],
        "worst_wall_rms": float(np.sqrt((np.array(errors[2:]) ** 2).mean(axis=0)).max()),
        "days_for_20_million_steps": 20e6 * step / 86400.0,
    }
    print(json.dumps(told, indent=1))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]), int(sys.argv[4]) if len(sys.argv) > 4 else default_threads(1))
