"""What a turning drum has shown, from the tables of its run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.checks import overlap, time_step
from barchan.experiments.drum.observe import line_of
from barchan.experiments.drum.parameters import PAPER, PAPER_ANGLE
from barchan.experiments.experiment import Check, Results
from barchan.experiments.repose.surface import PARTS
from barchan.experiments.stored import stored
from barchan.measure.sums import crossing
from barchan.units import readable

#: What of ``PAPER`` may differ for the angle to be told beside the measured one.
SIZE = {"grains", "length"}

#: How far the mean torque on the drum may be from that of the grains' weight.
TORQUE = 0.03

#: What may be left over of the energy of the last steps, relative to the drum's work.
LEFT_OVER = 0.02

#: How much more may flow down than is carried up, relative to both together.
FLUX = 0.05

#: Largest overlap, relative to the smaller diameter.
OVERLAP = 0.05


class Tables(NamedTuple):
    """The tables of a run: ``time``, ``profiles``, ``layer``, ``energy``; None where there is none yet."""

    time: dict | None
    profiles: dict | None
    layer: dict | None
    energy: dict | None

    @classmethod
    def of(cls, directory):
        """Those of a directory.

        Raises:
            ResultError: a table is damaged.
        """
        return cls(*stored(directory, cls._fields))


class Surface(NamedTuple):
    """The surface over ``x`` (bins,) [m]: ``height`` (frames, parts, bins) [m] and lines of sight ``points`` there, at ``steps``
    (frames,)."""

    steps: np.ndarray
    x: np.ndarray
    height: np.ndarray
    points: np.ndarray

    def mean(self, frames, parts):
        """Mean height over some frames and parts, (bins,) [m]."""
        height, points = (values[frames][:, parts] for values in (self.height, self.points))
        return (height * points).sum(axis=(0, 1)) / points.sum(axis=(0, 1))

    def line(self, scene, frames, parts):
        """The ``Line`` through its middle, of the mean over some frames and parts."""
        return line_of(scene, self.x + scene.drum_radius, self.mean(frames, parts))


class Layer(NamedTuple):
    """The flow in mid-chord: ``velocity`` down the slope at each ``depth`` where there are grains [m/s, m], the ``thickness`` of
    the layer that flows down [m], and ``balance``: the flow down and up together, relative to both one by one."""

    depth: np.ndarray
    velocity: np.ndarray
    thickness: float
    balance: float


#: The strips at both ends of the drum, and those in its middle half.
ENDS, INNER = [0, PARTS - 1], list(range(PARTS // 4, PARTS - PARTS // 4))


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    tables = Tables.of(directory)
    if tables.time is None:
        return Results([("results", "none: the run is shorter than table_every")], [], [])
    values = [("drum", _drum(scene)), ("turns", _turns(scene))]
    checks = []
    if tables.time["step"][-1] >= scene.last_step > scene.steady_step and tables.energy is not None:
        surface, layer = surface_of(tables), layer_of(scene, tables)
        values += [*_angles(scene, surface), *_flow(scene, layer), *_mixing(scene, tables.time), *_powers(scene, tables)]
        checks += _balances(scene, tables, layer)
    else:
        values.append(("angle", "none yet: the drum has not turned to the end"))
    checks += time_step(scene, record.sittings(directory / "record.json"))
    checks.append(overlap(float(tables.time["largest overlap [1]"].max()), OVERLAP))
    lost = scene.grains - int(tables.time["grains"][-1])
    checks.append(Check("lost grains", str(lost), "0", lost == 0))
    return Results(values, differs(scene), checks)


def differs(scene):
    """What differs from the drum whose angle was measured: (parameter, here, there)."""
    return [(name, str(getattr(scene, name)), str(paper)) for name, paper in PAPER.items() if getattr(scene, name) != paper]


def is_measured(scene):
    """Whether the angle of such a drum, of any length, was measured."""
    return {name for name, _, _ in differs(scene)} <= SIZE


def surface_of(tables):
    """The ``Surface`` in all frames."""
    table = tables.profiles
    steps = np.unique(table["step"])
    height, points = (table[name].reshape(len(steps), PARTS, -1) for name in ("height [m]", "points"))
    return Surface(steps, table["x [m]"][: height.shape[2]], height, points)


def steady(scene, steps):
    """Which of some steps belong to the steady flow, as a mask."""
    return (steps >= scene.steady_step) & (steps <= scene.last_step)


def layer_of(scene, tables):
    """The ``Layer``, mean over the steady flow."""
    table = tables.layer
    steps = np.unique(table["step"])
    mass, momentum, depth = (
        table[name].reshape(len(steps), -1)[steady(scene, steps)].sum(axis=0)
        for name in ("mass [kg]", "momentum [kg m/s]", "depth [m]")
    )
    there = mass > 0.0
    depth, velocity = depth[there] / steady(scene, steps).sum(), momentum[there] / mass[there]
    up = np.flatnonzero(velocity < 0.0)
    thickness = float("nan")
    if len(up) and up[0]:
        last = up[0] - 1
        part = crossing(velocity[last], velocity[last + 1], 0.0)
        thickness = float(depth[last] + part * (depth[last + 1] - depth[last]))
    return Layer(depth, velocity, thickness, float(momentum.sum() / np.abs(momentum).sum()))


def angles_in_time(scene, surface, parts):
    """Angle of the surface of some strips in each frame, (frames,) [deg]."""
    return np.array([surface.line(scene, [frame], parts).angle for frame in range(len(surface.steps))])


def _drum(scene):
    size = f"{scene.grains:,} grains, {100 * scene.filling:.0f} % of the drum"
    return f"{size}; radius {scene.drum_radius / scene.diameter:.1f} d, length {scene.length / scene.diameter:.1f} d"


def _turns(scene):
    turned = (scene.last_step - scene.turn_step) * scene.dt * scene.rotation / (2.0 * np.pi)
    return f"{turned:.2f} at {scene.rotation:g} rad/s; Froude number {scene.froude:.3g}; time step {readable(scene.dt, 's')}"


def _angles(scene, surface):
    late = steady(scene, surface.steps)
    for name, parts in (("at its ends", ENDS), ("in the middle half of its length", INNER)):
        spread = angles_in_time(scene, surface, parts)[late].std()
        yield f"angle {name}", f"{surface.line(scene, late, parts).angle:.2f} deg, in time +- {spread:.2f} deg"
    if is_measured(scene):
        yield "angle that was measured", f"{PAPER_ANGLE:g} deg at the ends (of the drum in an example of Lethe)"


def _flow(scene, layer):
    wall = scene.rotation * scene.drum_radius
    yield "flowing layer", f"{1e3 * layer.thickness:.1f} mm, {layer.thickness / scene.diameter:.1f} d"
    down, up = layer.velocity[0], -layer.velocity[-1]
    yield "speeds in mid-chord", f"{down:.3f} m/s down at the surface, {up:.3f} m/s up at the wall, which has {wall:.3f} m/s"


def _mixing(scene, series):
    turned, index = series["since start [s]"] * scene.rotation / (2.0 * np.pi), series["mixing index [1]"]
    halves = [f"{np.interp(turns, turned, index):.2f} after {turns:g}" for turns in (0.5, 1.0) if turns < turned[-1]]
    yield "mixing index", ", ".join([*halves, f"{index[-1]:.2f} after {turned[-1]:.2f} turns"])


def torques(scene, series):
    """Mean torques in the steady flow [N m]: of the drum on the grains, and against the grains' weight."""
    late = steady(scene, series["step"])
    return tuple(-float(series[name][late].mean()) for name in ("torque [N m]", "torque of the weight [N m]"))


