"""What silos have shown, from the tables of their run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.checks import at_rest, overlap, time_step
from barchan.experiments.experiment import Check, Results
from barchan.experiments.silo import beverloo, janssen
from barchan.experiments.stored import rows_at, stored
from barchan.units import readable

#: A flow is developed after so many times sqrt(silo diameter / g), and is taken until this share of the grains has left.
DEVELOPED, MOST = 2.0, 0.5

#: What is allowed: R^2, C and k of Beverloo's law (C and k as in the literature), silo over outlet.
R_SQUARED, C, K, WIDE = 0.99, (0.55, 0.65), (1.0, 2.0), 2.0

#: Root mean square of the wall's pressure against Janssen's, relative to its mean.
MISS = 0.15

#: How far the forces that carry the grains may be from their weight.
CARRIED = 5e-3

#: Largest overlap, relative to the smaller diameter.
OVERLAP = 0.05


class Tables(NamedTuple):
    """The tables of a run: ``time``, ``silos``, ``walls``, ``left``; None where there is none yet."""

    time: dict | None
    silos: dict | None
    walls: dict | None
    left: dict | None

    @classmethod
    def of(cls, directory):
        """Those of a directory.

        Raises:
            ResultError: a table is damaged.
        """
        return cls(*stored(directory, cls._fields))


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    tables = Tables.of(directory)
    if tables.time is None:
        return Results([("results", "none: the run is shorter than table_every")], [], [])
    values = [("silos", _silos(scene)), ("time step", readable(scene.dt, "s"))]
    checks = []
    opened = rows_at(tables.silos, scene.open_step)
    if opened is not None:
        wall, fill = wall_at(scene, tables, scene.open_step), filled(scene, opened)
        values += _fill(scene, opened, fill)
        checks += _rest_checks(scene, tables.silos, opened)
        if wall is not None:
            values.append(("wall before the opening", _wall(wall)))
            checks.append(_janssen_check(wall))
    flows = flows_of(scene, tables) if opened is not None else {}
    values += [_flow(scene, silo, flow) for silo, flow in flows.items()]
    law = law_of(scene, tables, flows)
    if law is not None:
        values.append(
            (
                "Beverloo's law",
                f"C = {law.c:.3f} +- {law.c_error:.3f}, k = {law.k:.2f} +- {law.k_error:.2f}, R^2 = {law.r_squared:.5f}",
            )
        )
        values.append(("exponent", f"{law.exponent:.2f} of D0 - {beverloo.USUAL_K:g} d"))
        checks += _beverloo_checks(scene, law)
    if tables.left is not None:
        values.append(("residence time", _residence(scene, tables.left)))
    checks += time_step(scene, record.sittings(directory / "record.json"))
    checks.append(overlap(float(tables.time["largest overlap [1]"].max()), OVERLAP))
    checks.append(_lost_check(scene, tables))
    return Results(values, [], checks)


def filled(scene, opened):
    """Mean over the silos before the opening: height [m] and bulk density [kg/m^3] of the grains.

    A filling of one density reaches twice as high as its middle.
    """
    height = 2.0 * float((opened["mean height [m]"] * opened["mass [kg]"]).sum() / opened["mass [kg]"].sum())
    return height, float(opened["mass [kg]"].mean()) / (scene.area * height)


def wall_at(scene, tables, step):
    """Stresses at the ``Wall``, the mean of all silos, at the step of a frame; None if there is none, or nobody touches it."""
    rows, silos = rows_at(tables.walls, step), rows_at(tables.silos, step)
    if rows is None or silos is None or not rows["pressing [N]"].any() or filled(scene, silos)[0] < rows["height [m]"][0]:
        return None
    names = ("height [m]", "mass [kg]", "pressing [N]", "friction [N]")
    means = (rows[name].reshape(scene.outlets, -1).mean(axis=0) for name in names)
    return janssen.stresses(*means, filled(scene, silos)[0], scene)


def flows_of(scene, tables):
    """The steady ``Flow`` of each silo that has one, by the silo's number."""
    opened, left = rows_at(tables.silos, scene.open_step), tables.left
    found = {}
    for silo in range(scene.outlets) if left is not None else ():
        of = left["silo"] == silo
        begin = DEVELOPED * (scene.silo_diameter / scene.gravity) ** 0.5
        time = (left["step"][of] - scene.open_step) * scene.dt
        flow = beverloo.steady(time, left["mass [kg]"][of], opened["mass [kg]"][silo], begin, MOST)
        found |= {silo: flow} if flow is not None else {}
    return found


