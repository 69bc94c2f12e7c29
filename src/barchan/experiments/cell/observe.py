"""What is measured, and written, while a sample in a cell is loaded."""

import numpy as np

from barchan.experiments.cell.walls import WALLS, Cell
from barchan.measure import ContactStatistics, coordination, fabric, inertial_number, sliding_fraction, stress, unbalanced_force
from barchan.measure.sums import exact_sums
from barchan.triggers import At, Every
from barchan.writers import GrainFrames, Table

#: Rows of the table while grains rain.
RAIN_ROWS = 50


def watching(scene, directory, row):
    """The writers that watch a sample: while it rains, while it is loaded, and frames of its grains.

    Args:
        scene: a ``CellScene``.
        directory: of the run.
        row: function (simulation, scene) -> a row of the table of the loading, mostly ``load_row``.
    """
    rained = scene.ends[0]
    every, frame = (max(scene.steps(time), 1) for time in (scene.table_every, scene.frame_every))
    every |= 1  # an odd number: so that a stress that changes with every step is seen to
    return [
        Table(directory / "tables" / "rain.csv", At(*range(rained, 0, -max(rained // RAIN_ROWS, 1))), rain_row),
        Table(directory / "tables" / "load.csv", Every(every, start=rained + every), lambda sim: row(sim, scene)),
        GrainFrames(directory / "frames", Every(frame, start=rained % frame)),
    ]


def rain_row(sim):
    """One row while grains come to rest."""
    statistics = ContactStatistics().compute(sim)
    return {"unbalanced force [1]": unbalanced_force(sim), "coordination": statistics.coordination, "grains": sim.n_grains}


def load_row(sim, scene, rate):
    """One row while the sample is loaded; ``rate``: of strain, for the inertial number [1/s]."""
    cell = Cell.of(sim)
    low, high = cell.corners()
    size = high - low
    solid = float(exact_sums([4.0 / 3.0 * np.pi * sim.grains.view("radius") ** 3], sim.comm)[0, 0])
    stresses, inside = cell.stresses(sim), stress(sim, low, high)
    mean, statistics, contacts = float(stresses.mean()), ContactStatistics().compute(sim), coordination(sim)
    diameter = scene.radius_min + scene.radius_max
    return {
        "target stress [Pa]": scene.target(sim.step_number),
        "mean stress [Pa]": mean,
        **{f"stress {name} [Pa]": float(value) for name, value in zip(WALLS, stresses)},
        **{f"size {axis} [m]": float(value) for axis, value in zip("xyz", size)},
        "mean stress of grains [Pa]": inside.mean_stress,
        "deviatoric stress of grains [Pa]": inside.deviatoric_stress,
        "void ratio [1]": float(np.prod(size)) / solid - 1.0,
        "coordination": contacts.plain,
        "mechanical coordination": contacts.mechanical,
        "rattlers": contacts.rattlers,
        "anisotropy of fabric [1]": fabric(sim).anisotropy,
        "sliding contacts [1]": sliding_fraction(sim),
        "unbalanced force [1]": unbalanced_force(sim),
        "inertial number [1]": inertial_number(rate, max(mean, 1e-9), diameter, scene.density),
        "largest overlap [1]": statistics.largest_overlap,
        "contacts": statistics.count,
        "grains": sim.n_grains,
    }
