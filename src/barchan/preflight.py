"""Checks before a run starts: bad input never starts one. And the search for the culprit when a run must stop."""

import inspect
import os
from math import hypot, isfinite, sqrt

import numpy as np

from barchan.bonds.bonds import rows_of
from barchan.deformation import Deformation
from barchan.domain import SHEARS
from barchan.errors import LawError, LostGrainError, NotFiniteError, OverlapError, SceneError
from barchan.forces import Damping
from barchan.measure import contact_table
from barchan.walls.control import check_controls
from barchan.words import shown

#: Overlap, relative to the radius, at which the stiffness of a law is taken for the stable time step.
_TYPICAL = 0.05

#: Largest radius and skin [length]: their third power is a number, and so are products of that.
_WIDEST = 1e50

#: Memory of a grain with its contacts, measured on the avalanche of 125,000 grains with 2.4 contacts a grain.
_BYTES_PER_GRAIN = 1700

#: dt <= 0.17 sqrt(m/k): O'Sullivan & Bray 2004 (Engineering Computations 21, 278), spheres in three dimensions.
_SAFE = 0.17


def equal_contact(radius, mass, overlap):
    """Quantities of a contact at rest of two equal grains, by the names of ``laws.law.QUANTITIES``."""
    return {
        "overlap": overlap,
        "distance": 2.0 * radius - overlap,
        "normal": (1.0, 0.0, 0.0),
        "normal_half": (1.0, 0.0, 0.0),
        "normal_velocity": 0.0,
        "tangential_velocity": (0.0, 0.0, 0.0),
        "slip_velocity_half": (0.0, 0.0, 0.0),
        "relative_omega": (0.0, 0.0, 0.0),
        "radius_first": radius,
        "radius_second": radius,
        "radius_eff": 0.5 * radius,
        "mass_eff": 0.5 * mass,
        "dt": 0.0,
    }


def evaluate(law, parameters, values):
    """The plain function of a law on one contact, with numbers that divide by zero as compiled ones do: inf, no exception.

    Args:
        parameters: of the pair of materials, in the order of ``law.parameters``.
        values: quantities and history of the contact by name; what the law does not read is left out, and what is missing is 0.

    Raises:
        LawError: the law fails, or does not return what a law must.
    """
    widths = {name: law.known[name][0] for name in law.quantities} | law.history
    contact = {name: values.get(name, (0.0, 0.0, 0.0) if width == 3 else 0.0) for name, width in widths.items()}
    given = contact | dict(zip(law.parameters, parameters))
    try:
        with np.errstate(all="ignore"):
            result = law(**{name: _as_compiled(value) for name, value in given.items()})
    except Exception as error:  # whatever a user's function stumbles over
        where = ", ".join(f"{name} = {value}" for name, value in contact.items())
        raise LawError(f"law '{law.name}' fails with {type(error).__name__}: {error}, on a contact with {where}") from error
    if not isinstance(result, tuple) or [_width(part) for part in result] != [*law.returns.values()]:
        raise LawError(
            f"law '{law.name}' must return {', '.join(law.returns)}; got {result!r} "
            f"(the first is a number, forces and couples tuples of three, history as wide as declared; a couple: couple=True)"
        )
    return result


def _as_compiled(value):
    return tuple(map(np.float64, value)) if isinstance(value, tuple) else np.float64(value)


def _width(part):
    """1 for a number, 3 for a tuple of three numbers, None for anything else."""
    if isinstance(part, tuple):
        return 3 if [_width(x) for x in part] == [1, 1, 1] else None
    return 1 if isinstance(part, (bool, np.bool_, int, float, np.number)) and not isinstance(part, np.complexfloating) else None


