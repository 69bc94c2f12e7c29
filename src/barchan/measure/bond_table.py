"""All bonds that hold, with what they carry."""

import numpy as np

from barchan.measure.touching import check_listed


def bond_table(sim, all_ranks=True):
    """Bonds that hold, each once, in ascending order of (first, second). All ranks must call this.

    Args:
        all_ranks: gather the bonds of all ranks on every rank.

    Returns:
        A dict of arrays, one row a bond: ``first``, ``second`` (ids), ``kind`` (number), ``strength`` (relative to that of the
        kind), ``distance`` of the centres [length], ``normal`` (k, 3) from the second to the first, ``point`` (k, 3) in the
        middle between the surfaces [length], ``force`` (k, 3) on the first [force], ``torque_first``, ``torque_second`` (k, 3)
        on the grains [force length], ``energy`` stored [force length], and by its name what the bond law remembers, (k,) or
        (k, 3).

    Raises:
        SceneError: the contacts were not computed since the scene was changed or restored.
    """
    check_listed(sim)
    bonds, grains = sim.bonds, sim.grains
    some = np.flatnonzero(bonds.holding & (bonds.first < grains.n))
    place, first, second = grains.block("place", True), bonds.first[some], bonds.second[some]
    branch = sim.box.difference(place[first, :3], place[second, :3])
    distance = np.sqrt((branch * branch).sum(axis=1))
    normal = branch / distance[:, None]
    gap = distance - place[first, 3] - place[second, 3]
    table = {
        "first": bonds.ids[some, 0],
        "second": bonds.ids[some, 1],
        "kind": bonds.kind[some],
        "strength": bonds.strength[some],
        "distance": distance,
        "normal": normal,
        "point": place[second, :3] + (place[second, 3] + 0.5 * gap)[:, None] * normal,
        "force": bonds.out[:3, some].T,
        "torque_first": bonds.out[3:6, some].T,
        "torque_second": bonds.out[6:, some].T,
        "energy": bonds.energies(grains, some),
    }
    row = 0
    for name, width in (bonds.law.history if bonds.law else {}).items():
        table[name] = bonds.history[row, some] if width == 1 else bonds.history[row : row + width, some].T
        row += width
    parts = sim.comm.all_gather(table) if all_ranks else [table]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in table}
    order = np.lexsort((joined["second"], joined["first"]))
    return {name: column[order] for name, column in joined.items()}
