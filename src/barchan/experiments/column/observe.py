"""What is measured, and written, while columns stand and collapse."""

import numpy as np

from barchan.experiments.repose.slope import foot
from barchan.experiments.repose.surface import LINES, binned, scan
from barchan.measure import ContactStatistics, unbalanced_force
from barchan.measure.base import flowing_rows, full_step, squared
from barchan.measure.sums import exact_sums
from barchan.triggers import Every
from barchan.writers import GrainFrames, LammpsDump, Table

#: Mean height of the surface at the foot of a deposit, in mean diameters: grains cover half of the floor.
FOOT = 0.5


def instruments(scene, directory):
    """The writers that watch columns: tables, frames of grains.

    Args:
        scene: a ``Column``.
        directory: of the run.
    """
    frames, tables, begin = directory / "frames", directory / "tables", scene.release_step
    rows, pictures = Every(scene.row_steps, begin % scene.row_steps), Every(scene.frame_steps, begin)
    return [
        Table(tables / "time.csv", rows, time_row),
        Table(tables / "columns.csv", rows, lambda sim: column_rows(sim, scene)),
        Table(tables / "profiles.csv", pictures, lambda sim: profile_rows(sim, scene)),
        GrainFrames(frames, pictures),
        LammpsDump(frames, pictures),
    ]


def time_row(sim):
    """One row of what all columns have together."""
    contacts = ContactStatistics().compute(sim)
    flowing = int(sim.comm.sum([len(flowing_rows(sim))])[0])
    return {
        "unbalanced force [1]": unbalanced_force(sim),
        "coordination": contacts.coordination,
        "largest overlap [1]": contacts.largest_overlap,
        "grains": flowing,
        "left over the edge": sum(outlet["grains"] for outlet in sim.notes.get("outlets", {}).values()),
    }


def column_rows(sim, scene):
    """A row for each column: its energies, potential energy from the floor up, and the shape of its surface. Grains that rolled
    off its glued floor count no more."""
    rows = flowing_rows(sim)
    position, column = sim.grains.view("position")[rows], sim.grains.view("column")[rows]
    on_floor = np.hypot(position[:, 0] - scene.axes[column], position[:, 1]) < scene.floors[column]
    rows, column, height = rows[on_floor], column[on_floor], position[on_floor, 2]
    mass = sim.grains.view("mass")[rows]
    (velocity, omega), inertia = full_step(sim, rows), sim.grains.view("inertia")[rows]
    kinetic = 0.5 * mass * squared(velocity) + 0.5 * inertia * squared(omega)
    columns = (np.ones(len(rows)), mass, mass * height, kinetic)
    grains, mass, moment, kinetic = exact_sums(columns, sim.comm, column, scene.columns)
    told = []
    for number in range(scene.columns):
        surface = profile(sim, scene, number)
        told.append(
            {
                "column": number,
                "since release [s]": (sim.step_number - scene.release_step) * scene.dt,
                "grains": int(grains[number]),
                "mass [kg]": float(mass[number]),
                "mean height [m]": float(moment[number] / mass[number]),
                "kinetic energy [J]": float(kinetic[number]),
                "potential energy [J]": float(scene.gravity * moment[number]),
                "height [m]": float(surface.mean.max()),
                "front [m]": foot(surface.distance, surface.mean, FOOT * scene.diameter),
            }
        )
    return told


def profile(sim, scene, number):
    """The ``Profile`` of a column, in sectors about its axis."""
    x, radius = float(scene.axes[number]), float(scene.floors[number])
    across, along, height = scan(sim, (x - radius, -radius), (x + radius, radius), scene.diameter / LINES)
    across, along = (axis.ravel() for axis in np.meshgrid(across - x, along, indexing="ij"))
    turn = np.arctan2(along, across) / (2.0 * np.pi) + 0.5
    return binned(np.hypot(across, along), turn, height.ravel(), scene.diameter, int(radius / scene.diameter))


def profile_rows(sim, scene):
    """The profile of the surface: a row for each column, each sector and each distance."""
    return [
        {
            "column": number,
            "part": part,
            "distance [m]": float(surface.distance[k]),
            "height [m]": float(surface.height[part, k]),
            "points": int(surface.points[part, k]),
        }
        for number, surface in enumerate(profile(sim, scene, number) for number in range(scene.columns))
        for part in range(len(surface.height))
        for k in range(len(surface.distance))
    ]
