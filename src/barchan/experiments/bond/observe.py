"""What is measured, and written, while bonds are tested."""

import numpy as np

from barchan.bonds import cracks
from barchan.experiments.bond.setup import TESTS
from barchan.laws.parallel_bond import disc, edge_stresses
from barchan.measure.bond_table import bond_table
from barchan.triggers import Every
from barchan.writers import Table


def instruments(scene, directory):
    """The writers that watch the test: a table of what the bonds carry, one of the cracks.

    Args:
        scene: a ``BondTest``.
        directory: of the run.
    """
    tables, due = directory / "tables", Every(scene.table_steps)
    return [
        Table(tables / "bonds.csv", due, lambda sim: bond_rows(sim, scene)),
        Table(tables / "cracks.csv", due, lambda sim: crack_rows(sim, scene)),
    ]


def bond_rows(sim, scene):
    """A row for each test: what its bond carries, 0 once it is broken, and force and moment on the grain that is moved."""
    bonds = bond_table(sim)
    force, torque = (_of_moved(sim, name) for name in ("force", "torque"))
    rows = []
    for number in range(len(TESTS)):
        found = np.flatnonzero(bonds["first"] == 2 * number)
        carried, stresses = _carried(bonds, int(found[0]), scene) if len(found) else ([0.0] * 4, [0.0] * 2)
        rows.append(
            {
                "test": number,
                "pull [N]": carried[0],
                "shear force [N]": carried[1],
                "twisting moment [N m]": carried[2],
                "bending moment [N m]": carried[3],
                "edge tension [Pa]": stresses[0],
                "edge shear [Pa]": stresses[1],
                "force on the grain [N]": float(force[number]),
                "moment on the grain [N m]": float(torque[number]),
            }
        )
    return rows


def crack_rows(sim, scene):
    """A row for each crack since the last row of the table."""
    seen = cracks.table(sim)
    return [
        {"test": int(seen["first"][row]) // 2, "crack step": int(seen["step"][row]), "mode": int(seen["mode"][row])}
        | {"energy [J]": float(seen["energy"][row])}
        for row in np.flatnonzero(seen["step"] > sim.step_number - scene.table_steps)
    ]


def _carried(bonds, row, scene):
    """Pull, shear force, twisting and bending moment of a bond; its stresses at the edge in tension and in shear."""
    pressing, twisting = float(bonds["bond_normal_force"][row]), float(bonds["twisting_moment"][row])
    shear, bending = (float(np.sqrt((bonds[name][row] ** 2).sum())) for name in ("bond_shear_force", "bending_moment"))
    radius, *_ = disc(scene.radius, scene.radius, scene.radius_factor)
    tension, _, sheared, twisted = edge_stresses(pressing, shear, twisting, bending, radius)
    return (0.0 - pressing, shear, abs(twisting), bending), (tension, sheared + twisted)


def _of_moved(sim, name):
    """Size of the vector of a field of the grains that are moved, one for each test, on every rank."""
    own, sizes = sim.grains.view("id"), np.zeros(len(TESTS))
    moved = own % 2 == 1
    sizes[own[moved] // 2] = np.sqrt((sim.grains.view(name)[moved] ** 2).sum(axis=1))
    return sim.comm.maximum(sizes)
