"""What is measured, and written, while the specimens are loaded."""

import numpy as np

from barchan.bonds import cracks
from barchan.experiments.rock.parameters import GAUGE, TESTS
from barchan.experiments.rock.setup import axis_of, platens
from barchan.kernels.exact_sum import exact_sum
from barchan.laws.parallel_bond import MODES
from barchan.measure import fragments, strain
from barchan.triggers import Every
from barchan.writers import GrainFrames, Table


def instruments(scene, directory):
    """The writers that watch the tests: a table for each, of the cracks, of the fragments, and frames of grains.

    Args:
        scene: a ``Rock``.
        directory: of the run.
    """
    tables, rows, pictures = directory / "tables", Every(scene.row_steps), Every(scene.frame_steps)
    return [
        *(Table(tables / f"{test}.csv", rows, lambda sim, test=test: row(sim, scene, test)) for test in scene.tests),
        Table(tables / "cracks.csv", rows, lambda sim: new_cracks(sim, scene)),
        Table(tables / "fragments.csv", pictures, fragment_rows),
        GrainFrames(directory / "frames", pictures),
    ]


def row(sim, scene, test):
    """One row of a test. Forces and displacement are positive in the sense of the test, strains where it gets longer or wider."""
    gauge = np.array([scene.height, scene.width, 0.5 * GAUGE * scene.height])  # across it is wider than the specimen
    low, high = ((axis_of(scene, test), 0.0, 0.5 * scene.height) + side * gauge for side in (-1.0, 1.0))
    widening = -np.diag(strain(sim, low=low, high=high).small)
    bottom, top = _forces(sim, scene, test)
    broken = cracks.table(sim)
    broken = {name: column[_test_of(scene, broken["x"]) == TESTS.index(test)] for name, column in broken.items()}
    return {
        "displacement [m]": sim.step_number * scene.dt * scene.rate(test) * scene.height,
        "force bottom [N]": bottom,
        "force top [N]": top,
        "axial strain [1]": float(widening[2]),
        "strain along x [1]": float(widening[0]),
        "strain along y [1]": float(widening[1]),
        "bonds": _bonds(sim, test),
        **{f"cracks in {mode}": int((broken["mode"] == number).sum()) for number, mode in enumerate(MODES, 1)},
        "grains": int(sim.comm.sum([int((sim.grains.view("specimen") == TESTS.index(test)).sum())])[0]),
    }


def _forces(sim, scene, test):
    """Force at the lower and at the upper end [N]."""
    if test != "tension":
        lower, upper = platens(sim, scene, test)
        return 0.0 - float(lower.force[2]), float(upper.force[2])
    grains = sim.grains
    held, above = grains.view("frozen") == 1, grains.view("position")[:, 2] > 0.5 * scene.height
    force = grains.view("force")[:, 2]
    return exact_sum(force[held & ~above], sim.comm), 0.0 - exact_sum(force[held & above], sim.comm)


def _bonds(sim, test):
    """How many bonds of a specimen hold."""
    bonds, specimen = sim.bonds, sim.grains.view("specimen")
    first = bonds.first[bonds.holding]
    return int(sim.comm.sum([int((specimen[first[first < sim.grains.n]] == TESTS.index(test)).sum())])[0])


def _test_of(scene, x):
    """Number of the test whose specimen is nearest, (k,)."""
    axes = np.array([axis_of(scene, test) for test in scene.tests])
    number = np.array([TESTS.index(test) for test in scene.tests])
    return number[np.abs(np.subtract.outer(x, axes)).argmin(axis=1)]


def new_cracks(sim, scene):
    """The cracks since the last row, one row each."""
    all_ = cracks.table(sim)
    new = all_["step"] > sim.step_number - scene.row_steps
    tests = _test_of(scene, all_["x"])
    return [
        {
            "test": int(tests[k]),
            "crack step": int(all_["step"][k]),
            "mode": int(all_["mode"][k]),
            **{f"{name} [m]": float(all_[name][k]) for name in "xyz"},
            **{f"{name} [1]": float(all_[name][k]) for name in ("nx", "ny", "nz")},
            "energy [J]": float(all_["energy"][k]),
        }
        for k in np.flatnonzero(new)
    ]


def fragment_rows(sim):
    """Which fragment each grain is in, one row each, by ascending id."""
    found = fragments(sim)
    return [{"id": int(id), "fragment": int(number)} for id, number in zip(found.ids, found.of)]