def law_of(scene, tables, flows):
    """``Beverloo`` through the flows, or None of fewer than three."""
    if len(flows) < 3:
        return None
    _, density = filled(scene, rows_at(tables.silos, scene.open_step))
    rates = np.array([flow.rate for flow in flows.values()])
    return beverloo.fit(scene.outlet_diameters[list(flows)], rates, density, scene.gravity, scene.diameter)


def _silos(scene):
    smallest, largest = (f"{d / scene.diameter:.2f}" for d in (scene.outlet_min, scene.outlet_max))
    wide = readable(scene.silo_diameter, "m")
    return f"{scene.outlets} of {scene.grains:,} grains, {wide} wide; outlets {smallest} to {largest} d"


def _fill(scene, opened, fill):
    height, density = fill
    yield "filled to", f"{1e3 * height:.1f} mm, {height / scene.silo_diameter:.2f} silo diameters"
    yield "bulk density", f"{density:.1f} kg/m^3, solid fraction {density / scene.density:.3f}"
    share = float(opened["wall force [N]"].sum() / (scene.gravity * opened["mass [kg]"].sum()))
    yield "wall carries", f"{100.0 * share:.1f} % of the weight before the opening"


def _wall(wall):
    return f"K = {wall.k:.2f}, friction mobilised {wall.mobilised:.3f}, pressure at the floor {wall.janssen[0]:.0f} Pa by Janssen"


def _flow(scene, silo, flow):
    outlet = scene.outlet_diameters[silo]
    return (
        f"mass flow, outlet {1e3 * outlet:.1f} mm",
        f"{flow.rate:.4f} +- {flow.error:.4f} kg/s, of {flow.grains:,} grains from {flow.begin:.2f} to {flow.end:.2f} s",
    )


def _residence(scene, left):
    """Time in the silo since the opening: of grains from the axis and from the wall, at half the height that has left."""
    time = (left["step"] - scene.open_step) * scene.dt
    widest = left["silo"] == scene.outlets - 1
    time, distance = time[widest], left["start distance [m]"][widest]
    inner = distance < 0.25 * scene.silo_diameter
    parts = [f"{np.median(part):.2f} s {where}" for part, where in ((time[inner], "inner"), (time[~inner], "outer")) if len(part)]
    return f"median of those that left the largest outlet: {', '.join(parts)} half of the radius"


def _rest_checks(scene, silos, opened):
    earlier = silos["step"][silos["step"] <= scene.slide_step]
    if len(earlier):
        still = rows_at(silos, earlier[-1])
        yield at_rest(scene, still["kinetic energy [J]"].sum(), still["grains"].sum(), "at rest before the walls slide")
    weight = scene.gravity * float(opened["mass [kg]"].sum())
    floor, wall = (float(opened[f"{name} force [N]"].sum()) for name in ("floor", "wall"))
    shown = f"floors {floor:.4g} N, walls {wall:.4g} N of {weight:.4g} N"
    yield Check("weight is carried", shown, f"to {100 * CARRIED:g} %", abs(floor + wall - weight) <= CARRIED * weight)


def _janssen_check(wall):
    return Check("Janssen's law", f"pressures {100 * wall.miss:.1f} % off", f"{100 * MISS:g} %", wall.miss <= MISS)


def _beverloo_checks(scene, law):
    yield Check("Beverloo's law", f"R^2 = {law.r_squared:.5f}", f"above {R_SQUARED:g}", law.r_squared > R_SQUARED)
    for name, value, (least, most) in (("C", law.c, C), ("k", law.k, K)):
        yield Check(f"Beverloo's {name}", f"{value:.3f}", f"{least:g} to {most:g}", least <= value <= most)
    ratio = scene.silo_diameter / scene.outlet_max
    yield Check("silo is wide", f"{ratio:.2f} of its outlet", f"{WIDE:g} at least", ratio >= WIDE)


def _lost_check(scene, tables):
    last, below = int(tables.time["grains"][-1]), int(tables.time["left below"][-1])
    lost = scene.grains * scene.outlets - last - below
    return Check("lost grains", f"{lost}; {below:,} were taken out below the silos", "0", lost == 0)
