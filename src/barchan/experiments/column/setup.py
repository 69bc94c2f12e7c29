"""Columns side by side, their grains at the start, and how they are released."""

import numpy as np

from barchan import laws
from barchan.actions import Outlet
from barchan.domain import Box
from barchan.experiments import loose
from barchan.experiments.experiment import Stage
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.triggers import Every
from barchan.walls import Cone, Plane

#: Steps between looks for grains that leave over the edge of the floor.
LOOK_STEPS = 50

#: Number of the floor among the walls; the cylinders follow.
FLOOR = 0

#: What random numbers are drawn for; each has a row of its own.
_RADII, _PLACES, _FLOOR_RADII, _FLOOR_PLACES = range(4)


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: loose grains in cylinders, on a floor to which others are glued.

    Args:
        scene: a ``Column``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
    """
    check_memory(sum(scene.grains) + int((4.0 * (scene.floors / scene.diameter) ** 2).sum()), comm or world())
    place, glued = start(scene), floor_grains(scene)
    top, margin = float(place[:, 2].max()) + scene.radius_max, 4.0 * scene.radius_max
    side, right = float(scene.floors.max()), 2.0 * float(scene.floors.sum())
    box = Box((-margin, -side - margin, -margin), (right + margin, side + margin, top + margin))
    materials = loose.materials(scene, wall=scene.wall_friction, floor=scene.friction)
    sim = Simulation(box, laws.hertz_mindlin, materials, scene.dt, (0.0, 0.0, -scene.gravity), threads, comm)
    sim.materials.set_pair("sand", "wall", friction=scene.wall_friction)
    sim.add_field("column", dtype=np.uint8)
    sim.add_field("start_height", dimension="length")
    sim.add_wall(Plane((0.0, 0.0, 0.0), (0, 0, 1), "floor"))
    for x in scene.axes:
        sim.add_wall(Cone((float(x), 0.0, 0.0), (0, 0, 1), scene.column_radius, scene.column_radius, top, "wall"))
    for name, point, normal in (
        ("left", 0.0, (-1, 0)),
        ("right", right, (1, 0)),
        ("front", -side, (0, -1)),
        ("back", side, (0, 1)),
    ):
        place_of = (point * abs(normal[0]), point * abs(normal[1]), 0.0)
        sim.actions.append(Outlet(f"over the {name} edge", place_of, (*normal, 0), Every(LOOK_STEPS)))
    if with_grains:
        column = np.repeat(np.arange(scene.columns), scene.grains)
        sim.add_grains(place, loose.radii(scene, _RADII, len(place)), "sand", column=column)
        sim.add_grains(glued, loose.radii(scene, _FLOOR_RADII, len(glued)), "sand", frozen=True)
    return sim


def start(scene):
    """Centres of the grains at the start, column by column, (k, 3) [m]."""
    bottom = 2.0 * loose.room(scene.radius_max)  # above the grains that are glued to the floor
    points = [
        loose.places_in_tube(count, scene.column_radius, bottom, scene.radius_max) + np.array((x, 0.0, 0.0))
        for count, x in zip(scene.grains, scene.axes)
    ]
    points = np.concatenate(points)
    return points + loose.shifts(scene, _PLACES, len(points))


def floor_grains(scene):
    """Centres of the grains glued to the floor under each column, (k, 3) [m], in its plane."""
    floors = [loose.disc_floor(radius, scene.diameter) + np.array((x, 0, 0)) for radius, x in zip(scene.floors, scene.axes)]
    return loose.glued(scene, _FLOOR_PLACES, np.concatenate(floors))


def stages(scene):
    """Come to rest; collapse."""
    return [Stage("fill", scene.release_step, lambda sim: None), Stage("collapse", scene.last_step, lambda sim: _release(sim))]


def _release(sim):
    """Take the cylinders away at once, out of the box; grains remember at what height they are."""
    below = float(sim.box.low[2] - sim.box.length[2])
    for wall in sim.walls[FLOOR + 1 :]:
        wall.point = (*wall.point[:2], 2.0 * below)
    sim.grains.view("start_height")[...] = sim.grains.view("position")[:, 2]
