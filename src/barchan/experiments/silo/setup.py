"""Silos side by side, their grains at the start, and how their outlets are opened."""

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
from barchan.walls import Cone

#: Steps between looks for grains that leave.
LOOK_STEPS = 50

#: Walls of a silo, in the order in which they are added.
WALL, FLOOR, LID = range(3)

#: How far below its floor a grain has left a silo, and how far below it is taken out, in largest diameters.
LEFT, GONE = 1.0, 6.0

#: What random numbers are drawn for; each has a row of its own.
_RADII, _PLACES = range(2)


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: loose grains in silos with closed outlets.

    Args:
        scene: a ``Silo``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
    """
    check_memory(scene.grains * scene.outlets, comm or world())
    place = start(scene)
    top, margin = float(place[:, 2].max()) + scene.radius_max, 4.0 * scene.radius_max
    side, below = 0.5 * scene.silo_diameter + margin, 2.0 * (GONE + 2.0) * scene.radius_max
    box = Box((-side, -side, -below), (scene.axes[-1] + side, side, top + margin))
    materials = loose.materials(scene, wall=scene.wall_friction, floor=scene.floor_friction)
    sim = Simulation(box, laws.hertz_mindlin, materials, scene.dt, (0.0, 0.0, -scene.gravity), threads, comm)
    for name, friction in (("wall", scene.wall_friction), ("floor", scene.floor_friction)):
        sim.materials.set_pair("sand", name, friction=friction)
    sim.add_field("silo", dtype=np.uint8)
    sim.add_field("left_step", dtype=np.int64)
    for name in ("start_height", "start_distance"):
        sim.add_field(name, dimension="length")
    for x, outlet in zip(scene.axes, scene.outlet_diameters):
        for wall in _walls(scene, float(x), 0.5 * float(outlet), top):
            sim.add_wall(wall)
    looks = Every(LOOK_STEPS)
    sim.actions += [Leaving(-2.0 * LEFT * scene.radius_max, looks)]
    sim.actions += [Outlet("below the silos", (0.0, 0.0, -2.0 * GONE * scene.radius_max), (0, 0, -1), looks)]
    if with_grains:
        radii = loose.radii(scene, _RADII, len(place))
        silo = np.repeat(np.arange(scene.outlets), scene.grains)
        sim.add_grains(place, radii, "sand", silo=silo)
    return sim


def start(scene):
    """Centres of the grains at the start, silo by silo, (outlets * grains, 3) [m]."""
    bottom = loose.room(scene.radius_max)
    points = loose.places_in_tube(scene.grains, 0.5 * scene.silo_diameter, bottom, scene.radius_max)
    points = np.concatenate([points + np.array((x, 0.0, 0.0)) for x in scene.axes])
    return points + loose.shifts(scene, _PLACES, len(points))


def stages(scene):
    """Come to rest; let the walls slide up, as Bertho, Giorgiutti-Dauphine & Hulin (2003) do to have Janssen's law; discharge."""
    return [
        Stage("fill", scene.slide_step, lambda sim: None),
        Stage("slide", scene.stand_step, lambda sim: _slide(sim, scene, scene.slide_speed)),
        Stage("stand", scene.open_step, lambda sim: _slide(sim, scene, 0.0)),
        Stage("discharge", scene.last_step, lambda sim: _open(sim, scene)),
    ]


def walls_of(sim, silo):
    """Wall and floor of a silo, and the lid of its outlet."""
    return sim.walls[3 * silo : 3 * silo + 3]


class Leaving:
    """An action: grains remember the step at which they were first seen below a height.

    Args:
        height: [length].
        due: trigger, a function of the step.
    """

    def __init__(self, height, due):
        self.height, self.due = height, due

    def apply(self, sim):
        """Mark those that have come below it since the last look."""
        left = sim.grains.view("left_step")
        left[(left == 0) & (sim.grains.view("position")[:, 2] < self.height)] = sim.step_number


def _walls(scene, x, outlet_radius, top):
    """A tube, a floor with a hole, and what closes the hole."""
    radius = 0.5 * scene.silo_diameter
    yield Cone((x, 0.0, 0.0), (0, 0, 1), radius, radius, top, "wall")
    yield Cone((x, 0.0, 0.0), (0, 0, 1), outlet_radius, radius, 0.0, "floor")
    yield Cone((x, 0.0, 0.0), (0, 0, 1), 0.0, outlet_radius, 0.0, "floor")


def _slide(sim, scene, speed):
    for silo in range(scene.outlets):
        walls_of(sim, silo)[WALL].velocity = (0.0, 0.0, speed)


def _open(sim, scene):
    """Take the lids away at once, out of the box; grains remember where they are."""
    for silo, x in enumerate(scene.axes):
        walls_of(sim, silo)[LID].point = (float(x), 0.0, sim.box.low[2] - scene.silo_diameter)
    grains = sim.grains
    position, axis = grains.view("position"), scene.axes[grains.view("silo")]
    grains.view("start_height")[...] = position[:, 2]
    grains.view("start_distance")[...] = np.hypot(position[:, 0] - axis, position[:, 1])