def check_energy(law, table):
    """Refuse a law whose ``energy`` is none, for contacts or bonds without a past of grains of radius 1.

    Raises:
        LawError: it fails, or does not return two finite numbers.
    """
    if law is None or law.energy is None:
        return
    names = inspect.signature(law.energy).parameters
    count = 1 if law.kind == "bond law" else 2
    contact = equal_contact(1.0, 1.0, 2.0 * _TYPICAL) | {n: 0.0 if width == 1 else (0.0,) * 3 for n, width in law.history.items()}
    for parameters in table.T.tolist():
        known = contact | dict(zip(law.parameters, parameters))
        given = {name: known[name] for name in names}
        try:
            with np.errstate(all="ignore"):
                stored = law.energy(**{name: _as_compiled(value) for name, value in given.items()})
        except Exception as error:  # whatever a user's function stumbles over
            raise LawError(
                f"{law.kind} '{law.name}': its energy() fails with {type(error).__name__}: {error}, for {given}"
            ) from error
        parts = stored if count == 2 and isinstance(stored, tuple) else (stored,)
        if not ([_width(part) for part in parts] == [1] * count and all(map(isfinite, parts))):
            wanted = "one finite number" if count == 1 else "two finite numbers, what the normal force stores and what springs do"
            raise LawError(f"{law.kind} '{law.name}': its energy() must return {wanted}; got {shown(stored)} for {given}")


def stiffness(law, parameters, radius, mass, overlap):
    """Normal stiffness of a contact of two equal grains, by finite difference of the law [force/length].

    Raises:
        LawError: the law fails, does not return what it must, or is not finite there.
    """
    step = 1e-4 * overlap
    low, high = (evaluate(law, parameters, equal_contact(radius, mass, overlap + s))[0] for s in (-step, step))
    if not (isfinite(low) and isfinite(high)):
        raise LawError(f"law '{law.name}': its normal force at rest, overlap {overlap:g} [length], dt 0, is {low:g}, not finite")
    return (high - low) / (2.0 * step)


def damping(law, parameters, radius, mass, overlap):
    """Normal damping of a contact of two equal grains, |dF_n/dv_n| about rest by finite difference of the law [mass/time].

    0 where the law has no finite force for grains in motion: that is for ``check_law``, or the run, to find, not for a time step.
    """
    speed = 1e-6 * overlap * sqrt(abs(stiffness(law, parameters, radius, mass, overlap)) / mass)
    contact = equal_contact(radius, mass, overlap)
    try:
        low, high = (evaluate(law, parameters, contact | {"normal_velocity": v})[0] for v in (-speed, speed))
    except LawError:
        return 0.0
    return abs(high - low) / (2.0 * speed) if speed and isfinite(high - low) else 0.0


def stable_time_step(law, table, grains, n_materials, bonds=None):
    """Largest safe time step over all grains of this rank and the pairs of their materials [time]; inf without grains.

    The smaller of 0.17 sqrt(m/k) and m_eff/c, with the stiffness k and the damping c at an overlap of 5 % of the diameter: in a
    longer step than that the dashpot of the half-step velocity would turn the velocity round. Stiffnesses of bonds add to those
    of contacts.
    """
    moving = grains.view("frozen") == 0
    smallest = np.inf
    for material in np.unique(grains.view("material")[moving]):
        chosen = moving & (grains.view("material") == material)
        mass, radius = grains.view("mass")[chosen], grains.view("radius")[chosen]
        for row in {int(np.argmin(mass)), int(np.argmin(mass / radius))}:
            for other in range(n_materials):
                parameters = table[: len(law.parameters), material * n_materials + other]
                contact = (law, parameters, radius[row], mass[row], 2.0 * _TYPICAL * radius[row])
                k, c = stiffness(*contact), damping(*contact)
                if k > 0.0:
                    smallest = min(smallest, _SAFE * sqrt(mass[row] / k))
                if c > 0.0:
                    smallest = min(smallest, 0.5 * mass[row] / c)
    if bonds is None or not len(bonds):
        return smallest
    rates = 1.0 / smallest, 1.0 / _stable_with_bonds(bonds, grains)  # 0 where nothing moves
    return 1.0 / hypot(*rates) if any(rates) else np.inf


