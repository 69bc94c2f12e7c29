"""Pictures of a pile, from the tables and frames of its run."""

import numpy as np

from barchan.experiments.repose.results import part_name, shapes_of, time_series
from barchan.experiments.repose.slope import FITTED
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure
from barchan.writers import frames, read_grain_frame

#: Thickness of the slice that is shown, in mean diameters.
SLICE = 3.0


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out = directory / "figures"
    series, shapes = time_series(directory), shapes_of(scene, directory)
    there = frames(directory / "frames", "grains")
    if series is None or not shapes or not there:
        return
    yield slices(scene, there, shapes, out / "pile.png")
    yield profile_figure(scene, shapes[-1], out / "profile.png")
    yield history(scene, series, out / "time.png")


def slices(scene, there, shapes, path):
    """A slice through the middle before, during and after the lift, grains coloured by their height at the start."""
    half_way = min(there, key=lambda frame: abs(frame.step - 0.5 * (scene.lift_step + scene.lifted_step)))
    shown = sorted({frame.step: frame for frame in (there[0], half_way, there[-1])}.items())
    pictures = [read_grain_frame(frame.path) for _, frame in shown]
    highest = max(float(frame.fields["position"][:, 2].max()) for frame in pictures) + scene.radius_max
    widest = 1.2 * max(shape.pile.run_out for shape in shapes) + 4.0 * scene.diameter
    start = pictures[0].fields["start_height"]
    left = -widest if scene.method == "cylinder" else -2.0 * scene.diameter
    size = (7.0, 0.5 + len(pictures) * (0.4 + 5.5 * (highest + 3.0 * scene.diameter) / (widest - left)))
    with figure(path, len(pictures), 1, size=size, sharex=True, sharey=True, squeeze=False) as (drawing, axes):
        for number, (axis, frame) in enumerate(zip(axes[:, 0], pictures)):
            discs = _slice(axis, frame.fields, scene, (0.0, float(start.max())))
            _standing(axis, scene, frame, highest)
            since = frame.time - scene.lift_step * scene.dt
            title = f"{since:.2f} s after the lift began" if since > 0.5 * scene.dt else "before the lift"
            axis.set_title(f"({chr(97 + number)})  {title}", loc="left", fontsize=9)
            axis.set(xlim=(1e3 * left, 1e3 * widest), ylim=(-1.5e3 * scene.diameter, 1.03e3 * highest), aspect="equal")
            axis.set_ylabel("height [mm]")
            axis.grid(False)
        _line(axes[-1, 0], shapes[-1], both=scene.method == "cylinder")
        axes[-1, 0].set_xlabel("from the axis [mm]" if scene.method == "cylinder" else "from the back wall [mm]")
        drawing.colorbar(discs, ax=axes, label="height at the start [mm]", shrink=0.6)
    return path


def _slice(axis, fields, scene, limits):
    """Grains near the middle plane; those of the floor in grey."""
    near = np.abs(fields["position"][:, 1]) <= 0.5 * SLICE * scene.diameter
    glued = near & (fields["frozen"] == 1)
    moving = near & (fields["frozen"] == 0)
    draw_grains(axis, fields["position"][glued], fields["radius"][glued], "#909090", None)
    values = 1e3 * fields["start_height"][moving]
    return draw_grains(axis, fields["position"][moving], fields["radius"][moving], values, (0.0, 1e3 * limits[1]))


def _standing(axis, scene, frame, highest):
    """The walls as they stand in a frame: what is lifted, the floor, and the back wall."""
    lifted = min(max(frame.step - scene.lift_step, 0), scene.lifted_step - scene.lift_step) * scene.dt * scene.lift_speed
    places = (-scene.cylinder_radius, scene.cylinder_radius) if scene.method == "cylinder" else (scene.length,)
    for x in places:
        axis.plot([1e3 * x, 1e3 * x], [1e3 * lifted, max(1.2e3 * highest, 1e3 * lifted)], color=COLOURS[6], linewidth=1.2)
    axis.axhline(0.0, color=COLOURS[6], linewidth=0.8)
    if scene.method == "plate":
        axis.axvline(0.0, color=COLOURS[6], linewidth=1.2)


def _line(axis, shape, both):
    """The fitted line over the part of the slope that it was laid through, on both sides of a round pile."""
    x = shape.pile.run_out * np.array(FITTED)
    height = shape.pile.line.origin + shape.pile.line.slope * x
    for side in (1.0, -1.0) if both else (1.0,):
        axis.plot(1e3 * side * x, 1e3 * height, color=COLOURS[1], linewidth=2.0)


def profile_figure(scene, shape, path):
    """The profile of the surface at the end, of the whole and of its parts, with the line."""
    distance, pile = 1e3 * shape.profile.distance, shape.pile
    with figure(path) as (_, axis):
        for part in shape.profile.height:
            axis.plot(distance, 1e3 * part, color="#BBBBBB", linewidth=0.8, zorder=1)
        axis.plot([], [], color="#BBBBBB", linewidth=0.8, label=f"{len(shape.parts)} {part_name(scene)}")
        axis.plot(distance, 1e3 * shape.profile.mean, "o", markersize=4, label="mean")
        x = pile.run_out * np.array(FITTED)
        angle = f"{pile.line.angle:.1f}° ± {pile.line.angle_error:.1f}° (line), ± {shape.scatter:.1f}° ({part_name(scene)})"
        axis.plot(1e3 * x, 1e3 * (pile.line.origin + pile.line.slope * x), color=COLOURS[1], linewidth=2.0, label=angle)
        axis.axvline(1e3 * pile.run_out, color=COLOURS[2], linestyle="--", linewidth=1.0, label="run-out")
        where = "axis" if scene.method == "cylinder" else "back wall"
        axis.set(xlabel=f"distance from the {where} [mm]", ylabel="height of the surface [mm]", ylim=(0.0, None))
        axis.set_xlim(0.0, min(1.4e3 * pile.run_out + 2e3 * scene.diameter, 1e3 * scene.floor))
        axis.legend()
    return path


def history(scene, series, path):
    """Angle, height, run-out and energy of motion against time."""
    time, lifted = series["since lift [s]"], (scene.lifted_step - scene.lift_step) * scene.dt
    begun = time >= 0.0
    columns = (
        ("angle [deg]", 1.0, "angle of the line [deg]"),
        ("height [m]", 1e3, "height [mm]"),
        ("run-out [m]", 1e3, "run-out [mm]"),
        ("kinetic energy [J]", 1.0, "kinetic energy [J]"),
    )
    with figure(path, 2, 2, size=(8.0, 5.0), sharex=True) as (_, axes):
        for axis, (name, factor, label) in zip(axes.ravel(), columns):
            axis.plot(time[begun], factor * series[name][begun])
            axis.axvline(lifted, color=COLOURS[6], linestyle=":", linewidth=1.0, label="end of the lift")
            axis.set_ylabel(label)
        axes[1, 1].set_yscale("log")
        axes[0, 0].legend()
        for axis in axes[1]:
            axis.set_xlabel("time after the begin of the lift [s]")
    return path
