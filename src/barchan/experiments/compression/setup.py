"""The sample at its start, and how it is loaded."""

from barchan.experiments.cell import Cell
from barchan.experiments.cell.rain import flatten, raining
from barchan.experiments.experiment import Stage
from barchan.walls import Proportional, Servo


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: grains on a lattice above the floor of a cell, with small velocities.

    Args:
        scene: a ``Compression``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the lattice would overlap.
    """
    sim = raining(scene, threads, comm, with_grains)
    cell = Cell.of(sim)
    for axis, pair in enumerate(cell.pairs()):
        for plane in pair:
            plane.control = _control(scene, cell.area(axis))
    return sim


def _control(scene, area):
    target = {"stress": lambda sim: scene.target(sim.step_number), "area": area, "max_speed": scene.closing_speed}
    target["start"] = scene.ends[0]
    return Servo(**target) if scene.controller == "servo" else Proportional(scene.gain, **target)


def stages(scene):
    """Rain, flatten the top and seat the walls, load, hold."""
    rained, seated, loaded, held = scene.ends
    return [
        Stage("rain", rained, lambda sim: None),
        Stage("seat", seated, lambda sim: flatten(sim, scene)),
        Stage("load", loaded, lambda sim: None),
        Stage("hold", held, lambda sim: None),
    ]