def _powers(scene, tables):
    torque, _ = torques(scene, tables.time)
    yield "torque", f"{1e3 * torque:.3f} mN m; power {1e3 * torque * scene.rotation:.3f} mW"
    row = {name: float(column[-1]) for name, column in tables.energy.items()}
    lasted = row["accounted for [s]"]
    friction, dashpots = (1e3 * row[f"taken by {name} [J]"] / lasted for name in ("friction", "dashpots"))
    yield f"in the last {readable(lasted, 's')}", f"friction takes {friction:.3f} mW, dashpots {dashpots:.3f} mW"


def _balances(scene, tables, layer):
    torque, weight = torques(scene, tables.time)
    shown = f"{1e3 * torque:.3f} mN m against {1e3 * weight:.3f} of the weight"
    yield Check("torque carries the slope", shown, f"to {100 * TORQUE:g} %", abs(torque - weight) <= TORQUE * weight)
    row = {name: float(column[-1]) for name, column in tables.energy.items()}
    miss = abs(row["left over [J]"]) / row["work of the drum [J]"]
    yield Check("energy", f"{100 * miss:.2g} % of the drum's work left over", f"{100 * LEFT_OVER:g} %", miss <= LEFT_OVER)
    shown = f"{100 * layer.balance:+.1f} % of the flow down and up"
    yield Check("as much flows down as up", shown, f"{100 * FLUX:g} %", abs(layer.balance) <= FLUX)
