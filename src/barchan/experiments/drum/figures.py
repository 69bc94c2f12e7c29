"""Pictures of a turning drum, from the tables and frames of its run."""

import numpy as np

from barchan.experiments.drum.parameters import PAPER_ANGLE
from barchan.experiments.drum.results import (
    ENDS,
    INNER,
    Tables,
    angles_in_time,
    is_measured,
    layer_of,
    steady,
    surface_of,
    torques,
)
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure
from barchan.writers import frames, read_grain_frame

#: Thickness of the slice that is shown, in mean diameters.
SLICE = 3.0


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, tables = directory / "figures", Tables.of(directory)
    there = frames(directory / "frames", "grains")
    if tables.energy is None or tables.time["step"][-1] < scene.last_step or scene.last_step <= scene.steady_step or not there:
        return
    yield slices(scene, there, out / "drum.png")
    yield surfaces(scene, surface_of(tables), out / "angle.png")
    yield layer(scene, layer_of(scene, tables), out / "layer.png")
    yield mixing(scene, tables.time, out / "mixing.png")


def slices(scene, there, path):
    """A slice through the middle of the drum as it begins to turn, after a half turn and at the end, by where grains began."""
    half = scene.turn_step + scene.steps(np.pi / scene.rotation)
    later = min(there, key=lambda frame: abs(frame.step - half))
    shown = sorted({frame.step: frame for frame in (there[0], later, there[-1])}.items())
    last = read_grain_frame(there[-1].path).fields
    side = dict(zip(last["id"].tolist(), last["lifted_side"].tolist()))  # the first frame is written before grains have one
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    radius = 1e3 * scene.drum_radius
    with figure(path, 1, len(shown), size=(9.0, 3.6), sharey=True, squeeze=False) as (_, axes):
        for number, (axis, (_, frame)) in enumerate(zip(axes[0], shown)):
            fields = read_grain_frame(frame.path).fields
            near = np.abs(fields["position"][:, 1] - 0.5 * scene.length) <= 0.5 * SLICE * scene.diameter
            colours = np.array([COLOURS[0], COLOURS[4]])[[side[id] for id in fields["id"][near].tolist()]]
            draw_grains(axis, fields["position"][near], fields["radius"][near], colours, None)
            axis.plot(radius * np.cos(turn), radius * (1.0 + np.sin(turn)), color="#000000", linewidth=0.8)
            turned = (frame.step - scene.turn_step) * scene.dt * scene.rotation / (2.0 * np.pi)
            axis.set_title(f"({chr(97 + number)})  after {turned:.2f} turns", loc="left", fontsize=9)
            axis.set(xlim=(-1.05 * radius, 1.05 * radius), ylim=(-0.05 * radius, 2.05 * radius), aspect="equal", xlabel="x [mm]")
            axis.grid(False)
        axes[0, 0].set_ylabel("height [mm]")
    return path


def surfaces(scene, surface, path):
    """The mean surface with the line through its middle, and the angle against time."""
    late = steady(scene, surface.steps)
    time = (surface.steps - scene.turn_step) * scene.dt
    with figure(path, 1, 2, size=(8.4, 3.6)) as (_, axes):
        for name, parts, colour in (("at the ends", ENDS, COLOURS[1]), ("middle half of the length", INNER, COLOURS[0])):
            line = surface.line(scene, late, parts)
            x = np.array((-0.5, 0.5)) * scene.drum_radius
            axes[0].plot(1e3 * surface.x, 1e3 * surface.mean(late, parts), "o", markersize=3, color=colour, label=name)
            axes[0].plot(1e3 * x, 1e3 * (line.origin + line.slope * x), color=colour, label=f"{line.angle:.1f} deg")
            axes[1].plot(time, angles_in_time(scene, surface, parts), color=colour, label=name)
        if is_measured(scene):
            axes[1].axhline(PAPER_ANGLE, color=COLOURS[6], linestyle="--", linewidth=1.0, label="measured at the ends")
        axes[1].axvline(scene.develop, color="#909090", linewidth=0.8)
        axes[0].set(xlabel="x [mm]", ylabel="height of the surface [mm]", aspect="equal")
        axes[1].set(xlabel="time of turning [s]", ylabel="angle of the surface [deg]", ylim=(0.0, None))
        for axis in axes:
            axis.legend()
    return path


def layer(scene, found, path):
    """Velocity down the slope over the depth, in mid-chord."""
    with figure(path, size=(4.6, 3.8)) as (_, axis):
        axis.plot(found.velocity, found.depth / scene.diameter, "o-", markersize=3)
        axis.axvline(0.0, color="#000000", linewidth=0.8)
        label = f"layer that flows: {found.thickness / scene.diameter:.1f} d"
        axis.axhline(found.thickness / scene.diameter, color=COLOURS[1], linestyle="--", linewidth=1.0, label=label)
        axis.set(xlabel="velocity down the slope in mid-chord [m/s]", ylabel="depth below the surface / d")
        axis.invert_yaxis()
        axis.legend()
    return path


def mixing(scene, series, path):
    """Mixing index and torques over the turns."""
    turned = series["since start [s]"] * scene.rotation / (2.0 * np.pi)
    after = turned >= 0.0
    with figure(path, 1, 2, size=(8.4, 3.4)) as (_, axes):
        axes[0].plot(turned[after], series["mixing index [1]"][after])
        axes[0].set(ylabel="mixing index of Lacey", ylim=(None, 1.02))
        torque, _ = torques(scene, series)
        for name, label, colour in (
            ("torque [N m]", "of the drum on the grains", COLOURS[5]),
            ("torque of the weight [N m]", "against the grains' weight", COLOURS[1]),
        ):
            axes[1].plot(turned[after], -1e3 * series[name][after], color=colour, linewidth=1.0, label=label)
        axes[1].axhline(1e3 * torque, color=COLOURS[6], linestyle="--", linewidth=1.0, label="mean of the steady flow")
        axes[1].set(ylabel="torque [mN m]", ylim=(0.0, None))
        axes[1].legend()
        for axis in axes:
            axis.set_xlabel("turns of the drum")
    return path
