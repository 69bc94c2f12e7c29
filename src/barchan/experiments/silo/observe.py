"""What is measured, and written, while silos are filled and discharged."""

import numpy as np

from barchan.experiments.silo.setup import FLOOR, LID, LOOK_STEPS, WALL, walls_of
from barchan.measure import ContactStatistics, unbalanced_force
from barchan.measure.base import full_step, squared
from barchan.measure.sums import exact_sums
from barchan.measure.touching import touching_walls
from barchan.triggers import Every
from barchan.writers import GrainFrames, LammpsDump, Table

#: Height of a ring of the wall in which forces are summed, in mean diameters.
RING = 2.0


def instruments(scene, directory):
    """The writers that watch silos: tables, frames of grains.

    Args:
        scene: a ``Silo``.
        directory: of the run.
    """
    frames, tables, begin = directory / "frames", directory / "tables", scene.open_step
    rows, pictures = Every(scene.row_steps, begin % scene.row_steps), Every(scene.frame_steps, begin)
    return [
        Table(tables / "time.csv", rows, time_row),
        Table(tables / "silos.csv", rows, lambda sim: silo_rows(sim, scene)),
        Table(tables / "walls.csv", pictures, lambda sim: wall_rows(sim, scene)),
        Table(tables / "left.csv", Every(LOOK_STEPS), left_rows),
        GrainFrames(frames, pictures),
        LammpsDump(frames, pictures),
    ]


def time_row(sim):
    """One row of what all silos have together."""
    contacts = ContactStatistics().compute(sim)
    return {
        "unbalanced force [1]": unbalanced_force(sim),
        "contacts": contacts.count,
        "coordination": contacts.coordination,
        "largest overlap [1]": contacts.largest_overlap,
        "grains": sim.n_grains,
        "left below": sum(outlet["grains"] for outlet in sim.notes.get("outlets", {}).values()),
    }


def silo_rows(sim, scene):
    """A row for each silo, of the grains that have not left it. Forces are those that carry the grains: upward is positive."""
    inside = np.flatnonzero(sim.grains.view("left_step") == 0)
    mass, height = sim.grains.view("mass")[inside], sim.grains.view("position")[inside, 2]
    (velocity, omega), inertia = full_step(sim, inside), sim.grains.view("inertia")[inside]
    energy = 0.5 * mass * squared(velocity) + 0.5 * inertia * squared(omega)
    silo = sim.grains.view("silo")[inside]
    columns = (np.ones(len(inside)), mass, mass * height, energy)
    grains, mass, moment, energy = exact_sums(columns, sim.comm, silo, scene.outlets)
    rows = []
    for number, outlet in enumerate(scene.outlet_diameters):
        loads = [wall.load for wall in walls_of(sim, number)]
        rows.append(
            {
                "silo": number,
                "outlet [m]": float(outlet),
                "since opening [s]": (sim.step_number - scene.open_step) * scene.dt,
                "grains": int(grains[number]),
                "mass [kg]": float(mass[number]),
                "mean height [m]": float(moment[number] / mass[number]) if mass[number] else 0.0,
                "kinetic energy [J]": float(energy[number]),
                "floor force [N]": 0.0 - loads[FLOOR].force[2] - loads[LID].force[2],
                "wall force [N]": 0.0 - loads[WALL].force[2],
                "wall pressing [N]": loads[WALL].pressing,
            }
        )
    return rows


def wall_rows(sim, scene):
    """What grains do to the wall: a row for each silo and each ring of its wall, from the floor up."""
    ring = RING * scene.diameter
    rings = int(sim.box.high[2] / ring) + 1
    silo, height = sim.grains.view("silo").astype(np.int64), sim.grains.view("position")[:, 2]
    bins = silo * rings + np.clip((height / ring).astype(np.int64), 0, rings - 1)
    inside = sim.grains.view("left_step") == 0
    (mass,) = exact_sums((sim.grains.view("mass")[inside],), sim.comm, bins[inside], scene.outlets * rings)
    contacts = touching_walls(sim)
    keys = [wall.key for number in range(scene.outlets) for wall in walls_of(sim, number)[WALL : WALL + 1]]
    on_wall = np.isin(sim.contacts.wall_key[contacts.contact], keys)
    columns = (contacts.normal_force[on_wall], contacts.force[2, on_wall])
    pressing, friction = exact_sums(columns, sim.comm, bins[contacts.grain[on_wall]], scene.outlets * rings)
    return [
        {
            "silo": number // rings,
            "height [m]": (number % rings + 0.5) * ring,
            "mass [kg]": float(mass[number]),
            "pressing [N]": float(pressing[number]),
            "friction [N]": float(friction[number]),
        }
        for number in range(scene.outlets * rings)
    ]


def left_rows(sim):
    """The grains that have left since the last look, one row each, by ascending id."""
    grains = sim.grains
    new = np.flatnonzero((grains.view("left_step") == sim.step_number) & (sim.step_number > 0))
    names = ("id", "silo", "mass", "start_height", "start_distance")
    parts = sim.comm.all_gather([grains.view(name)[new] for name in names])
    columns = [np.concatenate(column) for column in zip(*parts)]
    order = np.argsort(columns[0], kind="stable")
    return [
        {
            "id": int(id),
            "silo": int(silo),
            "mass [kg]": float(mass),
            "start height [m]": float(height),
            "start distance [m]": float(distance),
        }
        for id, silo, mass, height, distance in zip(*(column[order] for column in columns))
    ]
