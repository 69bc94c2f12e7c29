"""What is measured, and written, while a pile is made."""

from barchan.experiments.repose.setup import FLOOR, LIFTED
from barchan.experiments.repose.slope import pile
from barchan.experiments.repose.surface import profile
from barchan.kernels.exact_sum import exact_sum
from barchan.measure import ContactStatistics, KineticEnergy, unbalanced_force
from barchan.triggers import Every
from barchan.writers import GrainFrames, LammpsDump, Table


def instruments(scene, directory):
    """The writers that watch a pile: tables, frames of grains.

    Args:
        scene: a ``Repose``.
        directory: of the run.
    """
    frames, lift = directory / "frames", scene.lift_step
    return [
        Table(
            directory / "tables" / "time.csv", Every(scene.row_steps, lift % scene.row_steps), lambda sim: time_row(sim, scene)
        ),
        Table(directory / "tables" / "profiles.csv", Every(scene.frame_steps, lift), lambda sim: profile_rows(sim, scene)),
        GrainFrames(frames, Every(scene.frame_steps, lift)),
        LammpsDump(frames, Every(scene.frame_steps, lift)),
    ]


def time_row(sim, scene):
    """One row of the time series. Forces are those that carry the grains: upward is positive."""
    surface = profile(sim, scene)
    shape = pile(surface.distance, surface.mean, scene.diameter)
    energy, contacts = KineticEnergy().compute(sim), ContactStatistics().compute(sim)
    flowing = sim.grains.view("frozen") == 0
    mass, force = sim.grains.view("mass"), sim.grains.view("force")[:, 2]
    weight = exact_sum(scene.gravity * mass[flowing], sim.comm)
    glued = exact_sum(force[~flowing], sim.comm) + exact_sum(scene.gravity * mass[~flowing], sim.comm)  # gravity pulls them too
    loads = [0.0 - wall.load.force[2] for wall in sim.walls]  # of a wall that nothing touches 0, not -0
    return {
        "since lift [s]": (sim.step_number - scene.lift_step) * scene.dt,
        "angle [deg]": shape.line.angle,
        "height [m]": shape.height,
        "run-out [m]": shape.run_out,
        "kinetic energy [J]": energy.total,
        "unbalanced force [1]": unbalanced_force(sim),
        "weight [N]": weight,
        "floor force [N]": loads[FLOOR] - glued,
        "lifted force [N]": loads[LIFTED],
        "other walls' force [N]": sum(loads[LIFTED + 1 :]),
        "lifted contacts": sim.walls[LIFTED].load.contacts,
        "contacts": contacts.count,
        "coordination": contacts.coordination,
        "largest overlap [1]": contacts.largest_overlap,
        "grains": int(sim.comm.sum([int(flowing.sum())])[0]),
        "left over the edge": sum(outlet["grains"] for outlet in sim.notes.get("outlets", {}).values()),
    }


def profile_rows(sim, scene):
    """The profile of the surface: a row for each part of it and each distance."""
    surface = profile(sim, scene)
    return [
        {
            "part": part,
            "distance [m]": float(surface.distance[column]),
            "height [m]": float(surface.height[part, column]),
            "points": int(surface.points[part, column]),
        }
        for part in range(len(surface.height))
        for column in range(len(surface.distance))
    ]
