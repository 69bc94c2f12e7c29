"""What columns have shown, from the tables of their run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.checks import at_rest, overlap, time_step
from barchan.experiments.column import scaling
from barchan.experiments.experiment import Check, Results
from barchan.experiments.stored import rows_at, stored
from barchan.units import readable

#: How far run-outs may be from the published ones, as root mean square of the relative errors.
MISS = 0.2

#: Largest overlap, relative to the smaller diameter.
OVERLAP = 0.05


class Tables(NamedTuple):
    """The tables of a run: ``time``, ``columns``, ``profiles``; None where there is none yet."""

    time: dict | None
    columns: dict | None
    profiles: dict | None

    @classmethod
    def of(cls, directory):
        """Those of a directory.

        Raises:
            ResultError: a table is damaged.
        """
        return cls(*stored(directory, cls._fields))


class Collapse(NamedTuple):
    """What became of a column: its height at the release and aspect ratio, its deposit's ``front`` (radius) and ``height`` [m],
    and the ``time`` after which it had come as far as 95 % of its way [s]."""

    start_height: float
    aspect: float
    front: float
    height: float
    time: float

    def run_out(self, radius):
        """(r_inf - r_0) / r_0."""
        return (self.front - radius) / radius


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    tables = Tables.of(directory)
    if tables.time is None:
        return Results([("results", "none: the run is shorter than table_every")], [], [])
    standing, last = rows_at(tables.columns, scene.release_step), rows_at(tables.columns, tables.columns["step"][-1])
    values = [("columns", _columns(scene)), ("time step", readable(scene.dt, "s"))]
    checks = []
    if standing is not None:
        checks.append(
            at_rest(scene, standing["kinetic energy [J]"].sum(), standing["grains"].sum(), "at rest before the release")
        )
    over = tables.columns["step"][-1] >= scene.last_step
    if over:
        found = collapses(scene, tables)
        values += [(f"a = {one.aspect:.2f}", _told(scene, one)) for one in found]
        values += [*_prefactors(scene, found), *_energies(standing, last)]
        checks += [
            at_rest(scene, last["kinetic energy [J]"].sum(), last["grains"].sum(), "at rest at the end"),
            _miss(scene, found),
        ]
    else:
        values.append(("run-out", "none yet: the collapse is not finished"))
    checks += time_step(scene, record.sittings(directory / "record.json"))
    checks.append(overlap(float(tables.time["largest overlap [1]"].max()), OVERLAP))
    grains, left = int(tables.time["grains"][-1]), int(tables.time["left over the edge"][-1])
    lost = sum(scene.grains) - grains - left
    checks.append(Check("lost grains", f"{lost}; {left} rolled over the edge of the floor", "0", lost == 0))
    return Results(values, [], checks)


def collapses(scene, tables):
    """The ``Collapse`` of each column, of a run that is over.

    A standing column of one density reaches twice as high as its middle, both above the tops of the glued grains.
    """
    columns = tables.columns
    return [
        _collapse(scene, {name: column[columns["column"] == k] for name, column in columns.items()}) for k in range(scene.columns)
    ]


def _collapse(scene, rows):
    released = rows["step"] >= scene.release_step
    since, front = rows["since release [s]"][released], rows["front [m]"][released]
    start = 2.0 * (float(rows["mean height [m]"][released][0]) - 0.5 * scene.diameter)
    way = scene.column_radius + 0.95 * (front[-1] - scene.column_radius)
    height = float(rows["height [m]"][-1]) - 0.5 * scene.diameter
    return Collapse(start, start / scene.column_radius, float(front[-1]), height, float(since[np.argmax(front >= way)]))


def _columns(scene):
    fewest, most = min(scene.grains), max(scene.grains)
    return f"{scene.columns} of {fewest:,} to {most:,} grains, radius {scene.column_radius / scene.diameter:.1f} d"


def _told(scene, one):
    radius, aspect = scene.column_radius, one.aspect
    lasted = one.time / (one.start_height / scene.gravity) ** 0.5
    said, high, saturated = (float(law(aspect)) for law in (scaling.run_out, scaling.height, scaling.saturated_height))
    return (
        f"run-out {one.run_out(radius):.2f} r_0 (Lube {said:.2f}), height {one.height / radius:.2f} r_0 (Lube {high:.2f}, "
        f"Lajeunesse {saturated:.2f}), over after {lasted:.1f} sqrt(h_0/g)"
    )


def _prefactors(scene, found):
    """What the published laws would have as a factor here, by least squares over the columns that they hold for."""
    for law, where, power, theirs in (("a", "below", 1.0, 1.24), ("sqrt(a)", "above", 0.5, 1.6)):
        of = [one for one in found if (one.aspect < scaling.TALL) == (where == "below")]
        if of:
            form = np.array([one.aspect for one in of]) ** power
            factor = float((form * [one.run_out(scene.column_radius) for one in of]).sum() / (form**2).sum())
            yield f"run-out, a {where} {scaling.TALL:g}", f"{factor:.2f} {law} r_0 (Lube {theirs:g} {law})"


def _energies(standing, last):
    if standing is not None:
        fallen = 1.0 - last["potential energy [J]"] / standing["potential energy [J]"]
        yield "potential energy lost", ", ".join(f"{100 * part:.0f} %" for part in fallen)


def _miss(scene, found):
    misses = [one.run_out(scene.column_radius) / float(scaling.run_out(one.aspect)) - 1.0 for one in found]
    miss = float(np.sqrt(np.mean(np.square(misses))))
    return Check("run-out as published", f"{100 * miss:.1f} % off (root mean square)", f"{100 * MISS:g} %", miss <= MISS)
