"""The grains at their start, what stands around them, and the lift."""

from math import ceil

import numpy as np

from barchan import laws
from barchan.actions import Outlet
from barchan.domain import Box
from barchan.experiments import loose
from barchan.experiments.experiment import Stage
from barchan.experiments.repose.parameters import Outline
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.triggers import Every
from barchan.walls import Cone, Plane

#: Steps between looks for grains that leave over the edge of the floor.
OUTLET_STEPS = 50

#: Numbers of the walls: of the floor, and of what is lifted.
FLOOR, LIFTED = 0, 1

#: How far the lower edge of the plate, an arc of a large circle, may be from a straight line, in smallest radii.
SAGITTA = 0.05

#: What random numbers are drawn for; each has a row of its own.
_RADII, _PLACES, _FLOOR_RADII, _FLOOR_PLACES = range(4)


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: grains on a lattice in the cylinder, or between the plate and the other walls.

    Args:
        scene: a ``Repose``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
    """
    glued = (2.0 * scene.floor / scene.diameter) ** 2 if scene.rough_floor and scene.method == "cylinder" else 0.0
    check_memory(scene.grains + int(glued), comm or world())
    place, glued = start(scene), floor_grains(scene)
    top, margin = float(place[:, 2].max()) + scene.radius_max, 4.0 * scene.radius_max
    edge, side = scene.floor + margin, (scene.floor if scene.method == "cylinder" else 0.5 * scene.width) + margin
    box = Box((-edge if scene.method == "cylinder" else -margin, -side, -margin), (edge, side, 2.0 * top + margin))
    materials = loose.materials(scene, wall=scene.wall_friction, floor=scene.floor_friction, smooth=0.0)
    sim = Simulation(box, laws.hertz_mindlin, materials, scene.dt, (0.0, 0.0, -scene.gravity), threads, comm)
    for name, friction in (("wall", scene.wall_friction), ("floor", scene.floor_friction)):
        sim.materials.set_pair("sand", name, friction=friction)
    sim.add_field("start_height", dimension="length")
    for wall in _walls(scene, top):
        sim.add_wall(wall)
    sides = ((1, 0), (-1, 0), (0, 1), (0, -1)) if scene.method == "cylinder" else ((1, 0),)
    for x, y in sides:
        point = (x * scene.floor, y * scene.floor, 0.0)
        sim.actions.append(Outlet(f"over the edge at {x:+d} {y:+d}", point, (x, y, 0), Every(OUTLET_STEPS)))
    if with_grains:
        radii = (loose.radii(scene, stream, len(some)) for stream, some in ((_RADII, place), (_FLOOR_RADII, glued)))
        sim.add_grains(place, next(radii), "sand", start_height=place[:, 2])
        sim.add_grains(glued, next(radii), "sand", frozen=True)
    return sim


def start(scene):
    """Centres of the grains at the start, (grains, 3) [m]: loose, in the cylinder or between the plate and the other walls."""
    outline, bottom = Outline.of(scene), 2.0 * loose.room(scene.radius_max)  # above the grains that are glued to the floor
    if scene.method == "cylinder":
        points = loose.places_in_tube(scene.grains, scene.cylinder_radius, bottom, scene.radius_max)
    else:
        inner = np.add(outline.low, loose.room(scene.radius_max)), np.subtract(outline.high, loose.room(scene.radius_max))
        points = loose.places(
            scene.grains,
            outline.low,
            outline.high,
            bottom,
            scene.radius_max,
            lambda p: ((p[:, :2] > inner[0]) & (p[:, :2] < inner[1])).all(axis=1),
        )
    return points + loose.shifts(scene, _PLACES, len(points))


def floor_grains(scene):
    """Centres of the grains glued to the floor, (k, 3) [m], in its plane; none if it is smooth."""
    if not scene.rough_floor:
        return np.zeros((0, 3))
    if scene.method == "cylinder":
        points = loose.disc_floor(scene.floor, scene.diameter)
    else:
        x = scene.diameter * (np.arange(ceil(scene.floor / scene.diameter)) + 0.5)
        y = scene.diameter * (np.arange(ceil(scene.width / scene.diameter)) + 0.5) - 0.5 * scene.width
        points = np.stack(np.meshgrid(x, y, 0.0, indexing="ij"), axis=-1).reshape(-1, 3)
    return loose.glued(scene, _FLOOR_PLACES, points)


def stages(scene):
    """Come to rest; lift; come to rest as a pile."""
    return [
        Stage("fill", scene.lift_step, lambda sim: None),
        Stage("lift", scene.lifted_step, lambda sim: _move(sim, scene.lift_speed)),
        Stage("settle", scene.last_step, lambda sim: _move(sim, 0.0)),
    ]


def _move(sim, speed):
    sim.walls[LIFTED].velocity = (0.0, 0.0, speed)


def _walls(scene, top):
    """The floor; what is lifted; and what else holds a block of grains."""
    yield Plane((0.0, 0.0, 0.0), (0, 0, 1), "floor")
    if scene.method == "cylinder":
        radius = scene.cylinder_radius
        yield Cone((0.0, 0.0, 0.0), (0, 0, 1), radius, radius, top, "wall")
        return
    radius = max(top, scene.width**2 / (8.0 * SAGITTA * scene.radius_min))  # walls are endless or round: a very large disc
    yield Cone((scene.length, 0.0, radius), (1, 0, 0), 0.0, radius, 0.0, "wall")
    yield Plane((0.0, 0.0, 0.0), (1, 0, 0), "wall")
    for side in (-1, 1):
        yield Plane((0.0, 0.5 * side * scene.width, 0.0), (0, -side, 0), "smooth")
