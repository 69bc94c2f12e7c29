"""What a compression test has shown, from the tables of its run."""

import numpy as np

from barchan import record
from barchan.experiments.cell import WALLS
from barchan.experiments.compression.parameters import PAPER, Lattice
from barchan.experiments.experiment import Check, Results
from barchan.units import readable
from barchan.writers import read_table

#: Part of the loading that the servo may take to settle.
SETTLING = 0.05

#: Allowed: error of the stress on the walls, root mean square relative to the target; stress of grains beside that of walls.
FOLLOWED, BALANCED = 0.01, 0.005

#: Inertial number below which loading is quasi-static (GDR MiDi 2004).
QUASI_STATIC = 1e-3


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
        (
            "sample",
            f"{int(load['grains'][-1]):,} grains after flattening, {_size(load, 0)} at the start, {_size(load, -1)} at the end",
        ),
        (
            "mean stress",
            f"{readable(load['mean stress [Pa]'][-1], 'Pa')}, target {readable(load['target stress [Pa]'][-1], 'Pa')}",
        ),
        ("volumetric strain", f"{100.0 * load['volumetric strain [1]'][-1]:.3f} % (compression positive)"),
        ("void ratio", f"{load['void ratio [1]'][0]:.4f} at the start, {load['void ratio [1]'][-1]:.4f} at the end"),
        (
            "coordination",
            f"{load['coordination'][-1]:.2f}; without rattlers {load['mechanical coordination'][-1]:.2f}; "
            f"{int(load['rattlers'][-1])} rattlers",
        ),
        ("fabric", f"anisotropy {load['anisotropy of fabric [1]'][-1]:.4f}"),
    ]
    return Results(values, _differences(scene), _checks(scene, load, record.sittings(directory / "record.json")))


def load_series(scene, directory):
    """The table ``load.csv`` and its volumetric strain, logarithmic, from the end of the seating on; None if there is none."""
    path = directory / "tables" / "load.csv"
    series = read_table(path) if path.exists() else {"step": ()}
    if not len(series["step"]):
        return None
    volume = series["size x [m]"] * series["size y [m]"] * series["size z [m]"]
    seated = min(int(np.searchsorted(series["step"], scene.ends[1])), len(volume) - 1)
    return series | {"volumetric strain [1]": np.log(volume[seated] / volume)}


def loading(scene, load):
    """Rows of the loading after the servo has settled, (k,) bool."""
    _, seated, loaded, _ = scene.ends
    return (load["step"] > seated + SETTLING * (loaded - seated)) & (load["step"] <= loaded)


def errors(scene, load):
    """Root mean square of stress over target less 1, of each wall while it is loaded, (6,)."""
    rows = loading(scene, load)
    target = load["target stress [Pa]"][rows]
    return np.array([np.sqrt(np.mean((load[f"stress {name} [Pa]"][rows] / target - 1.0) ** 2)) for name in WALLS])


def _size(load, row):
    return " x ".join(f"{1e3 * load[f'size {axis} [m]'][row]:.2f}" for axis in "xyz") + " mm"


def _differences(scene):
    rows = [(name, scene.text(name), str(value)) for name, value in PAPER.items() if getattr(scene, name) != value]
    return [("grains", f"{Lattice.of(scene).grains:,}", "1,950,000, of which 1,428,532 were left after flattening"), *rows]


def _checks(scene, load, sittings):
    checks, rows = [], loading(scene, load)
    if rows.any():
        error = errors(scene, load).tolist()
        said = f"{100.0 * max(error):.2f} % rms on the {WALLS[int(np.argmax(error))]} wall"
        checks.append(
            Check("walls follow the target", said, f"{100.0 * FOLLOWED:g} %, after the first 5 %", max(error) <= FOLLOWED)
        )
        inertial = float(load["inertial number [1]"][rows].max())
        checks.append(Check("quasi-static", f"inertial number {inertial:.1e}", f"{QUASI_STATIC:g}", inertial <= QUASI_STATIC))
    if load["step"][-1] >= scene.ends[-1] - scene.steps(scene.table_every):
        ratio = float(load["mean stress of grains [Pa]"][-1] / load["mean stress [Pa]"][-1])
        said = f"{100.0 * (ratio - 1.0):+.3f} % beside that of the walls"
        checks.append(Check("stress of the grains", said, f"{100.0 * BALANCED:g} %", abs(ratio - 1.0) <= BALANCED))
    largest = float(load["largest overlap [1]"].max())
    checks.append(Check("overlap", f"largest seen {100.0 * largest:.2f} % of a diameter", "5 %", largest <= 0.05))
    lost = int(load["grains"][0] - load["grains"][-1])
    checks.append(Check("lost grains", f"{lost}", "0", lost == 0))
    stable = max((s.stable_dt or 0.0 for s in sittings), default=0.0)
    if stable:  # a run that is under way, or was killed, has no record yet
        checks.append(Check("time step", readable(scene.dt, "s"), f"{readable(stable, 's')}, the stable one", scene.dt <= stable))
    return checks
