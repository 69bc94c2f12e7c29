"""The drum, its grains at the start, and how it begins to turn. The axis is along y, its lowest line at height 0."""

from math import ceil

import numpy as np

from barchan import laws
from barchan.domain import Box
from barchan.errors import SceneError
from barchan.experiments import loose
from barchan.experiments.experiment import Stage
from barchan.materials import Material
from barchan.packing.lattice import lattice
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.walls import Cylinder, Plane

#: What random numbers are drawn for; each has a row of its own.
_RADII, _PLACES = range(2)


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: loose grains in a drum that stands.

    Args:
        scene: a ``Drum``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the drum is too small for its grains, or this machine for theirs.
    """
    check_memory(scene.grains, comm or world())
    radius, length, margin = scene.drum_radius, scene.length, 4.0 * scene.radius_max
    periodic = scene.ends == "periodic"
    beyond = 0.0 if periodic else margin
    low, high = (-radius - margin, -beyond, -margin), (radius + margin, length + beyond, 2.0 * radius + margin)
    names = ("youngs_modulus", "poisson_ratio", "restitution", "rolling_friction")
    alike = {name: getattr(scene, name) for name in names}
    materials = [
        Material("sand", scene.density, friction=scene.friction, **alike),
        Material("wall", friction=scene.wall_friction, **alike),
    ]
    gravity = (0.0, 0.0, -scene.gravity)
    box = Box(low, high, periodic=(False, periodic, False))
    sim = Simulation(box, laws.hertz_mindlin_constant_rolling, materials, scene.dt, gravity, threads, comm)
    sim.materials.set_pair("sand", "wall", friction=scene.wall_friction)
    sim.add_field("lifted_side", dtype=np.uint8)
    sim.add_wall(Cylinder((0.0, 0.0, radius), (0, 1, 0), radius, inside=True, material="wall"))
    for y, normal in () if periodic else ((0.0, 1), (length, -1)):
        sim.add_wall(Plane((0.0, y, radius), (0, normal, 0), "wall"))
    if with_grains:
        sim.add_grains(start(scene), loose.radii(scene, _RADII, scene.grains), "sand")
    return sim


def start(scene):
    """Centres of the grains at the start, the lowest places of a lattice in the drum, (grains, 3) [m].

    Raises:
        SceneError: they do not fit.
    """
    edge, radius, room = loose.cell_edge(scene.radius_max), scene.drum_radius, loose.room(scene.radius_max)
    across = ceil(2.0 * radius / edge)
    inset = 0.0 if scene.ends == "periodic" else room
    along = int((scene.length - 2.0 * inset) / edge)
    points = lattice("bcc", edge, (-radius, inset, 0.0), (across, along, across))
    points = points[np.hypot(points[:, 0], points[:, 2] - radius) < radius - room]
    if len(points) < scene.grains:
        raise SceneError(
            f"grains = {scene.grains} do not fit into a drum of radius {radius:g} m and length {scene.length:g} m: "
            f"{len(points)} do. Make it larger, or the grains fewer"
        )
    points = points[np.argsort(points[:, 2], kind="stable")][: scene.grains]
    return points + loose.shifts(scene, _PLACES, len(points))


def stages(scene):
    """Come to rest; turn."""
    return [Stage("fill", scene.turn_step, lambda sim: None), Stage("turn", scene.last_step, lambda sim: _turn(sim, scene))]


def _turn(sim, scene):
    """Turn drum and plates, so that grains are lifted where x < 0; grains remember on which side they are."""
    for wall in sim.walls:
        wall.omega = (0.0, scene.rotation, 0.0)
    sim.grains.view("lifted_side")[...] = sim.grains.view("position")[:, 0] < 0.0
