"""What a pile has shown, from the tables of its run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.checks import at_rest, overlap, time_step
from barchan.experiments.experiment import Check, Results
from barchan.experiments.repose.slope import Pile, on_slope, pile, straight
from barchan.experiments.repose.surface import Profile
from barchan.experiments.stored import stored
from barchan.units import readable
from barchan.writers import read_table

#: Mean resultant force of a grain at rest, relative to the mean force of a contact.
BALANCED = 0.02

#: How far the forces that carry the grains may be from their weight.
CARRIED = 5e-3

#: Largest overlap, relative to the smaller diameter.
OVERLAP = 0.02


class Shape(NamedTuple):
    """A pile at one time: its ``profile``, the ``pile`` it makes, and the angle of each of its ``parts`` [deg]."""

    time: float
    profile: Profile
    pile: Pile
    parts: np.ndarray

    @property
    def scatter(self):
        """Standard error of the angle from how its parts differ [deg]."""
        return float(self.parts.std(ddof=1) / np.sqrt(len(self.parts)))


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    series, shapes = time_series(directory), shapes_of(scene, directory)
    if series is None:
        return Results([("results", "none: the run is shorter than table_every")], [], [])
    values = [("grains", f"{scene.grains:,}; time step {readable(scene.dt, 's')}"), ("lift", _lift(scene))]
    over = series["step"][-1] >= scene.last_step
    if over:
        values += _angle(scene, shapes[-1])
        values.append(("coordination", f"{series['coordination'][-1]:.2f} contacts a grain at the end"))
    else:
        values.append(("angle", "none yet: the pile is not finished"))
    return Results(values, [], _checks(scene, series, over, record.sittings(directory / "record.json")))


def time_series(directory):
    """The table ``time.csv``, or None if the run was too short to have one."""
    return stored(directory, ("time",))[0]


def shapes_of(scene, directory):
    """The ``Shape`` of the pile in each frame, from the table ``profiles.csv``."""
    path = directory / "tables" / "profiles.csv"
    table = read_table(path) if path.exists() else {"step": np.zeros(0)}
    at = [table["step"] == step for step in np.unique(table["step"])]
    return [_shape(scene, {name: column[rows] for name, column in table.items()}) for rows in at]


def part_name(scene):
    """What the parts of a profile are."""
    return "sectors" if scene.method == "cylinder" else "strips"


def _shape(scene, rows):
    bins = int((rows["part"] == 0).sum())
    height, points = (rows[name].reshape(-1, bins) for name in ("height [m]", "points"))
    profile = Profile(rows["distance [m]"][:bins], height, points)
    whole = pile(profile.distance, profile.mean, scene.diameter)
    lines = [straight(*on_slope(profile.distance, part, whole.run_out)) for part in height]
    since = float(rows["time [s]"][0]) - scene.lift_step * scene.dt
    return Shape(since, profile, whole, np.array([line.angle for line in lines]))


def _lift(scene):
    took = (scene.lifted_step - scene.lift_step) * scene.dt
    return f"the {scene.method} at {readable(scene.lift_speed, 'm/s')} for {took:.2f} s, by {_mm(took * scene.lift_speed)}"


def _angle(scene, shape):
    line = shape.pile.line
    yield (
        "angle of repose",
        f"{line.angle:.2f} deg by a straight line from 20 to 80 % of the run-out; standard errors {line.angle_error:.2f} deg "
        f"of the line, {shape.scatter:.2f} deg from {len(shape.parts)} {part_name(scene)}",
    )
    yield "from height and run-out", f"{shape.pile.plain_angle:.2f} deg"
    yield "pile", f"{_mm(shape.pile.height)} high, run-out {_mm(shape.pile.run_out)}"


def _mm(metres):
    return f"{1e3 * metres:.1f} mm"


def _checks(scene, series, over, sittings):
    checks = []
    before = np.flatnonzero(series["since lift [s]"] <= 0.5 * scene.dt)
    if len(before) and series["since lift [s]"][-1] >= -0.5 * scene.dt:  # a run that was stopped earlier is not at rest yet
        checks.append(_rest_check(scene, series, int(before[-1]), "at rest before the lift"))
    if over:
        checks.append(_rest_check(scene, series, -1, "at rest at the end"))
        unbalanced = float(series["unbalanced force [1]"][-1])
        checks.append(
            Check("balanced at the end", f"{unbalanced:.1e} of a contact force", f"{BALANCED:g}", unbalanced <= BALANCED)
        )
        checks.append(_weight_check(series))
        touching = int(series["lifted contacts"][-1])
        checks.append(Check(f"{scene.method} is clear of grains", f"{touching} touch it", "0", touching == 0))
    checks += time_step(scene, sittings)
    checks.append(overlap(float(series["largest overlap [1]"].max()), OVERLAP))
    lost = scene.grains - int(series["grains"][-1]) - int(series["left over the edge"][-1])
    left = int(series["left over the edge"][-1])
    checks.append(Check("lost grains", f"{lost}; {left} rolled over the edge of the floor", "0", lost == 0))
    return checks


def _rest_check(scene, series, row, name):
    return at_rest(scene, series["kinetic energy [J]"][row], series["grains"][row], name)


def _weight_check(series):
    weight = float(series["weight [N]"][-1])
    floor, others = (float(series[f"{name} force [N]"][-1]) for name in ("floor", "other walls'"))
    miss = abs(floor + others + float(series["lifted force [N]"][-1]) - weight) / weight if weight else 0.0
    shown = f"floor {floor:.4g} N" + (f", walls {others:.4g} N" if others else "")
    return Check("weight is carried", f"{shown} of {weight:.4g} N", f"to {100 * CARRIED:g} %", miss <= CARRIED)
