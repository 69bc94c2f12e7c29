"""What a compression test has shown, from the tables of its run."""

import numpy as np

from barchan import record
from barchan.experiments.cell import WALLS
from barchan.experiments.cell.results import (
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
from barchan.experiments.compression.parameters import PAPER
from barchan.experiments.experiment import Check, Results
from barchan.units import readable


def results(scene, directory):
    """Values, differences from the paper, and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    load = load_series(scene, directory)
    values = [("grains", f"about {Lattice.of(scene).grains:,} rained; time step {readable(scene.dt, 's')}")]
    if load is None:
        return Results([*values, ("loading", "not begun yet")], _differences(scene), [])
    values += [
        *sample_values(load),
        (
            "mean stress",
            f"{readable(load['mean stress [Pa]'][-1], 'Pa')}, target {readable(load['target stress [Pa]'][-1], 'Pa')}",
        ),
        ("volumetric strain", f"{100.0 * load['volumetric strain [1]'][-1]:.3f} % (compression positive)"),
        ("void ratio", "{:.4f} as flattened, {:.4f} before loading, {:.4f} at the end".format(*_void_ratios(load))),
        *structure_values(load),
    ]
    return Results(values, _differences(scene), _checks(scene, load, record.sittings(directory / "record.json")))


def _void_ratios(load):
    """At the first row, at the state from which volumetric strain counts, and at the last."""
    ratio = load["void ratio [1]"]
    return ratio[0], (1.0 + ratio[-1]) * np.exp(load["volumetric strain [1]"][-1]) - 1.0, ratio[-1]


def loading(scene, load):
    """Rows of the loading after the servo has settled, (k,) bool."""
    _, seated, loaded, _ = scene.ends
    return branch(load, seated, loaded)


def _differences(scene):
    rows = [
        (name, *(value if isinstance(value, str) else scene.rounded(name, value) for value in (getattr(scene, name), paper)))
        for name, paper in PAPER.items()
        if getattr(scene, name) != paper
    ]
    return [("grains", f"{Lattice.of(scene).grains:,}", "1,950,000, of which 1,428,532 were left after flattening"), *rows]


def _checks(scene, load, sittings):
    checks, rows = [], loading(scene, load)
    if rows.any():
        error = errors(load, rows, WALLS).tolist()
        said = f"{100.0 * max(error):.2f} % rms on the {WALLS[int(np.argmax(error))]} wall"
        checks.append(
            Check("walls follow the target", said, f"{100.0 * FOLLOWED:g} %, after the first 5 %", max(error) <= FOLLOWED)
        )
        checks.append(check_quasi_static(load, rows))
    if is_over(scene, load):
        checks.append(check_grains_carry(load))
    return checks + sound_checks(scene, load, sittings)
