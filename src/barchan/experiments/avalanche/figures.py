"""Pictures of an avalanche, from the tables and frames of its run."""

import numpy as np

from barchan.experiments.avalanche.observe import STATIONS, stations
from barchan.experiments.avalanche.parameters import Outline
from barchan.experiments.avalanche.results import arrival, front_speed, time_series
from barchan.experiments.avalanche.setup import FLOWING
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure
from barchan.writers import frames, read_grain_frame, read_table

#: Times after the release of the six snapshots, as in the paper's Figure 3 [s].
SNAPSHOTS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)

#: Times after the release of the profiles [s].
PROFILES = (0.2, 0.4, 0.6)


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out = directory / "figures"
    series = time_series(directory)
    if series is None or not (series["since release [s]"] > 0.0).any():
        return
    flow = {name: column[series["since release [s]"] > 0.0] for name, column in series.items()}
    yield front(scene, flow, out / "front.png")
    yield layers(scene, flow, out / "moving_layer.png")
    yield energies(flow, out / "energy.png")
    if flow["jet volume [m^3]"].any():
        yield jet(flow, out / "jet.png")
    path = directory / "tables" / "profiles.csv"
    profiles = read_table(path) if path.exists() else {"step": ()}
    if len(profiles["step"]):
        yield profile_figure(scene, profiles, out / "profiles.png")
    shown = _snapshots_there(scene, directory)
    if shown:
        yield snapshots(scene, shown, out / "snapshots.png")


def _snapshots_there(scene, directory):
    """(time after the release, path) of the frames that were wanted and exist; a short flow is shown at six times of its own."""
    there = [
        (frame.time - scene.release_step * scene.simulated.dt, frame.path) for frame in frames(directory / "frames", "grains")
    ]
    there = [(since, path) for since, path in there if since > 0.0]
    if not there:
        return []
    last = there[-1][0]
    wanted = SNAPSHOTS if last >= 0.5 * SNAPSHOTS[-1] else np.linspace(last / 6.0, last, 6)
    nearest = {
        min(range(len(there)), key=lambda k: abs(there[k][0] - time)) for time in wanted if time <= last + scene.frame_every
    }
    return [there[k] for k in sorted(nearest)]


def snapshots(scene, shown, path):
    """Individual grains coloured by speed at six times: the paper's Figure 3."""
    outline = Outline.of(scene)
    margin = 2.0 * outline.edge
    pictures = [(since, read_grain_frame(file).fields) for since, file in shown]
    speeds = [np.sqrt((frame["velocity"] ** 2).sum(axis=1)) for _, frame in pictures]
    heights = [frame["position"][frame["part"] == FLOWING, 2] for _, frame in pictures]
    top = 1.05 * max((np.quantile(height, 0.9995) for height in heights if len(height)), default=0.0)
    fastest = max(np.quantile(speed, 0.999) for speed in speeds)
    x_end, z_end = (outline.floor + 2) * outline.edge, max(top, 1.25 * scene.height)
    rows = (len(pictures) + 1) // 2
    height = 0.6 + rows * (0.4 + 4.4 * (z_end + margin) / (x_end + 2.0 * margin))
    with figure(path, rows, 2, size=(10.5, height), sharex=True, sharey=True, squeeze=False) as (drawing, axes):
        for number, (axis, (since, frame), speed) in enumerate(zip(axes.ravel(), pictures, speeds)):
            fixed = frame["part"] != FLOWING
            draw_grains(axis, frame["position"][fixed], frame["radius"][fixed], "#909090", None)
            discs = draw_grains(
                axis, frame["position"][~fixed], frame["radius"][~fixed], speed[~fixed], (0.0, max(fastest, 1e-9))
            )
            axis.set_title(f"({chr(97 + number)})  {since:.2f} s", loc="left", fontsize=9)
            axis.set(xlim=(-1e3 * margin, 1e3 * (x_end + margin)), ylim=(-1e3 * margin, 1e3 * z_end), aspect="equal")
            axis.grid(False)
        for axis in axes.ravel()[len(pictures) :]:
            axis.set_visible(False)
        for axis in axes[-1]:
            axis.set_xlabel("along the floor [mm]")
        for axis in axes[:, 0]:
            axis.set_ylabel("height [mm]")
        _gravity_arrow(axes[0, 0], scene)
        drawing.colorbar(discs, ax=axes, label="speed [m/s]", shrink=0.7)
    return path


