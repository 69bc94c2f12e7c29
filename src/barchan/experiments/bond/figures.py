"""Pictures of a test of bonds, from the tables of its run: as Figures 4, 5 and 6 of Marketos 2013 have them."""

import numpy as np

from barchan.experiments.bond.closed_form import breaks, curves
from barchan.experiments.bond.results import COLUMNS, series_of
from barchan.experiments.bond.setup import TESTS
from barchan.view.style import COLOURS, figure

#: What there is to see: column -> its name, and its colour, the same for a force and the stress that it makes.
_LINES = {
    "pull [N]": ("force along the bond", COLOURS[0]),
    "shear force [N]": ("shear force", COLOURS[1]),
    "twisting moment [N m]": ("twisting moment", COLOURS[1]),
    "edge tension [Pa]": ("tension", COLOURS[0]),
    "edge shear [Pa]": ("shear", COLOURS[1]),
}

#: How far behind the break a picture goes, in steps up to it.
_BEHIND = 1.2


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    for number, test in enumerate(TESTS):
        series = series_of(directory, number)
        if series is not None:
            yield _draw(scene, test, series, directory / "figures" / f"{test}.png")


def _draw(scene, test, series, path):
    """Force or moment against the step, and stresses at the edge with the strength of the bond."""
    end, mode = breaks(scene, test)
    series = {name: column[series["step"] <= _BEHIND * end] for name, column in series.items()}
    rows = np.flatnonzero(series["step"] < end)[:: max(len(series["step"]) // 16, 1)]
    exact = dict(zip(COLUMNS, curves(scene, test, series["step"][rows])))
    largest = dict(zip(COLUMNS, curves(scene, test, [end])))
    shown = [name for name in _LINES if largest[name].any()]
    with figure(path, 1, 2, size=(7.6, 3.1), sharex=True) as (_, (left, right)):
        stresses = [name for name in shown if name.endswith("[Pa]")]
        _curves(left, series, exact, rows, [name for name in shown if name not in stresses])
        factor = _curves(right, series, exact, rows, stresses)
        strength = scene.tensile_strength if mode == "tension" else scene.shear_strength
        right.axhline(factor * strength, color=COLOURS[6], linestyle=":", linewidth=1.0, label="strength")
        for axis in (left, right):
            axis.set(xlabel="step [1]", ylim=(None, 1.05 * max(axis.get_ylim()[1], factor * strength * (axis is right))))
            axis.legend(loc="upper left", bbox_to_anchor=(0.0, 0.93))
    return path


def _curves(axis, series, exact, rows, names):
    """Draw columns of one unit with their closed forms; returns the factor by which they are drawn."""
    unit, largest = names[0].split("[")[1][:-1], max(np.abs(series[name]).max() for name in names)
    factor, prefix = next((f, p) for f, p in ((1e-6, "M"), (1e-3, "k"), (1.0, "")) if largest * f >= 1.0 or not p)
    for name in names:
        what, colour = _LINES[name]
        axis.plot(series["step"], factor * series[name], color=colour, label=what)
        axis.plot(series["step"][rows], factor * exact[name], "o", color=colour, markersize=4, fillstyle="none")
    axis.plot([], [], "o", color=COLOURS[6], markersize=4, fillstyle="none", label="closed form")
    kind = {"N": "force", "N m": "moment", "Pa": "stress at the edge of the bond"}[unit]
    axis.set_ylabel(f"{kind} [{prefix}{unit}]")
    return factor
