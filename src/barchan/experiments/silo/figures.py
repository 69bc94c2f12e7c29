"""Pictures of silos, from the tables and frames of their run."""

import numpy as np

from barchan.experiments.silo.results import Tables, filled, flows_of, law_of, wall_at
from barchan.experiments.stored import rows_at
from barchan.view.grains import draw_grains
from barchan.view.style import COLOUR_MAP, COLOURS, figure
from barchan.writers import frames, read_grain_frame

#: Thickness of the slice that is shown, in mean diameters.
SLICE = 3.0


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, tables = directory / "figures", Tables.of(directory)
    there = frames(directory / "frames", "grains")
    if rows_at(tables.silos, scene.open_step) is None or not there:
        return
    yield slices(scene, there, out / "silos.png")
    wall = wall_at(scene, tables, scene.open_step)
    if wall is not None:
        yield pressure(scene, tables, wall, out / "pressure.png")
    if tables.left is not None:
        yield discharge(scene, tables, out / "discharge.png")
        yield residence(scene, tables.left, out / "residence.png")


def slices(scene, there, path):
    """A slice through the middle of all silos at the opening, in the middle and at the end, by the height at the opening."""
    shown = sorted({frame.step: frame for frame in (there[0], there[len(there) // 2], there[-1])}.items())
    pictures = [read_grain_frame(frame.path) for _, frame in shown]
    first = pictures[0].fields["position"]
    start = dict(zip(pictures[0].fields["id"].tolist(), first[:, 2].tolist()))
    highest = float(first[:, 2].max())
    half = 0.5 * scene.silo_diameter
    with figure(path, 1, len(pictures), size=(9.5, 2.5), sharey=True, squeeze=False) as (drawing, axes):
        for number, (axis, frame) in enumerate(zip(axes[0], pictures)):
            fields = frame.fields
            near = np.abs(fields["position"][:, 1]) <= 0.5 * SLICE * scene.diameter
            values = 1e3 * np.array([start[id] for id in fields["id"][near].tolist()])
            discs = draw_grains(axis, fields["position"][near], fields["radius"][near], values, (0.0, 1e3 * highest))
            for x, outlet in zip(scene.axes, scene.outlet_diameters):
                for side in (-1.0, 1.0):
                    floor = np.array([0.5 * outlet, half, half])
                    axis.plot(1e3 * (x + side * floor), [0.0, 0.0, 1.05e3 * highest], color=COLOURS[6], linewidth=0.8)
            since = frame.time - scene.open_step * scene.dt
            title = f"{since:.2f} s after the opening" if since > 0.5 * scene.dt else "before the opening"
            axis.set_title(f"({chr(97 + number)})  {title}", loc="left", fontsize=9)
            axis.set(ylim=(-12e3 * scene.radius_max, 1.05e3 * highest), aspect="equal", xlabel="x [mm]")
            axis.grid(False)
        axes[0, 0].set_ylabel("height [mm]")
        drawing.colorbar(discs, ax=axes, label="height at the opening [mm]", shrink=0.8)
    return path


def discharge(scene, tables, path):
    """Mass that has left against time, and the mass flows with Beverloo's law through them."""
    left, flows = tables.left, flows_of(scene, tables)
    law = law_of(scene, tables, flows)
    with figure(path, 1, 2, size=(8.0, 3.6)) as (_, axes):
        for silo, outlet in enumerate(scene.outlet_diameters):
            of, colour = left["silo"] == silo, COLOURS[silo % len(COLOURS)]
            time = (left["step"][of] - scene.open_step) * scene.dt
            axes[0].plot(time, np.cumsum(left["mass [kg]"][of]), color=colour, label=f"outlet {1e3 * outlet:.1f} mm")
            if silo in flows:
                flow = flows[silo]
                axes[1].errorbar(1e3 * outlet, flow.rate, 2.0 * flow.error, fmt="o", color=colour, capsize=3)
        if law is not None:
            _, density = filled(scene, rows_at(tables.silos, scene.open_step))
            outlet = np.linspace(law.k * scene.diameter, 1.05 * scene.outlet_max, 200)
            label = f"$C$ = {law.c:.3f}, $k$ = {law.k:.2f}, $R^2$ = {law.r_squared:.4f}"
            rate = law.rate(outlet, density, scene.gravity, scene.diameter)
            axes[1].plot(1e3 * outlet, rate, color=COLOURS[6], zorder=1, label=label)
            axes[1].set_title(r"$W = C\,\rho_b \sqrt{g}\,(D_0 - k d)^{5/2}$", fontsize=9)
            axes[1].legend()
        axes[0].set(xlabel="time after the opening [s]", ylabel="mass that has left [kg]")
        axes[1].set(xlabel="diameter of the outlet [mm]", ylabel="mass flow [kg/s]", ylim=(0.0, None))
        axes[0].legend()
    return path


def pressure(scene, tables, wall, path):
    """Stresses at the wall before the opening, beside Janssen's law, and the pressure while grains flow."""
    with figure(path, 1, 2, size=(8.0, 3.8), sharey=True) as (_, axes):
        depth = 1e3 * wall.depth
        axes[0].plot(wall.pressure, depth, "o", markersize=4, label="pressure on the wall")
        axes[0].plot(wall.janssen, depth, color=COLOURS[0], label=f"Janssen, $K$ = {wall.k:.2f}, $\\mu$ = {wall.mobilised:.2f}")
        axes[0].plot(wall.friction, depth, "s", markersize=4, color=COLOURS[1], label="friction at the wall")
        axes[0].plot(wall.vertical, depth, "^", markersize=4, color=COLOURS[2], label="vertical pressure in the sand")
        axes[0].set_title("(a)  before the opening", loc="left", fontsize=9)
        axes[0].set_ylabel("depth below the surface then [mm]")
        axes[1].plot(wall.pressure, depth, "o-", markersize=4, label="before the opening")
        steps = [step for step in np.unique(tables.walls["step"]) if step > scene.open_step]
        for colour, step in zip(COLOURS[1:4], steps[:: max(len(steps) // 3, 1)]):
            later = wall_at(scene, tables, step)
            if later is None:
                break
            fallen = 1e3 * (wall.depth[0] - later.depth[0])
            time = (step - scene.open_step) * scene.dt
            axes[1].plot(later.pressure, 1e3 * later.depth + fallen, "o-", markersize=4, color=colour, label=f"{time:.2f} s")
        axes[1].set_title("(b)  mean of all silos while grains flow", loc="left", fontsize=9)
        axes[0].invert_yaxis()
        for axis in axes:
            axis.set(xlabel="stress [Pa]", xlim=(0.0, None))
            axis.legend()
    return path


def residence(scene, left, path):
    """Time after which grains left the largest outlet, by where they were at the opening; each a point."""
    widest = left["silo"] == scene.outlets - 1
    time = (left["step"][widest] - scene.open_step) * scene.dt
    places = (1e3 * left[f"start {name} [m]"][widest] for name in ("distance", "height"))
    with figure(path, size=(4.2, 4.4)) as (drawing, axis):
        points = axis.scatter(*places, c=time, s=6, cmap=COLOUR_MAP, linewidths=0.0)
        axis.set(xlabel="distance from the axis at the opening [mm]", ylabel="height at the opening [mm]", aspect="equal")
        axis.set(xlim=(0.0, 0.5e3 * scene.silo_diameter), ylim=(0.0, None))
        axis.plot([0.5e3 * scene.outlet_max] * 2, [0.0, 3e3 * scene.diameter], color=COLOURS[1], label="edge of the outlet")
        axis.legend(loc="upper right")
        drawing.colorbar(points, ax=axis, label="left after [s]")
    return path
