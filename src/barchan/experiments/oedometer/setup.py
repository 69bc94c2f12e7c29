"""The sample at its start, and how it is loaded and unloaded."""

from barchan.experiments.cell import Cell
from barchan.experiments.cell.rain import flatten, raining
from barchan.experiments.experiment import Stage
from barchan.walls import Servo


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: grains on a lattice above the floor of a cell, with small velocities.

    Args:
        scene: an ``Oedometer``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the lattice would overlap.
    """
    sim = raining(scene, threads, comm, with_grains)
    cell = Cell.of(sim)
    target = {"stress": lambda sim: scene.target(sim.step_number), "area": cell.area(2)}
    cell.top.control = Servo(scene.closing_speed, start=scene.ends[0], **target)
    return sim


def stages(scene):
    """Rain, flatten the top and seat it, load, hold, unload, rest."""
    begins = {"seat": lambda sim: flatten(sim, scene)}
    names = ("rain", "seat", "load", "hold", "unload", "rest")
    return [Stage(name, end, begins.get(name, lambda sim: None)) for name, end in zip(names, scene.ends)]