def _stable_with_bonds(bonds, grains):
    """Largest safe time step of bonded grains, as of pairs of equal ones: 0.17 sqrt(m/k), with the stiffness k in stretching."""
    smallest = np.inf
    mine = np.isin(bonds.ids, grains.view("id"))
    rows = rows_of(grains.view("id"), bonds.ids[mine])
    kind = np.repeat(bonds.kind, 2).reshape(-1, 2)[mine]
    moving = grains.view("frozen")[rows] == 0
    rows, kind = rows[moving], kind[moving]
    for number in np.unique(kind):
        mass, radius = (grains.view(name)[rows[kind == number]] for name in ("mass", "radius"))
        for row in {int(np.argmin(mass)), int(np.argmin(mass / radius)), int(np.argmin(mass / radius**2))}:
            stretch = 1e-6 * radius[row]
            pair = {"normal": (1.0, 0.0, 0.0), "distance": 2.0 * radius[row], "mass_eff": 0.5 * mass[row], "strength": 1e300}
            pair |= {"radius_first": radius[row], "radius_second": radius[row], "stretch": stretch}
            k = abs(evaluate(bonds.law, bonds.kinds[number].values, pair)[0]) / stretch
            if k > 0.0:
                smallest = min(smallest, _SAFE * sqrt(mass[row] / k))
    return smallest


def check_settings(sim):
    """Refuse settings of the simulation that mean nothing.

    Raises:
        SceneError: naming the setting, its value and what is allowed.
    """
    check_count("threads", sim.threads, least=1)
    for name, dimension, zero_too in (("dt", "time", False), ("skin", "length", True), ("max_overlap", "1", False)):
        value = getattr(sim, name)
        if name == "skin" and value is None:
            continue
        number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
        unlimited = name == "max_overlap" and value == np.inf
        if not (number and (abs(value) <= _WIDEST or unlimited) and (value > 0.0 or (zero_too and value == 0.0))):
            raise SceneError(
                f"{name} = {value!r} [{dimension}] must be a finite number {'>=' if zero_too else '>'} 0, and at most {_WIDEST:g}"
            )
    Damping.check(sim.damping, sim.dt)
    if not isinstance(sim.deformation, Deformation):
        raise SceneError(f"deformation = {shown(sim.deformation)} must be a barchan.Deformation, such as Deformation(x=-0.1)")
    sim.deformation.check(sim.box, sim.walls)
    check_controls(sim.walls)


def check_prepared(what, *ready):
    """Refuse a part of a step for which nothing is ready.

    Raises:
        SceneError: one of ``ready`` is None or False.
    """
    if not all(ready):
        raise SceneError(f"{what}(): the scene is new or was changed; call prepare() first, or run(steps), which does all")


def check_count(what, value, least):
    """Refuse what is no whole number of at least ``least``.

    Raises:
        SceneError: naming it.
    """
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
        raise SceneError(f"{what} = {value!r} must be a whole number >= {least}")


def check_memory(count, comm):
    """Refuse more grains, shared evenly by all ranks, than the memory of this machine can hold.

    Raises:
        SceneError: naming what is needed and what is there.
    """
    count = count * comm.ranks_on_node // comm.size
    there, needed = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"), count * _BYTES_PER_GRAIN
    if needed > there:
        raise SceneError(
            f"{count:,} grains need about {needed / 1e9:,.0f} GB of memory; this machine has {there / 1e9:,.0f} GB. "
            f"Use fewer grains, or more machines"
        )


def fault(sim):
    """The error in this rank's grains that forbids to run, or None."""
    try:
        check_grains(sim)
    except SceneError as error:
        return error
    return None


