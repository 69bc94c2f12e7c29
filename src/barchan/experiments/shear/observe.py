"""What is measured, and written, while grains are sheared."""

from itertools import pairwise

import numpy as np

from barchan.experiments.shear.parameters import ROWS, ROWS_OF_PROFILE
from barchan.measure import ContactStatistics, EnergyAccount, coordination, sliding_fraction, solid_fraction, stress
from barchan.measure.base import full_step
from barchan.measure.sums import exact_sums
from barchan.triggers import At
from barchan.writers import GrainFrames, Table

#: Slices across the gradient in which profiles are taken.
SLICES = 8


def instruments(scene, directory):
    """The writers that watch the shear: tables, frames of grains, and the energy while the first stage is averaged.

    Args:
        scene: a ``Shear``.
        directory: of the run.
    """
    tables, rows, profiles = directory / "tables", [], []
    for begin, end, every in zip((0, *scene.ends), scene.ends, scene.row_steps):
        rows += range(end, begin, -every)
        profiles += range(end, end - ROWS * every, -ROWS_OF_PROFILE * every)
    account, accounted = EnergyAccount(), (scene.begins[0], scene.ends[0])
    account.due = At(*range(accounted[0], accounted[1] + 1))
    return [
        Table(tables / "time.csv", At(*rows), lambda sim: time_row(sim, scene)),
        Table(tables / "profiles.csv", At(*profiles), lambda sim: profile_rows(sim, scene)),
        account,
        Table(tables / "energy.csv", At(*accounted), lambda sim: energy_row(sim, account)),
        GrainFrames(directory / "frames", At(0, *scene.ends)),
    ]


def time_row(sim, scene):
    """One row of the whole sample. The stage is that of the step that has been made."""
    stage, carried, contacts = scene.stage(sim.step_number - 1), stress(sim).total, ContactStatistics().compute(sim)
    volume, around = float(np.prod(sim.box.length)), coordination(sim)
    return {
        "stage": stage,
        "shear rate [1/s]": float(scene.shear_rates[stage]),
        "shear stress [Pa]": -float(carried[0, 2]),
        **{f"normal stress {axis} [Pa]": float(carried[number, number]) for number, axis in enumerate("xyz")},
        "solid fraction [1]": solid_fraction(sim),
        "height [m]": float(sim.box.length[2]),
        "coordination": around.plain,
        "mechanical coordination": around.mechanical,
        "sliding contacts [1]": sliding_fraction(sim),
        "stress power [W]": -volume * float((carried * sim.box.gradient).sum()),
        "largest overlap [1]": contacts.largest_overlap,
        "grains": sim.n_grains,
    }


def profile_rows(sim, scene):
    """A row for each slice, from the lowest up. Velocities are those in space: in the box, and of the box."""
    low, high = sim.box.low, sim.box.high
    edges = np.linspace(low[2], high[2], SLICES + 1)
    height, mass = sim.grains.view("position")[:, 2], sim.grains.view("mass")
    slices = np.clip(np.searchsorted(edges, height, side="right") - 1, 0, SLICES - 1)
    speed = full_step(sim, slice(None))[0][:, 0] + sim.box.gradient[0, 2] * (height - 0.5 * (low[2] + high[2]))
    masses, momenta = exact_sums((mass, mass * speed), sim.comm, slices, SLICES)
    rows = []
    for number, (bottom, top) in enumerate(pairwise(edges)):
        brick = (*low[:2], bottom), (*high[:2], top)
        carried = stress(sim, *brick).total
        rows.append(
            {
                "stage": scene.stage(sim.step_number - 1),
                "height [1]": (number + 0.5) / SLICES,
                "velocity [m/s]": float(momenta[number] / masses[number]) if masses[number] else 0.0,
                "solid fraction [1]": solid_fraction(sim, *brick),
                "shear stress [Pa]": -float(carried[0, 2]),
                "normal stress z [Pa]": float(carried[2, 2]),
            }
        )
    return rows


def energy_row(sim, account):
    """Where energy came from and went since the first stage is averaged."""
    account.compute(sim)
    return {
        "work of the box [J]": account.box,
        "friction [J]": account.friction,
        "dashpots [J]": account.dashpots,
        "stored [J]": account.kinetic + account.elastic,
        "left over [J]": account.residual,
    }
