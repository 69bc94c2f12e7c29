"""What the tests of a rock have shown, from the tables of their run."""

from typing import NamedTuple

import numpy as np

from barchan import record
from barchan.experiments.experiment import Check, Results
from barchan.experiments.rock.curve import Curve
from barchan.experiments.rock.emission import Events, events
from barchan.experiments.rock.parameters import TESTS, WAIST
from barchan.laws.parallel_bond import MODES
from barchan.units import readable
from barchan.writers import frames, read_grain_frame, read_table

#: Allowed: strength in compression over that in tension. Griffith's theory has 8, Murrell's 12, bonded spheres 3 to 10
#: (Potyondy & Cundall 2004; Scholtes & Donze 2013), rocks up to 30 (m_i of Hoek & Brown 1980).
RATIO = (3.0, 30.0)

#: Allowed: Brazilian over direct tensile strength; of sedimentary rocks it is 1 / 0.7 on average (Perras & Diederichs 2014).
INDIRECT = (0.7, 2.0)

#: Allowed: difference of the forces at both ends on the rise, and the stress at the end, over the strength.
BALANCED, FAILED = 0.03, 0.7

#: Breaks are one event of acoustic emission that are nearer than so many mean diameters, and as soon as a wave takes for that.
NEAR = 3.0

#: Columns of the table of cracks.
CRACKS = ("test", "crack step", "mode", *(f"{axis} [m]" for axis in "xyz"), *(f"n{axis} [1]" for axis in "xyz"), "energy [J]")


class Measured(NamedTuple):
    """What was measured of one test: its ``table``, its ``curve``, its ``cracks`` (column -> (k,)) and its ``events``."""

    table: dict
    curve: Curve
    cracks: dict
    events: Events


class Parts(NamedTuple):
    """Fragments of a specimen, the heaviest first: ``number`` of grains and share of the ``mass`` of the specimen of each, (k,);
    ``grains``: fields of the grains, with the ``rank`` of each one's fragment, (n,)."""

    number: np.ndarray
    mass: np.ndarray
    grains: dict


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    found = measured(scene, directory)
    smallest, largest = scene.radii
    values = [("grains", f"radii {readable(smallest, 'm')} to {readable(largest, 'm')}; time step {readable(scene.dt, 's')}")]
    if not found:
        return Results([*values, ("loading", "not begun yet")], [], [])
    for test, one in found.items():
        values += [(f"{test}: {name}", value) for name, value in _values(scene, test, one)]
    for test, one in parts(scene, directory).items():
        values.append((f"{test}: fragments", f"{len(one.number)}, the largest {100.0 * one.mass[0]:.1f} % of the mass"))
    return Results(values, [], _checks(scene, found, record.sittings(directory / "record.json")))


def measured(scene, directory):
    """Test -> ``Measured``, of those of which there are rows."""
    paths = {test: directory / "tables" / f"{test}.csv" for test in scene.tests}
    tables = {test: read_table(path) for test, path in paths.items() if path.exists()}
    path = directory / "tables" / "cracks.csv"
    cracks = read_table(path) if path.exists() else dict.fromkeys(CRACKS, np.zeros(0))  # none yet
    return {test: _measured(scene, test, table, cracks) for test, table in tables.items() if len(table["step"])}


def _measured(scene, test, table, cracks):
    own = {name: column[cracks["test"] == TESTS.index(test)] for name, column in cracks.items()}
    return Measured(table, Curve.of(table, test, area(scene, test)), own, _events(scene, own))


def _events(scene, cracks):
    heard = cracks["energy [J]"] > 0.0
    time, place = scene.dt * cracks["crack step"], np.stack([cracks[f"{axis} [m]"] for axis in "xyz"], axis=1)
    near, speed = 2.0 * NEAR * scene.radius, np.sqrt(scene.modulus / scene.density)
    return events(time[heard], place[heard], cracks["energy [J]"][heard], near, near / speed)


def area(scene, test):
    """By what the force of a test is divided [m^2]: in tension the waist, of the disc pi D t / 2, for the stress 2 P / (pi D t)
    where it splits."""
    return {
        "compression": scene.width**2,
        "tension": (WAIST * scene.width) ** 2,
        "brazilian": 0.5 * np.pi * scene.disc * scene.width,
    }[test]


def parts(scene, directory):
    """Test -> ``Parts``, at the last frame; empty without one."""
    path = directory / "tables" / "fragments.csv"
    table = read_table(path) if path.exists() else {"step": np.zeros(0)}
    there = [frame for frame in frames(directory / "frames", "grains") if (table["step"] == frame.step).any()]
    if not there:
        return {}
    of = table["fragment"][table["step"] == there[-1].step].astype(int)
    fields = read_grain_frame(there[-1].path).fields
    chosen = {test: fields["specimen"] == TESTS.index(test) for test in scene.tests}
    return {test: _parts({name: column[rows] for name, column in fields.items()}, of[rows]) for test, rows in chosen.items()}


