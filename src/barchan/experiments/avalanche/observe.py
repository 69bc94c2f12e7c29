"""What is measured, and written, while an avalanche runs."""

from barchan.experiments.avalanche.parameters import Outline
from barchan.experiments.avalanche.setup import FLOWING
from barchan.measure import ContactStatistics, EnergyBudget, Front, Jet, Profile
from barchan.triggers import Every
from barchan.writers import ContactFrames, GrainFrames, LammpsDump, Table

#: Where profiles are taken, relative to the right wall in lengths of the block.
STATIONS = {"upstream": -0.25, "right wall": 0.0, "downstream": 0.25}


def stations(scene):
    """x of the stations [m]."""
    outline = Outline.of(scene)
    return [(1.0 + place) * outline.length * outline.edge for place in STATIONS.values()]


def instruments(scene, directory):
    """The writers that watch an avalanche: tables, frames of grains and contacts.

    Args:
        scene: an ``Avalanche``.
        directory: of the run.
    """

    release, frames = scene.release_step, directory / "frames"
    row, frame, contact = (max(scene.steps(t), 1) for t in (scene.table_every, scene.frame_every, scene.contacts_every))
    return [
        Table(directory / "tables" / "time.csv", Every(row, start=release % row), lambda sim: time_row(sim, scene)),
        Table(directory / "tables" / "profiles.csv", Every(frame, start=release + frame), lambda sim: profile_rows(sim, scene)),
        GrainFrames(frames, Every(frame, start=release)),
        LammpsDump(frames, Every(frame, start=release)),
        ContactFrames(frames, Every(contact, start=release)),
    ]


def time_row(sim, scene):
    """One row of the time series."""
    outline, grain = Outline.of(scene), scene.simulated
    diameter = grain.radius_min + grain.radius_max
    front = Front(outline.length * outline.edge, 2.0 * diameter).compute(sim)
    budget = EnergyBudget(sim.notes["energy_at_start"] - energy_gone(sim)).compute(sim)
    jet = Jet(outline.floor * outline.edge, diameter).compute(sim)
    contacts = ContactStatistics().compute(sim)
    layers = [Profile(x, 4.0 * diameter, diameter).compute(sim).moving_layer for x in stations(scene)]
    return {
        "since release [s]": (sim.step_number - scene.release_step) * grain.dt,
        "front [m]": front.position,
        "99 % of grains [m]": front.mass_99,
        "foremost grain [m]": front.foremost,
        **{f"moving layer {name} [m]": layer for name, layer in zip(STATIONS, layers)},
        "kinetic energy [J]": budget.translation,
        "rotational energy [J]": budget.rotation,
        "potential energy [J]": budget.potential,
        "elastic energy [J]": budget.elastic,
        "dissipated energy [J]": budget.dissipated,
        "jet height [m]": jet.height,
        "jet volume [m^3]": jet.solid_volume,
        "jet speed [m/s]": jet.rising_velocity,
        "contacts": contacts.count,
        "coordination": contacts.coordination,
        "largest overlap [1]": contacts.largest_overlap,
        "grains": int(sim.comm.sum([int((sim.grains.view("part") == FLOWING).sum())])[0]),
        "left through outlets": sum(outlet["grains"] for outlet in sim.notes.get("outlets", {}).values()),
    }


def energy_gone(sim):
    """Energy that grains took along through outlets [J]."""
    return sum(outlet["energy"] for outlet in sim.notes.get("outlets", {}).values())


def profile_rows(sim, scene):
    """Profiles over the height at the stations."""
    diameter = scene.simulated.radius_min + scene.simulated.radius_max
    rows = []
    for x in stations(scene):
        profile = Profile(x, 4.0 * diameter, diameter).compute(sim)
        for values in zip(profile.z, profile.velocity, profile.speed, profile.solid_fraction, profile.temperature):
            names = ("z [m]", "velocity [m/s]", "speed [m/s]", "solid fraction [1]", "temperature [m^2/s^2]")
            rows.append({"station [m]": x} | dict(zip(names, map(float, values))))
    return rows
