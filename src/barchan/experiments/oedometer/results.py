"""What an oedometer test has shown, from the tables of its run."""

import numpy as np

from barchan import record
from barchan.experiments.cell import WALLS
from barchan.experiments.cell.results import (
    BALANCED,
    FOLLOWED,
    branch,
    check_grains_carry,
    check_quasi_static,
    errors,
    is_over,
    load_series,
    sample_values,
    sound_checks,
    structure_values,
)
from barchan.experiments.cell.scene import Lattice
from barchan.experiments.experiment import Check, Results
from barchan.experiments.oedometer.modulus import Moduli
from barchan.units import readable


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    load = series(scene, directory)
    values = [("grains", f"about {Lattice.of(scene).grains:,} rained; time step {readable(scene.dt, 's')}")]
    if load is None:
        return Results([*values, ("loading", "not begun yet")], [], [])
    values += [*sample_values(load), *_values(scene, load), *structure_values(load)]
    return Results(values, [], _checks(scene, load, record.sittings(directory / "record.json")))


def series(scene, directory):
    """The table ``load.csv`` with vertical stress (mean of top and floor), horizontal stress (mean of the sides) and K0, their
    ratio; None if there is none. The sides stand still, so the volumetric strain is the vertical one."""
    load = load_series(scene, directory)
    if load is None:
        return None
    horizontal, vertical = (np.mean([load[f"stress {name} [Pa]"] for name in names], axis=0) for names in (WALLS[:4], WALLS[4:]))
    k0 = np.divide(horizontal, vertical, out=np.zeros_like(vertical), where=vertical > 0.0)  # before the top meets grains
    return load | {"horizontal stress [Pa]": horizontal, "vertical stress [Pa]": vertical, "K0 [1]": k0}


def branches(scene, load):
    """Rows of loading and hold, and of what comes after, (k,) bool each."""
    _, seated, _, held, _, _ = scene.ends
    step = load["step"]
    return (step >= seated) & (step <= held), step >= held


def _values(scene, load):
    peak, moduli = int(np.searchsorted(load["step"], scene.ends[3], side="right")) - 1, Moduli.of(scene, load)
    moments = {"at the largest stress": peak, "at the end": -1}

    def told(name, form):
        return ", ".join(f"{form(load[name][row])} {moment}" for moment, row in moments.items())

    share = 1.0 - load["stress floor [Pa]"][peak] / load["stress top [Pa]"][peak]
    loading, unloading = (1e-6 * values[-1] for values in (moduli.loading, moduli.unloading))
    return [
        ("stress on the top", told("stress top [Pa]", lambda value: f"{1e-3 * value:.2f} kPa")),
        ("stress on the floor", told("stress floor [Pa]", lambda value: f"{1e-3 * value:.2f} kPa")),
        ("carried by the sides", f"{100.0 * share:.2f} % of the load of the top, at its largest, by friction"),
        ("K0", told("K0 [1]", "{:.3f}".format)),
        ("vertical strain", told("volumetric strain [1]", lambda value: f"{100.0 * value:.3f} %") + " (compression positive)"),
        ("void ratio", f"{load['void ratio [1]'][0]:.4f} as flattened, " + told("void ratio [1]", "{:.4f}".format)),
        ("constrained modulus", f"{loading:.3f} MPa loading, {unloading:.3f} MPa unloading, near the largest stress"),
        ("sliding contacts", told("sliding contacts [1]", lambda value: f"{100.0 * value:.1f} %")),
    ]


def _checks(scene, load, sittings):
    _, seated, loaded, held, unloaded, _ = scene.ends
    settled = {name: branch(load, *steps) for name, steps in {"loading": (seated, loaded), "unloading": (held, unloaded)}.items()}
    error = {name: float(errors(load, rows, ["top"])[0]) for name, rows in settled.items() if rows.any()}
    checks, moduli = [], Moduli.of(scene, load)
    if error:
        said = ", ".join(f"{100.0 * value:.2f} % rms {name}" for name, value in error.items())
        allowed = f"{100.0 * FOLLOWED:g} %, after the first 5 %"
        checks.append(Check("top follows the target", said, allowed, max(error.values()) <= FOLLOWED))
        checks.append(check_quasi_static(load, np.any(list(settled.values()), axis=0)))
    if np.isfinite(moduli.unloading[-1]):
        ratio = float(moduli.unloading[-1] / moduli.loading[-1])
        checks.append(Check("stiffer when unloaded", f"{ratio:.2f} times the modulus of loading", "more than 1", ratio > 1.0))
    if is_over(scene, load):
        share = float(load["vertical force on all walls [N]"][-1] / (load["stress top [Pa]"][-1] * scene.width**2))
        said = f"the vertical force on all is {100.0 * share:+.3f} % of that on the top"
        checks.append(Check("walls are in balance", said, f"{100.0 * BALANCED:g} %", abs(share) <= BALANCED))
        if scene.wall_friction == 0.0:  # else friction on the sides, too, adds to the stress of the grains
            checks.append(check_grains_carry(load))
    return checks + sound_checks(scene, load, sittings)
