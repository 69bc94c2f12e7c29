"""What the tables of a loaded sample show, whatever loads it."""

import numpy as np

from barchan.experiments.experiment import Check
from barchan.experiments.stored import stored
from barchan.units import readable

#: Part of a branch of the loading that the servo may take to settle.
SETTLING = 0.05

#: Allowed: error of the stress on the walls, root mean square relative to the target; stress of grains beside that of walls.
FOLLOWED, BALANCED = 0.01, 0.005

#: Inertial number below which loading is quasi-static (GDR MiDi 2004).
QUASI_STATIC = 1e-3

#: Largest void ratio as flattened, of a few grains with many of them at walls: above, grains were still falling.
LOOSEST = 1.25


def load_series(scene, directory):
    """The table ``load.csv`` and its volumetric strain, logarithmic, from the end of the seating on; None if there is none."""
    (series,) = stored(directory, ("load",))
    if series is None:
        return None
    volume = series["size x [m]"] * series["size y [m]"] * series["size z [m]"]
    seated = min(int(np.searchsorted(series["step"], scene.ends[1])), len(volume) - 1)
    return series | {"volumetric strain [1]": np.log(volume[seated] / volume)}


def branch(load, begin, end):
    """Rows of a branch of the loading, between two steps, after the servo has settled, (k,) bool."""
    return (load["step"] > begin + SETTLING * (end - begin)) & (load["step"] <= end)


def errors(load, rows, walls):
    """Root mean square of stress over target less 1 in ``rows``, of each of the named walls, (n,)."""
    target = load["target stress [Pa]"][rows]
    return np.array([np.sqrt(np.mean((load[f"stress {name} [Pa]"][rows] / target - 1.0) ** 2)) for name in walls])


def sample_values(load):
    """Lines on the sample: grains and size."""
    size = [" x ".join(f"{1e3 * load[f'size {axis} [m]'][row]:.2f}" for axis in "xyz") for row in (0, -1)]
    said = f"{int(load['grains'][-1]):,} grains after flattening, {size[0]} mm at the start, {size[1]} mm at the end"
    return [("sample", said)]


def structure_values(load):
    """Lines on how the grains touch at the end."""
    touching = f"{load['coordination'][-1]:.2f}; without rattlers {load['mechanical coordination'][-1]:.2f}"
    return [
        ("coordination", f"{touching}; {int(load['rattlers'][-1])} rattlers"),
        ("fabric", f"anisotropy {load['anisotropy of fabric [1]'][-1]:.4f}"),
    ]


def check_quasi_static(load, rows):
    """Is the loading slow beside the grains?"""
    inertial = float(load["inertial number [1]"][rows].max())
    return Check("quasi-static", f"inertial number {inertial:.1e}", f"{QUASI_STATIC:g}", inertial <= QUASI_STATIC)


def check_grains_carry(load):
    """Is the stress of the grains that on the walls, at the end?"""
    ratio = float(load["mean stress of grains [Pa]"][-1] / load["mean stress [Pa]"][-1])
    said = f"{100.0 * (ratio - 1.0):+.3f} % beside that of the walls"
    return Check("stress of the grains", said, f"{100.0 * BALANCED:g} %", abs(ratio - 1.0) <= BALANCED)


def is_over(scene, load):
    """Has the table come to the end of the test?"""
    return load["step"][-1] >= scene.ends[-1] - scene.steps(scene.table_every)


def sound_checks(scene, load, sittings):
    """Checks of the sample and of the simulation itself: grains that had settled, overlaps, lost grains, time step."""
    largest, lost = float(load["largest overlap [1]"].max()), int(load["grains"][0] - load["grains"][-1])
    loose = float(load["void ratio [1]"][0])
    checks = [
        Check("container filled", f"void ratio {loose:.2f} as flattened", f"{LOOSEST:g}", loose <= LOOSEST),
        Check("overlap", f"largest seen {100.0 * largest:.2f} % of a diameter", "5 %", largest <= 0.05),
        Check("lost grains", f"{lost}", "0", lost == 0),
    ]
    stable = max((s.stable_dt or 0.0 for s in sittings), default=0.0)
    if stable:  # a run that is under way, or was killed, has no record yet
        checks.append(Check("time step", readable(scene.dt, "s"), f"{readable(stable, 's')}, the stable one", scene.dt <= stable))
    return checks