def _parts(grains, fragment):
    _, rank, number = np.unique(fragment, return_inverse=True, return_counts=True)  # they are numbered by falling mass
    mass = np.bincount(rank, weights=grains["mass"])
    return Parts(number, mass / mass.sum(), grains | {"rank": rank})


def _values(scene, test, one):
    curve, last = one.curve, {name: int(column[-1]) for name, column in one.table.items() if "cracks" in name or name == "bonds"}
    strength = {"compression": "unconfined compressive strength", "tension": "direct tensile strength"}
    at = f"at a displacement of {1e3 * curve.displacement[curve.peak]:.4f} mm"
    yield "specimen", f"{int(one.table['grains'][-1]):,} grains, {last['bonds'] + _cracks(one):,} bonds"
    if test != "brazilian":
        at = f"at {100.0 * curve.strain[curve.peak]:.3f} % strain"
        yield "Young's modulus", f"{readable(curve.modulus, 'Pa')}, secant from 10 to 50 % of the strength"
        yield "Poisson's ratio", f"{curve.poisson:.3f}, over the same part"
    yield strength.get(test, "Brazilian strength 2P/(pi D t)"), f"{readable(curve.strength, 'Pa')}, {at}"
    modes = ", ".join(f"{last[f'cracks in {mode}']} in {mode}" for mode in MODES if last[f"cracks in {mode}"])
    before = int((one.cracks["crack step"] <= curve.step[curve.peak]).sum())
    yield "cracks", f"{_cracks(one)} ({modes or 'none'}), {before} of them before the peak"
    if len(one.events.time):
        b, error = one.events.slope
        slope = f"; b = {b:.2f} ± {error:.2f} from {one.events.complete:.2f} on" if np.isfinite(b) else ""
        magnitude = one.events.magnitude
        said = f"{len(magnitude)} events of magnitude {magnitude.min():.1f} to {magnitude.max():.1f}{slope}"
        yield "acoustic emission", f"{said}; {one.events.energy.sum():.3g} J were in the bonds that broke"


def _cracks(one):
    return int(sum(one.table[f"cracks in {mode}"][-1] for mode in MODES))


def _checks(scene, found, sittings):
    checks, strength = [], {test: one.curve.strength for test, one in found.items()}
    for test, one in found.items():
        checks += _sound(test, one)
        if one.curve.step[-1] >= scene.last_step - scene.row_steps:
            left = one.curve.residual
            checks.append(Check(f"{test}: failed", f"{100.0 * left:.0f} % of the strength at the end", "70 %", left <= FAILED))
    if {"compression", "tension"} <= strength.keys():
        checks.append(_between("compression over tension", strength["compression"] / strength["tension"], RATIO))
    if {"brazilian", "tension"} <= strength.keys():
        checks.append(_between("Brazilian over direct tension", strength["brazilian"] / strength["tension"], INDIRECT))
    stable = max((s.stable_dt or 0.0 for s in sittings), default=0.0)
    if stable:  # a run that is under way, or was killed, has no record yet
        checks.append(Check("time step", readable(scene.dt, "s"), f"{readable(stable, 's')}, the stable one", scene.dt <= stable))
    return checks


def _sound(test, one):
    """Is the loading slow, and does the book of the bonds balance?"""
    apart = one.curve.imbalance
    said = f"forces at both ends differ by {100.0 * apart:.2f} % of the strength"
    lost = int(one.table["bonds"][0] - one.table["bonds"][-1])
    seen = _cracks(one) - int(sum(one.table[f"cracks in {mode}"][0] for mode in MODES))
    energy = one.cracks["energy [J]"]
    least = float(energy.min()) if len(energy) else 0.0
    gone = int(one.table["grains"][0] - one.table["grains"][-1])
    return [
        Check(f"{test}: quasi-static", said, f"{100.0 * BALANCED:g} %", apart <= BALANCED),
        Check(f"{test}: cracks are the bonds lost", f"{seen} cracks, {lost} bonds", "as many", seen == lost),
        Check(f"{test}: energy of each crack", f"at least {least:.1e} J", "above 0", least > 0.0 or not len(energy)),
        Check(f"{test}: lost grains", f"{gone}", "0", gone == 0),
    ]


def _between(name, ratio, allowed):
    return Check(name, f"{ratio:.2f}", f"{allowed[0]:g} to {allowed[1]:g}", allowed[0] <= ratio <= allowed[1])
