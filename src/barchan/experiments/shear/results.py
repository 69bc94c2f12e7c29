"""What sheared grains have shown, from the tables of their run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.checks import overlap, time_step
from barchan.experiments.experiment import Check, Results
from barchan.experiments.shear.parameters import ROWS
from barchan.experiments.shear.rheology import GLASS_BEADS, filling_of, friction_of
from barchan.measure import inertial_number
from barchan.units import readable
from barchan.writers import read_table

#: Parts of a stage whose means give the error of its mean.
PARTS = 5

#: What is allowed. Normal stress off its target; velocity off the straight line, relative to the difference between the faces;
#: solid fraction and shear stress of a slice off their mean; solid fraction of one half of a stage off that of the other;
#: work of the box off the stress power, and what friction and dashpots took off the work; overlap.
HELD, STRAIGHT, EVEN, STEADY, WORK, OVERLAP = 0.01, 0.05, 0.05, 0.01, 0.02, 0.05


#: Stages that laws need to be drawn through them, with errors.
NEEDED = 4

#: What falls from stage to stage, and what grows.
ORDER = (("mu", 1.0), ("solid", -1.0))


class Steady(NamedTuple):
    """Means of a stage [1]: ``inertial``, the inertial number; ``mu``, shear over normal stress, and its standard error;
    ``solid``, the solid fraction, and its; ``first`` and ``second``, the normal stress differences (xx - zz) / zz and
    (yy - zz) / zz; ``held``, normal stress over its target; ``drift``, by which the solid fraction is larger in the second half;
    coordination, without rattlers too; sliding contacts. Profiles, (slices,) each: ``velocity`` over the difference between the
    faces, ``filling`` and ``shear`` stress over their means."""

    inertial: float
    mu: float
    mu_error: float
    solid: float
    solid_error: float
    first: float
    second: float
    held: float
    drift: float
    coordination: float
    mechanical: float
    sliding: float
    velocity: np.ndarray
    filling: np.ndarray
    shear: np.ndarray

    @property
    def bend(self):
        """Largest distance of the velocity from the straight line."""
        return float(np.abs(self.velocity - heights(self.velocity) + 0.5).max())

    @property
    def uneven(self):
        """Largest distance of filling and shear stress from 1."""
        return float(np.abs(np.concatenate([self.filling, self.shear]) - 1.0).max())


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    time, found = read(directory, "time"), steady_stages(scene, directory)
    values = [("sample", _sample(scene)), ("time step", readable(scene.dt, "s"))]
    if not found:
        return Results([*values, ("shear", "no stage is complete yet")], [], [])
    values += [_told(one) for one in found]
    checks = [*_stage_checks(found)]
    if len(found) >= NEEDED:
        friction, filling = laws_of(found)
        values.append(("mu(I)", f"{_told_friction(friction)}; {friction.miss:.4f} rms off; glass beads: {_of_glass_beads()}"))
        values.append(("phi(I)", f"{filling.phi_c:.4f} - {filling.slope:.3f} I, {filling.miss:.4f} rms off"))
    checks += _energy_checks(scene, time, read(directory, "energy"))
    checks += time_step(scene, record.sittings(directory / "record.json"))
    checks.append(overlap(float(time["largest overlap [1]"].max()), OVERLAP))
    lost = scene.grains - int(time["grains"][-1])
    return Results(values, [], [*checks, Check("lost grains", str(lost), "0", lost == 0)])


def read(directory, name):
    """A table of the run; None if there is none yet.

    Raises:
        ResultError: it is damaged.
    """
    path = directory / "tables" / f"{name}.csv"
    table = read_table(path) if path.exists() else None
    return table if table is not None and len(table["step"]) else None


def steady_stages(scene, directory):
    """``Steady`` of each stage that is complete, the fastest first."""
    time, profiles = read(directory, "time"), read(directory, "profiles")
    done = [stage for stage, end in enumerate(scene.ends) if time is not None and time["step"][-1] >= end]
    return [_steady(scene, stage, time, profiles) for stage in done]


def laws_of(found):
    """``Friction`` and ``Filling`` through stages."""
    inertial, mu, solid = (_values(found, name) for name in ("inertial", "mu", "solid"))
    return friction_of(inertial, mu), filling_of(inertial, solid)


def _values(found, name):
    return np.array([getattr(one, name) for one in found])


def heights(values):
    """Middles of the slices, as shares of the height."""
    return (np.arange(len(values)) + 0.5) / len(values)


def _steady(scene, stage, time, profiles):
    rows, slices = (_within(scene, stage, table) for table in (time, profiles))
    xx, yy, zz = (rows[f"normal stress {axis} [Pa]"].mean() for axis in "xyz")
    shear, parts = rows["shear stress [Pa]"].mean(), np.arange(ROWS) * PARTS // ROWS
    ratio = _part_means(rows["shear stress [Pa]"], parts) / _part_means(rows["normal stress z [Pa]"], parts)
    solid = rows["solid fraction [1]"]
    early, late = solid[: ROWS // 2].mean(), solid[ROWS // 2 :].mean()
    across = float(scene.shear_rates[stage]) * rows["height [m]"].mean()
    number = len(np.unique(slices["height [1]"]))
    velocity, filling, carried = (
        slices[name].reshape(-1, number).mean(axis=0) for name in ("velocity [m/s]", "solid fraction [1]", "shear stress [Pa]")
    )
    return Steady(
        inertial_number(float(scene.shear_rates[stage]), zz, scene.diameter, scene.density),
        shear / zz,
        _error(ratio),
        solid.mean(),
        _error(_part_means(solid, parts)),
        (xx - zz) / zz,
        (yy - zz) / zz,
        zz / scene.pressure,
        late / early - 1.0,
        *(rows[name].mean() for name in ("coordination", "mechanical coordination", "sliding contacts [1]")),
        velocity / across,
        filling / filling.mean(),
        carried / carried.mean(),
    )


def _within(scene, stage, table):
    """Rows of a table over which a stage is averaged."""
    at = (table["step"] > scene.begins[stage]) & (table["step"] <= scene.ends[stage])
    return {name: column[at] for name, column in table.items()}


def _part_means(values, parts):
    return np.bincount(parts, values) / np.bincount(parts)


def _error(means):
    """Standard error of the mean of parts."""
    return float(means.std(ddof=1) / PARTS**0.5)


def _sample(scene):
    hard = scene.stiffness / (scene.pressure * scene.diameter)
    return f"{scene.grains:,} grains at {readable(scene.pressure, 'Pa')}; stiffness over pressure and diameter {hard:.4g}"


def _told(one):
    errors = f"mu = {one.mu:.4f} +- {one.mu_error:.4f}, phi = {one.solid:.4f} +- {one.solid_error:.4f}"
    contacts = f"{one.coordination:.2f} contacts a grain ({one.mechanical:.2f} without rattlers)"
    differences = f"N1 {one.first:+.3f}, N2 {one.second:+.3f}"
    return f"I = {one.inertial:.4f}", f"{errors}; {contacts}, {100.0 * one.sliding:.0f} % slide; {differences}"


def _told_friction(law):
    low, slope = (f"{value:.3f} +- {error:.3f}" for value, error in zip(law[:2], law.errors))
    fast = f"mu_2 = {law.mu_2:.3f}, I_0 = {law.i_0:.3f}" if law.determined else "too few fast stages to tell mu_2 and I_0"
    return f"mu_s = {low}, slope {slope} there; {fast}"


def _of_glass_beads():
    return f"{GLASS_BEADS.mu_s:.3f}, slope {GLASS_BEADS.slope:.3f}, {GLASS_BEADS.mu_2:.3f}, {GLASS_BEADS.i_0:.3f}"


def _stage_checks(found):
    for name, value, form, allowed in (
        ("normal stress is held", max(abs(one.held - 1.0) for one in found), "{:.2f} % off at most", HELD),
        ("velocity is linear", max(one.bend for one in found), "{:.1f} % of the difference between the faces off", STRAIGHT),
        ("sheared evenly", max(one.uneven for one in found), "solid fraction, shear stress of slices {:.1f} % off", EVEN),
        ("steady", max(abs(one.drift) for one in found), "solid fractions of halves {:.2f} % apart", STEADY),
    ):
        yield Check(name, form.format(100.0 * value), f"{100.0 * allowed:g} %", value <= allowed)
    if len(found) > 1:
        mu, solid = (_values(found, name) for name in ("mu", "solid"))
        ordered = all(_ordered(sign * _values(found, name), _values(found, f"{name}_error")) for name, sign in ORDER)
        said = f"mu {mu[-1]:.3f} to {mu[0]:.3f}, solid fraction {solid[-1]:.3f} to {solid[0]:.3f}"
        yield Check("faster is rougher and looser", said, "in order, within twice the standard errors", ordered)


def _ordered(values, errors):
    """Whether values fall, as far as their errors let one say."""
    return bool((np.diff(values) < 2.0 * np.hypot(errors[1:], errors[:-1])).all())


def _energy_checks(scene, time, energy):
    """Of the first stage, which an ``EnergyAccount`` has seen."""
    if energy is None or len(energy["step"]) < 2:
        return
    rows = (time["step"] >= scene.begins[0]) & (time["step"] <= scene.ends[0])
    power, step = time["stress power [W]"][rows], time["step"][rows]
    came = float(np.trapezoid(power, scene.dt * step))
    work, friction, dashpots, stored = (
        float(energy[name][-1] - energy[name][0])
        for name in ("work of the box [J]", "friction [J]", "dashpots [J]", "stored [J]")
    )
    for name, value, said in (
        ("stress power is work of the box", came / work, "integral of stress times rate times volume"),
        ("work is dissipated", (friction + dashpots + stored) / work, f"{100.0 * friction / work:.0f} % by friction, the sum"),
    ):
        shown = f"{said} {100.0 * value:.2f} % of the work"
        yield Check(name, shown, f"100 % to {100.0 * WORK:g} %", abs(value - 1.0) <= WORK)
