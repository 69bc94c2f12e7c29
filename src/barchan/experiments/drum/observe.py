"""What is measured, and written, while the drum turns."""

from math import hypot

import numpy as np

from barchan.experiments.drum.mixing import lacey
from barchan.experiments.repose.slope import straight
from barchan.experiments.repose.surface import LINES, PARTS, binned, scan
from barchan.kernels.exact_sum import exact_sum
from barchan.measure import ContactStatistics, EnergyAccount, KineticEnergy
from barchan.measure.sums import exact_sums
from barchan.triggers import At, Every
from barchan.writers import GrainFrames, LammpsDump, Table

#: The part of the surface through which its line is laid, on both sides of the axis, in radii of the drum.
MIDDLE = 0.5

#: Edge of the cells of the mixing index, as long as the drum; and width and thickness of the bins of the velocity in mid-chord,
#: in mean diameters.
CELL, WIDE, THICK = 2.0, 3.0, 0.5

#: The last steps of a run, through which energy is accounted for: it takes many times as long. At most those since the last frame
#: but one, so that a run which is made longer has as many of them.
ACCOUNT_STEPS = 1000


def instruments(scene, directory):
    """The writers that watch a drum: tables, frames of grains.

    Args:
        scene: a ``Drum``.
        directory: of the run.
    """
    frames, tables, begin = directory / "frames", directory / "tables", scene.turn_step
    rows, pictures = Every(scene.row_steps, begin % scene.row_steps), Every(scene.frame_steps, begin)
    first = max(scene.last_step - min(ACCOUNT_STEPS, scene.frame_steps), 0)
    account = EnergyAccount(f"from step {first}")
    account.due = Every(1, first)
    return [
        account,
        Table(tables / "time.csv", rows, lambda sim: time_row(sim, scene)),
        Table(tables / "profiles.csv", pictures, lambda sim: profile_rows(sim, scene)),
        Table(tables / "layer.csv", pictures, lambda sim: layer_rows(sim, scene)),
        Table(tables / "energy.csv", At(scene.last_step), lambda sim: energy_row(sim, account, first)),
        GrainFrames(frames, pictures),
        LammpsDump(frames, pictures),
    ]


def time_row(sim, scene):
    """One row of the time series. Torques are about the axis: of the grains on drum and plates, and of the grains' weight."""
    contacts, mass = ContactStatistics().compute(sim), sim.grains.view("mass")
    return {
        "since start [s]": (sim.step_number - scene.turn_step) * scene.dt,
        "torque [N m]": sum(wall.load.torque[1] for wall in sim.walls),
        "torque of the weight [N m]": scene.gravity * exact_sum(mass * sim.grains.view("position")[:, 0], sim.comm),
        "mixing index [1]": mixing_index(sim, scene),
        "kinetic energy [J]": KineticEnergy().compute(sim).total,
        "coordination": contacts.coordination,
        "largest overlap [1]": contacts.largest_overlap,
        "grains": sim.n_grains,
    }


def mixing_index(sim, scene):
    """Lacey's index of the grains that began on either side, in cells as long as the drum."""
    edge = CELL * scene.diameter
    across = int(2.0 * scene.drum_radius / edge) + 1
    position = sim.grains.view("position")
    x, z = ((place / edge).astype(np.int64) for place in (position[:, 0] + scene.drum_radius, position[:, 2]))
    cell = np.clip(x, 0, across - 1) * across + np.clip(z, 0, across - 1)
    side = sim.grains.view("lifted_side").astype(np.int64)
    counts = np.stack([np.bincount(cell, side, across * across), np.bincount(cell, minlength=across * across)])
    coloured, grains = sim.comm.sum(counts.astype(np.int64))
    return lacey(coloured, grains)


def profile(sim, scene):
    """The ``Profile`` of the surface over x + R, in strips along the drum."""
    radius, length = scene.drum_radius, scene.length
    x, y, height = scan(sim, (-radius, 0.0), (radius, length), scene.diameter / LINES)
    x, y = (axis.ravel() for axis in np.meshgrid(x, y, indexing="ij"))
    return binned(x + radius, y / length, height.ravel(), scene.diameter, int(2.0 * radius / scene.diameter))


def line_of(scene, distance, height):
    """The straight ``Line`` over x through the middle of a surface, from its heights over x + R."""
    x = distance - scene.drum_radius
    middle = np.abs(x) <= MIDDLE * scene.drum_radius
    return straight(x[middle], height[middle])


def profile_rows(sim, scene):
    """The profile of the surface: a row for each strip and each x."""
    surface = profile(sim, scene)
    return [
        {
            "part": part,
            "x [m]": float(surface.distance[k] - scene.drum_radius),
            "height [m]": float(surface.height[part, k]),
            "points": int(surface.points[part, k]),
        }
        for part in range(PARTS)
        for k in range(len(surface.distance))
    ]


def layer_rows(sim, scene):
    """Velocity down the slope below the middle of the surface, on the line from it through the axis: a row for each depth.

    Depth is from the line through the surface down to the centre of a grain.
    """
    surface = profile(sim, scene)
    line = line_of(scene, surface.distance, surface.mean)
    tilt = hypot(1.0, line.slope)
    position, velocity = sim.grains.view("position"), sim.grains.view("velocity")
    x, z = position[:, 0], position[:, 2]
    place = (x + line.slope * (z - scene.drum_radius)) / tilt
    depth = (line.origin + line.slope * x - z) / tilt
    speed = (velocity[:, 0] + line.slope * velocity[:, 2]) / tilt
    near = np.abs(place) <= 0.5 * WIDE * scene.diameter
    thick = THICK * scene.diameter
    bins = int(2.0 * scene.drum_radius / thick)
    index = np.clip(np.floor(depth[near] / thick).astype(np.int64), 0, bins - 1)
    mass = sim.grains.view("mass")[near]
    mass, momentum = exact_sums((mass, mass * speed[near]), sim.comm, index, bins)
    return [
        {
            "depth [m]": (number + 0.5) * thick,
            "mass [kg]": float(mass[number]),
            "momentum [kg m/s]": float(momentum[number]),
        }
        for number in range(bins)
    ]


def energy_row(sim, account, first):
    """Where the energy of the last steps came from, and where it went."""
    found = account.compute(sim)
    return {
        "accounted for [s]": (sim.step_number - first) * sim.dt,
        "work of the drum [J]": found.walls,
        "work of gravity [J]": found.gravity,
        "gained [J]": found.kinetic + found.elastic - found.start,
        "taken by friction [J]": found.friction,
        "taken by dashpots [J]": found.dashpots,
        "left over [J]": found.residual,
    }
