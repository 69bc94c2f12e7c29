"""Pictures of columns and their deposits, from the tables and frames of their run."""

import numpy as np

from barchan.experiments.column import scaling
from barchan.experiments.column.results import Tables, collapses
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure
from barchan.writers import frames, read_grain_frame

#: Thickness of the slice that is shown, in mean diameters.
SLICE = 3.0


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, tables = directory / "figures", Tables.of(directory)
    there = frames(directory / "frames", "grains")
    if tables.columns is None or tables.columns["step"][-1] < scene.last_step or not there:
        return
    found = collapses(scene, tables)
    yield slices(scene, there, out / "columns.png")
    yield profiles(scene, tables, found, out / "profiles.png")
    yield scalings(scene, found, out / "scaling.png")
    yield history(scene, tables, found, out / "time.png")


def slices(scene, there, path):
    """A slice through the middle of the tallest column before, during and after its collapse, by height at the release."""
    early = min(there, key=lambda frame: abs((frame.step - scene.release_step) * scene.dt - 0.2 * scene.duration))
    shown = sorted({frame.step: frame for frame in (there[0], early, there[-1])}.items())
    pictures = [(frame, read_grain_frame(frame.path).fields) for _, frame in shown]
    x, floor = float(scene.axes[-1]), float(scene.floors[-1])
    start = pictures[0][1]
    height = dict(zip(start["id"].tolist(), start["position"][:, 2].tolist()))
    highest = float(start["position"][:, 2].max()) + scene.radius_max
    size = (7.0, 0.6 + len(pictures) * (0.4 + 5.4 * (highest + 3.0 * scene.diameter) / (2.0 * floor)))
    with figure(path, len(pictures), 1, size=size, sharex=True, sharey=True, squeeze=False) as (drawing, axes):
        for number, (axis, (frame, fields)) in enumerate(zip(axes[:, 0], pictures)):
            position = fields["position"] - np.array((x, 0.0, 0.0))
            near = (np.abs(position[:, 1]) <= 0.5 * SLICE * scene.diameter) & (np.abs(position[:, 0]) < floor)
            glued, moving = (near & (fields["frozen"] == frozen) for frozen in (1, 0))
            draw_grains(axis, position[glued], fields["radius"][glued], "#909090", None)
            values = 1e3 * np.array([height[id] for id in fields["id"][moving].tolist()])
            discs = draw_grains(axis, position[moving], fields["radius"][moving], values, (0.0, 1e3 * highest))
            since = frame.time - scene.release_step * scene.dt
            title = f"{since:.2f} s after the release" if since > 0.5 * scene.dt else "before the release"
            axis.set_title(f"({chr(97 + number)})  {title}", loc="left", fontsize=9)
            axis.set(xlim=(-1e3 * floor, 1e3 * floor), ylim=(-1.5e3 * scene.diameter, 1.03e3 * highest), aspect="equal")
            axis.set_ylabel("height [mm]")
            axis.grid(False)
        axes[-1, 0].set_xlabel("distance from the axis [mm]")
        drawing.colorbar(discs, ax=axes, label="height at the release [mm]", shrink=0.6)
    return path


def profiles(scene, tables, found, path):
    """The profile of each deposit, in units of the radius of the columns."""
    table = tables.profiles
    last = table["step"] == table["step"][-1]
    with figure(path) as (_, axis):
        for number, one in enumerate(found):
            of = last & (table["column"] == number)
            bins = int((of & (table["part"] == 0)).sum())
            height, points = (table[name][of].reshape(-1, bins) for name in ("height [m]", "points"))
            mean = (height * points).sum(axis=0) / points.sum(axis=0)
            distance = table["distance [m]"][of][:bins]
            colour = COLOURS[number % len(COLOURS)]
            radius = scene.column_radius
            axis.plot(distance / radius, mean / radius, "o-", markersize=3, color=colour, label=f"$a$ = {one.aspect:.2f}")
            axis.plot([one.front / radius], [0.0], "^", color=colour, clip_on=False)
        axis.plot([], [], "^", color="#707070", label="foot")
        axis.set(
            xlabel="distance from the axis / $r_0$", ylabel="height of the surface / $r_0$", ylim=(0.0, None), xlim=(0.0, None)
        )
        axis.legend()
    return path


def scalings(scene, found, path):
    """Run-out and height of the deposits over the aspect ratio, beside the published ones."""
    aspect, radius = np.array([one.aspect for one in found]), scene.column_radius
    fine = np.linspace(0.0, 1.1 * aspect.max(), 400)
    with figure(path, 1, 2, size=(8.0, 3.6)) as (_, axes):
        axes[0].plot(aspect, [one.run_out(radius) for one in found], "o", label="here")
        axes[0].plot(fine, scaling.run_out(fine), color=COLOURS[6], linewidth=1.0, label="Lube et al. 2004")
        axes[0].set(ylabel=r"run-out $(r_\infty - r_0) / r_0$", xlim=(0.0, None), ylim=(0.0, None))
        axes[1].plot(aspect, [one.height / radius for one in found], "o", label="here")
        axes[1].plot(fine, scaling.height(fine), color=COLOURS[6], linewidth=1.0, label="Lube et al. 2004")
        lajeunesse = scaling.saturated_height(fine)
        axes[1].plot(fine, lajeunesse, "--", color=COLOURS[1], linewidth=1.0, label="Lajeunesse et al. 2004")
        axes[1].set(ylabel=r"height of the deposit $h_\infty / r_0$", xlim=(0.0, None), ylim=(0.0, None))
        for axis in axes:
            axis.set_xlabel("aspect ratio $a = h_0 / r_0$")
            axis.legend()
    return path


def history(scene, tables, found, path):
    """Front and energies of each column against time."""
    columns = tables.columns
    with figure(path, 1, 2, size=(8.0, 3.6)) as (_, axes):
        for number, one in enumerate(found):
            of = (columns["column"] == number) & (columns["step"] >= scene.release_step)
            colour = COLOURS[number % len(COLOURS)]
            time = columns["since release [s]"][of] / (one.start_height / scene.gravity) ** 0.5
            label = f"$a$ = {one.aspect:.2f}"
            axes[0].plot(time, columns["front [m]"][of] / scene.column_radius, color=colour, label=label)
            potential, kinetic = columns["potential energy [J]"][of], columns["kinetic energy [J]"][of]
            axes[1].plot(time, potential / potential[0], color=colour)
            axes[1].plot(time, kinetic / potential[0], "--", color=colour)
        axes[1].plot([], [], color="#707070", label="potential")
        axes[1].plot([], [], "--", color="#707070", label="of motion")
        axes[0].set_ylabel("front $r / r_0$")
        axes[1].set_ylabel("energy / potential energy at the release")
        for axis in axes:
            axis.set_xlabel(r"time after the release / $\sqrt{h_0 / g}$")
            axis.legend()
    return path