def _gravity_arrow(axis, scene):
    """Which way gravity points in the frame of the floor, drawn in the free corner above the lower end."""
    tilt, (low, high), (bottom, top) = np.radians(scene.angle), axis.get_xlim(), axis.get_ylim()
    length, start = 0.45 * (top - bottom), (low + 0.78 * (high - low), bottom + 0.92 * (top - bottom))
    end = (start[0] + length * np.sin(tilt), start[1] - length * np.cos(tilt))
    axis.annotate("", xytext=start, xy=end, arrowprops={"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0})
    axis.text(end[0] + 0.15 * length, end[1], "g", style="italic", va="center")


def front(scene, flow, path):
    """Position and speed of the front against time."""
    time, came = 1e3 * flow["since release [s]"], arrival(scene, flow)
    with figure(path, 2, 1, size=(5.2, 5.2), sharex=True) as (_, (above, below)):
        above.plot(time, 1e3 * flow["front [m]"], label="front of the dense flow")
        above.plot(time, 1e3 * flow["99 % of grains [m]"], "--", label="99 % of the grains")
        above.plot(time, 1e3 * flow["foremost grain [m]"], ":", label="foremost grain")
        above.set_ylabel("from the right wall [mm]")
        on_its_way = time < (1e3 * came if came else np.inf)
        below.plot(time[on_its_way], front_speed(flow)[on_its_way], label="front of the dense flow")
        below.set(xlabel="time after the release [ms]", ylabel="speed [m/s]", ylim=(0.0, None))
        for axis in (above, below):
            if came:
                axis.axvline(1e3 * came, color=COLOURS[6], linewidth=0.8, label="front at the end wall")
            axis.legend()
    return path


def layers(scene, flow, path):
    """Thickness of the moving layer at the stations against time."""
    with figure(path) as (_, axis):
        for name, x, line in zip(STATIONS, stations(scene), ("-", "--", ":")):
            layer = flow[f"moving layer {name} [m]"]
            shown = np.where(layer > 0.0, 1e3 * layer, np.nan)  # there is nothing to show before grains arrive
            axis.plot(1e3 * flow["since release [s]"], shown, line, label=f"{name}, x = {1e3 * x:.0f} mm")
        axis.set(xlabel="time after the release [ms]", ylabel="moving layer [mm]")
        axis.legend()
    return path


def energies(flow, path):
    """Where the released energy goes."""
    time = 1e3 * flow["since release [s]"]
    released = flow["potential energy [J]"][0] - flow["potential energy [J]"]
    with figure(path) as (_, axis):
        axis.plot(time, released, label="potential, released")
        axis.plot(time, flow["kinetic energy [J]"], "--", label="kinetic")
        axis.plot(time, flow["rotational energy [J]"], ":", label="of rotation")
        axis.plot(time, flow["dissipated energy [J]"] - flow["dissipated energy [J]"][0], "-.", label="dissipated")
        axis.set(xlabel="time after the release [ms]", ylabel="energy [J]")
        axis.legend()
    return path


def jet(flow, path):
    """The jet at the end wall."""
    time = 1e3 * flow["since release [s]"]
    with figure(path, 2, 1, size=(5.2, 4.6), sharex=True) as (_, (above, below)):
        above.plot(time, 1e3 * flow["jet height [m]"])
        above.set_ylabel("height at the end wall [mm]")
        below.plot(time, flow["jet speed [m/s]"])
        below.set(xlabel="time after the release [ms]", ylabel="upward speed [m/s]")
    return path


def profile_figure(scene, profiles, path):
    """Velocity and solid fraction over the height at the stations."""
    since = profiles["time [s]"] - scene.release_step * scene.simulated.dt
    there = np.unique(since)
    times = sorted({float(there[np.argmin(np.abs(there - time))]) for time in PROFILES})
    with figure(path, 2, 3, size=(8.0, 6.0), sharey=True, sharex="row") as (_, axes):
        for column, (name, x) in enumerate(zip(STATIONS, stations(scene))):
            for time, line in zip(times, ("-", "--", ":")):
                rows = (since == time) & np.isclose(profiles["station [m]"], x)
                height = 1e3 * profiles["z [m]"][rows]
                solid = profiles["solid fraction [1]"][rows]
                velocity = np.where(solid > 0.0, profiles["velocity [m/s]"][rows], np.nan)  # nothing moves where nothing is
                axes[0, column].plot(velocity, height, line, label=f"{time:.2f} s")
                axes[1, column].plot(solid, height, line, label=f"{time:.2f} s")
            axes[0, column].set(title=f"{name}, x = {1e3 * x:.0f} mm", xlabel="velocity along the floor [m/s]")
            axes[1, column].set(xlabel="solid fraction [1]")
        for row in axes:
            row[0].set_ylabel("height [mm]")
        axes[0, 0].legend()
    return path
