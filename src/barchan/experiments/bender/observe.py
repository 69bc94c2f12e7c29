"""What is measured, and written, while a sample is pressed and shaken."""

import numpy as np

from barchan.experiments.bender.pictures import SHOWN, moments
from barchan.experiments.bender.setup import receivers
from barchan.measure import ContactStatistics, coordination, solid_fraction, stress, unbalanced_force
from barchan.measure.base import full_step, squared
from barchan.measure.sums import exact_sums
from barchan.triggers import At, Every
from barchan.writers import GrainFrames, Table


def instruments(scene, directory):
    """The writers that watch a test: the sample as it is pressed and at the beginning of each pulse, the signals, and
    grains at moments of the first pulses.

    Args:
        scene: a ``Bender``.
        directory: of the run.
    """
    tables, shots, every = directory / "tables", scene.shots, scene.steps(scene.signal_every)
    begins, ends = np.array([(shot.begin, shot.end) for shot in shots]).T
    points = [step for begin, end in zip(begins, ends) for step in range(begin + every, end + 1, every)]
    seen = [step for shot in shots[:SHOWN] for step in moments(scene, shot)]
    return [
        Table(tables / "sample.csv", Every(scene.steps(scene.table_every)), sample_row),
        Table(tables / "pulses.csv", At(*(begins + 1)), sample_row),  # before anything moves; in a sweep that is continued, too
        Table(tables / "signals.csv", At(*points), lambda sim: signal_rows(sim, scene, np.searchsorted(ends, sim.step_number))),
        GrainFrames(directory / "frames", At(*seen)),
    ]


def sample_row(sim):
    """One row on the sample as a whole."""
    contacts, carried = ContactStatistics().compute(sim), np.diag(stress(sim).total)
    velocity, _ = full_step(sim, np.arange(sim.grains.n))
    square, grains = exact_sums((squared(velocity), np.ones(sim.grains.n)), sim.comm)[:, 0]
    return {
        **{f"stress {axis} [Pa]": float(value) for axis, value in zip("xyz", carried)},
        **{f"edge {axis} [m]": float(value) for axis, value in zip("xyz", sim.box.length)},
        "solid fraction [1]": solid_fraction(sim),
        "coordination": coordination(sim).plain,
        "largest overlap [1]": contacts.largest_overlap,
        "unbalanced force [1]": unbalanced_force(sim),
        "rms velocity [m/s]": float(np.sqrt(square / grains)),
    }


def signal_rows(sim, scene, shot):
    """A row for each receiver: mean velocity of its grains along the axis of the pulse.

    Args:
        shot: its number.
    """
    receiver = sim.grains.view("receiver")
    heard = np.flatnonzero(receiver >= 0)
    velocity, _ = full_step(sim, heard)
    height = np.abs(sim.grains.view("position")[heard, 2] - 0.5 * (sim.box.low[2] + sim.box.high[2]))
    columns = (np.ones(len(heard)), height, velocity[:, scene.shots[shot].axis])
    sums = exact_sums(columns, sim.comm, receiver[heard], receivers(scene, sim.box.length[2]))
    return [
        {
            "shot": int(shot),
            "grains": int(grains),
            "distance [m]": float(height / grains),
            "velocity [m/s]": float(along / grains),
        }
        for grains, height, along in sums.T
        if grains
    ]
