"""What a test of bonds has shown, from the tables of its run."""

import numpy as np

from barchan.experiments.bond.closed_form import breaks, curves
from barchan.experiments.bond.setup import TESTS
from barchan.experiments.experiment import Check, Results
from barchan.laws.parallel_bond import MODES
from barchan.units import readable
from barchan.writers import read_table

#: How far a curve may be from its closed form, relative to the largest value of that; and what is left after the break.
EXACT = 1e-9

#: Columns of the table that ``Curves`` has, in its order.
COLUMNS = ("pull [N]", "shear force [N]", "twisting moment [N m]", "bending moment [N m]", "edge tension [Pa]", "edge shear [Pa]")
COLUMNS += ("force on the grain [N]", "moment on the grain [N m]")


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    values, checks, cracks = [], [], crack_table(directory)
    for number, test in enumerate(TESTS):
        series = series_of(directory, number)
        if series is None:
            return Results([("results", "none: the run is shorter than table_steps")], [], [])
        crack = next((row for row in range(len(cracks["test"])) if cracks["test"][row] == number), None)
        step = None if crack is None else int(cracks["crack step"][crack])
        mode = None if crack is None else MODES[int(cracks["mode"][crack]) - 1]
        values.append((test, _told(series, step, mode) + (f", freeing {cracks['energy [J]'][crack]:.6g} J" if step else "")))
        checks += _checks(scene, test, series, step, mode)
    return Results([*values, ("time step", readable(scene.dt, "s"))], [], checks)


def series_of(directory, number):
    """The rows of a test, by its number, in the table ``bonds.csv``; None if there are none."""
    path = directory / "tables" / "bonds.csv"
    table = read_table(path) if path.exists() else {"test": np.zeros(0)}
    rows = table["test"] == number
    return {name: column[rows] for name, column in table.items()} if rows.any() else None


def crack_table(directory):
    """The table ``cracks.csv``; of a run in which nothing broke yet there is none."""
    path = directory / "tables" / "cracks.csv"
    return read_table(path) if path.exists() else {"test": np.zeros(0)}


def _told(series, step, mode):
    largest = {name: float(column.max()) for name, column in series.items() if name in COLUMNS[:4]}
    said = [name[:-1].replace(" [", f" up to {value:.6g} ") for name, value in largest.items() if value > 0.0]
    return "; ".join([", ".join(said), f"broke in {mode} at step {step:,}" if step else f"holds at step {series['step'][-1]:,}"])


def _checks(scene, test, series, step, mode):
    """Break, curves before it, and what is left after it."""
    end, in_mode = breaks(scene, test)
    if series["step"][-1] >= end or step:
        seen = f"in {mode} at step {step:,}" if step else "none"
        yield Check(f"{test}: break", seen, f"in {in_mode} at step {end:,}", (step, mode) == (end, in_mode))
    holds = series["step"] < (step or series["step"][-1] + 1)
    if holds.any():
        error = _error(scene, test, series, holds)
        yield Check(f"{test}: curves", f"within {error:.1e} of the closed form", f"{EXACT:g}", error <= EXACT)
    if not holds.all():
        load = np.maximum(series["force on the grain [N]"], series["moment on the grain [N m]"] / scene.radius)
        left = float(load[~holds].max() / load.max()) if load.any() else 0.0
        yield Check(f"{test}: after the break", f"{left:.1e} of the largest load is left", f"{EXACT:g}", left <= EXACT)


def _error(scene, test, series, holds):
    """Largest error of all curves, each relative to its largest value; of what shall be 0 relative to the others."""
    exact, worst = dict(zip(COLUMNS, curves(scene, test, series["step"][holds]))), 0.0
    peaks = {name: float(curve.max()) for name, curve in exact.items()}
    stress = max(peaks["edge tension [Pa]"], peaks["edge shear [Pa]"])
    load = {"[Pa]": stress, "[N]": stress * scene.area, "[N m]": stress * scene.area * scene.bond_radius}
    for name, curve in exact.items():
        miss = float(np.abs(series[name][holds] - curve).max())
        worst = max(worst, miss / (peaks[name] or next(value for unit, value in load.items() if name.endswith(unit))))
    return worst