def check_grains(sim):
    """Refuse grains that cannot be simulated.

    Raises:
        SceneError: naming the grain, the field, its value and what is allowed.
    """
    grains = sim.grains
    for name in ("position", "velocity", "omega", "radius", "mass", "inertia", "force", "torque"):
        values = grains.view(name)
        rows = np.flatnonzero(~np.isfinite(values).reshape(grains.n, -1).all(axis=1)) if grains.n else []
        if len(rows):
            raise SceneError(
                f"grain {grains.view('id')[rows[0]]}: {name} = {values[rows[0]].tolist()} "
                f"[{grains.field(name).dimension}] is not finite ({len(rows)} such grains)"
            )
    for name in ("radius", "mass", "inertia"):
        rows = np.flatnonzero(grains.view(name) <= 0.0)
        if len(rows):
            raise SceneError(
                f"grain {grains.view('id')[rows[0]]}: {name} = {grains.view(name)[rows[0]]:g} "
                f"[{grains.field(name).dimension}] must be > 0 ({len(rows)} such grains)"
            )
    rows = np.flatnonzero(grains.view("radius") > _WIDEST)
    if len(rows):
        raise SceneError(
            f"grain {grains.view('id')[rows[0]]}: radius = {grains.view('radius')[rows[0]]:g} [length] must be at most "
            f"{_WIDEST:g}: volumes would not be finite ({len(rows)} such grains)"
        )
    rows = np.flatnonzero(grains.view("frozen") > 1)
    if len(rows):
        raise SceneError(f"grain {grains.view('id')[rows[0]]}: frozen = {grains.view('frozen')[rows[0]]}; it must be 0 or 1")
    rows = np.flatnonzero(grains.view("material") >= len(sim.materials))
    if len(rows):
        raise SceneError(
            f"grain {grains.view('id')[rows[0]]}: material number {grains.view('material')[rows[0]]} does not "
            f"exist; the scene has {len(sim.materials)} material(s), numbered from 0"
        )
    rows = np.flatnonzero(sim.box.outside(grains.view("position")))
    if len(rows):
        raise SceneError(
            f"grain {grains.view('id')[rows[0]]} at {grains.view('position')[rows[0]].tolist()} lies outside the box "
            f"{sim.box.low.tolist()} to {sim.box.high.tolist()} [length] ({len(rows)} such grains)"
        )
    if sim.box.dimension == 2:
        check_plane(grains)


def check_plane(grains):
    """Refuse grains that would leave the plane z = 0 of a two-dimensional box.

    Raises:
        SceneError: naming the grain, the field, its value and what is allowed.
    """
    for name, across in (("velocity", [2]), ("force", [2]), ("omega", [0, 1]), ("torque", [0, 1])):
        values = grains.view(name)
        rows = np.flatnonzero((values[:, across] != 0.0).any(axis=1))
        if len(rows):
            raise SceneError(
                f"grain {grains.view('id')[rows[0]]}: {name} = {values[rows[0]].tolist()} [{grains.field(name).dimension}] must "
                f"have {'no z component' if across == [2] else 'a z component only'}: the box has two dimensions "
                f"({len(rows)} such grains)"
            )


def out_of_plane(sim):
    """The error for grains that a law turns out of the plane of a two-dimensional box, or None; forces are looked at where they
    move grains."""
    grains = sim.grains
    if sim.box.dimension == 3 or not (grains.view("torque")[:, :2].any() or grains.view("omega")[:, :2].any()):
        return None
    try:
        check_plane(grains)
    except SceneError as error:
        return LostGrainError(f"step {sim.step_number}: {error}. Likely cause: a law or a wall that leads out of it")
    return None


def check_box(sim, cutoff, ratio=1.0):
    """Refuse a period shorter than two cut-offs: a grain would meet the same neighbour twice. As a box is sheared, neighbours are
    sought in one that is ``Upright``, and smaller: most where the images are half a period aside.

    Args:
        ratio: by which the edges of the box will grow, (3,); default: not at all.

    Raises:
        SceneError: naming the axis, its length and the least allowed.
    """
    tilt, sheared = sim.box.tilt.copy(), sim.deformation.sheared
    if sheared is not None:
        tilt[sheared] = 0.5 * sim.box.length[SHEARS[sheared][0]]
    upright = sim.box.leaning(tilt)
    least = 2.0 * cutoff * upright.spread
    for axis in range(3):
        length = (sim.box.length * ratio)[axis]
        if sim.box.periodic[axis] and length < least[axis]:
            raise SceneError(
                f"box: its period along {'xyz'[axis]} is {length:g} [length]; it must be at least two cut-offs, {2.0 * cutoff:g} "
                f"(largest diameter + skin + reach of the law, twice){_times(upright.spread[axis])}. Widen the box or lower the "
                f"skin or the reach"
            )


