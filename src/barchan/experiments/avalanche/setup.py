"""The avalanche at its start, and its release."""

from math import cos, radians, sin

import numpy as np

from barchan import laws
from barchan.actions import Outlet
from barchan.chance import uniform
from barchan.domain import Box
from barchan.experiments.avalanche.parameters import Outline
from barchan.experiments.experiment import Stage
from barchan.materials import Material
from barchan.measure import EnergyBudget
from barchan.packing.lattice import lattice_within, per_cell
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.triggers import Every

#: What a grain is, in its field ``part``.
FLOWING, FIXED, RIGHT_WALL = 0, 1, 2

#: Steps between looks for grains that leave through an outlet.
OUTLET_STEPS = 50


def box_of(scene):
    """The box: open room above the grains for the spray, and behind the end wall for what flies over it."""
    outline = Outline.of(scene)
    margin = 4.0 * outline.edge
    right = (outline.floor + 1) * outline.edge + margin
    top = 2.0 * max(scene.end_wall, scene.height) + scene.floor * sin(radians(scene.angle)) + margin
    return Box((-margin, 0.0, -margin), (right, outline.across * outline.edge, top), periodic=(False, True, False))


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start, in the horizontal position.

    Args:
        scene: an ``Avalanche``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the lattice would overlap, or the box is too narrow.
    """
    outline = Outline.of(scene)
    check_memory(outline.flowing + outline.immobile, comm or world())
    box, grain = box_of(scene), scene.simulated
    sand = Material(
        "sand",
        density=scene.density,
        kn=grain.kn,
        kt=grain.kt,
        gamma_n=grain.gamma_n,
        gamma_t=grain.gamma_t,
        friction=scene.friction,
    )
    sim = Simulation(box, laws.silbert, sand, grain.dt, gravity=(0.0, 0.0, -scene.gravity), threads=threads, comm=comm)
    sim.add_field("part", dtype=np.uint8)
    sim.actions = [
        Outlet("over the end wall", (box.high[0] - grain.radius_max, 0, 0), (1, 0, 0), Every(OUTLET_STEPS)),
        Outlet("below", (0, 0, box.low[2] + grain.radius_max), (0, 0, -1), Every(OUTLET_STEPS)),
        Outlet("above", (0, 0, box.high[2] - grain.radius_max), (0, 0, 1), Every(OUTLET_STEPS)),
    ]
    if with_grains:
        sim.share_space([outline.edge * np.array([low, np.add(low, cells)]) for _, low, cells in _blocks(outline)])
        for part, low, cells in _blocks(outline):
            corner, total = np.array(low) * outline.edge, int(np.prod(cells)) * per_cell(scene.lattice)
            numbers, points = lattice_within(scene.lattice, outline.edge, corner, cells, sim.space)
            radii = _radii(scene, sim.next_id + numbers)
            sim.add_part(numbers, total, points, radii, "sand", frozen=part != FLOWING, part=part)
    return sim


def _blocks(outline):
    """(part, corner, size) of the block of grains and of the walls around it, two layers of grains each, in cells."""
    across, wall = outline.across, outline.side_walls
    yield FLOWING, (0, 0, 0), (outline.length, across, outline.height)
    yield FIXED, (-1, 0, -1), (outline.floor + 2, across, 1)
    yield FIXED, (-1, 0, 0), (1, across, wall)
    yield RIGHT_WALL, (outline.length, 0, 0), (1, across, wall)
    if outline.end_wall:
        yield FIXED, (outline.floor, 0, 0), (1, across, outline.end_wall)


def _radii(scene, numbers):
    """Uniform radii from a counter-based generator keyed by the grain's number: the same for any order or rank."""
    grain = scene.simulated
    return grain.radius_min + (grain.radius_max - grain.radius_min) * uniform(scene.seed, numbers)


def stages(scene):
    """Equilibrate in the horizontal position, then flow."""
    return [
        Stage("equilibrate", scene.release_step, _start_budget),
        Stage("flow", scene.last_step, lambda sim: release(sim, scene)),
    ]


def release(sim, scene):
    """Tilt the box and remove its right wall."""
    tilt = radians(scene.angle)
    sim.gravity = (scene.gravity * sin(tilt), 0.0, -scene.gravity * cos(tilt))
    sim.remove(sim.grains.view("id")[sim.grains.view("part") == RIGHT_WALL])
    _start_budget(sim)


def _start_budget(sim):
    """Note the energy from which dissipation is counted: a change of gravity changes the potential."""
    sim.prepare()
    sim.notes["energy_at_start"] = EnergyBudget().compute(sim).total
