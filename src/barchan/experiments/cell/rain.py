"""A sample that rains into a cell, and is flattened."""

import numpy as np

from barchan import laws
from barchan.chance import uniform
from barchan.domain import Box
from barchan.experiments.cell.scene import Lattice
from barchan.experiments.cell.walls import Cell
from barchan.materials import Material
from barchan.packing.lattice import lattice_within
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation


def raining(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: grains on a lattice above the floor of a cell, with small velocities. No wall is controlled.

    Args:
        scene: a ``CellScene``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the lattice would overlap.
    """
    lattice = Lattice.of(scene)
    check_memory(lattice.grains, comm or world())
    elastic = {"shear_modulus": scene.shear_modulus, "poisson_ratio": scene.poisson_ratio, "restitution": scene.restitution}
    grain = Material("grain", density=scene.density, friction=scene.friction, **elastic)
    wall = Material("wall", friction=scene.wall_friction, **elastic)
    top = max(lattice.top, scene.height)
    size, margin = np.array([scene.width, scene.width, top]), 4.0 * scene.radius_max
    box = Box(-margin * np.ones(3), size + margin)
    sim = Simulation(box, laws.hertz_mindlin, [grain, wall], scene.dt, (0.0, 0.0, -scene.gravity), threads, comm)
    sim.materials.set_pair("grain", "wall", friction=scene.wall_friction)
    Cell.add(sim, size, "wall")
    if with_grains:
        _add_grains(sim, scene, lattice)
    return sim


def _add_grains(sim, scene, lattice):
    cells = (lattice.across, lattice.across, lattice.up)
    low = np.array(lattice.low)
    sim.share_space([(low, low + lattice.edge * np.array(cells))])
    numbers, points = lattice_within("bcc", lattice.edge, low, cells, sim.space)
    radii = scene.radius_min + (scene.radius_max - scene.radius_min) * uniform(scene.seed, numbers)
    across = np.stack([uniform(scene.seed + 1 + axis, numbers) - 0.5 for axis in range(3)], axis=1)
    fall = np.sqrt(2.0 * scene.gravity * scene.radius_min)  # from the height of a grain
    sim.add_part(numbers, lattice.grains, points, radii, "grain", velocity=fall * across)


def flatten(sim, scene):
    """Remove what is above the height, put the top wall there, and switch gravity off, so that the stress is even."""
    grains = sim.grains
    sim.remove(grains.view("id")[grains.view("position")[:, 2] + grains.view("radius") > scene.height])
    Cell.of(sim).top.point = (0.0, 0.0, scene.height)
    sim.gravity = (0.0, 0.0, 0.0)