def _times(spread):
    return f", times {spread:.4g} as it is sheared" if spread != 1.0 else ""


def check_walls(sim, sizes):
    """Refuse walls that these grains cannot be meant for.

    Args:
        sizes: a ``Survey`` of all grains.

    Raises:
        SceneError: naming the wall.
    """
    for number, wall in enumerate(sim.walls):
        if sizes.widest > 0.0:
            wall.check_sizes(sizes.typical, f"wall {number} ({wall.kind})")


def check_time_step(sim, stable):
    """Refuse a time step above the stable one.

    Raises:
        SceneError: naming both.
    """
    if sim.dt > stable:
        raise SceneError(
            f"dt = {sim.dt:g} [time] is above the stable time step {stable:g} (0.17 sqrt(m/k), or m_eff/c, of the "
            f"lightest, stiffest, most damped contact at 5 % overlap{' and of its bonds' if sim.bonds.active else ''}). Use a "
            f"smaller dt, or a softer or less damped material{' or softer bonds' if sim.bonds.active else ''}"
        )


def bad_grain(sim):
    """The error for a grain that is outside the box or not finite, or None if this rank has none."""
    grains = sim.grains
    position = grains.view("position")
    inside = ((position >= sim.box.low) & (position <= sim.box.high)).all(axis=1)
    rows = np.flatnonzero(~inside)
    if not len(rows):
        return None
    row = rows[0]
    where = (
        f"grain {grains.view('id')[row]} at {position[row].tolist()}, velocity {grains.view('velocity')[row].tolist()}, "
        f"step {sim.step_number}, t = {sim.time:g}"
    )
    if not np.isfinite(position[row]).all():
        return NotFiniteError(
            f"{where}: its position is not finite. Likely cause: an overlap or a force that is far too large; "
            f"look at the last checkpoint, use a smaller dt"
        )
    if not sim.box.outside(position[row]):
        return LostGrainError(
            f"{where}: it moved by more than a period of the box in one step. Use a smaller dt or lower velocities"
        )
    if sim.box.dimension == 2 and position[row, 2] != 0.0:
        return LostGrainError(
            f"{where}: it left the plane z = 0 of a two-dimensional box ({len(rows)} such grains). Likely cause: a law whose "
            f"force is not in the plane, or a control that moves a wall along z"
        )
    return LostGrainError(
        f"{where}: it left the box {sim.box.low.tolist()} to {sim.box.high.tolist()} through a face that is not "
        f"periodic ({len(rows)} such grains). Likely cause: a missing wall, or a grain shot out of a large overlap"
    )


def bad_force(sim):
    """The error for a force that is not finite."""
    grains = sim.grains
    row = np.flatnonzero(~np.isfinite(grains.view("force") + grains.view("torque")).all(axis=1))[0]
    return NotFiniteError(
        f"grain {grains.view('id')[row]} at {grains.view('position')[row].tolist()}, step {sim.step_number}: its force "
        f"{grains.view('force')[row].tolist()} is not finite. Likely cause: two grains at the same place, or a law "
        f"that divides by zero{f', or bond law {sim.bonds.law.name!r}' if sim.bonds.active else ''}"
    )


def wall_of(walls, key):
    """The wall that has a key."""
    return next(wall for wall in walls if wall.key >= key > wall.key - wall.patches)


def too_large_overlap(sim):
    """The error for the deepest contact above ``max_overlap``."""
    table = contact_table(sim, all_ranks=False)
    deepest = int(np.argmax(table["relative_overlap"]))
    first, second = table["first"][deepest], table["second"][deepest]
    partner = f"grain {second}" if second >= 0 else f"wall {wall_of(sim.walls, second).number}"
    return OverlapError(
        f"grain {first} and {partner} at {table['point'][deepest].tolist()}, step {sim.step_number}: overlap "
        f"{table['overlap'][deepest]:g} [length] is {100 * table['relative_overlap'][deepest]:.1f} % of the smaller "
        f"diameter; allowed are {100 * sim.max_overlap:g} % (max_overlap). Use a stiffer material or a smaller dt, "
        f"move grains apart at the start, or raise max_overlap"
    )
