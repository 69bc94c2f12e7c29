"""Cracks: each bond that broke, as an event."""

import numpy as np

from barchan.parallel.regroup import ById

#: What is known of a crack: column -> what it is.
COLUMNS = {
    "step": "of the break",
    "time": "of it [time]",
    "first": "id of one grain, the smaller",
    "second": "id of the other",
    "kind": "number of the kind of bond",
    "mode": "number of the mode, from 1 on, in the order of the law's ``modes``",
    "x": "of the middle between the surfaces, in the box [length]",
    "y": "",
    "z": "",
    "nx": "of the normal of the crack: from the second grain to the first",
    "ny": "",
    "nz": "",
    "energy": "that the bond stored as it broke [force length]",
}
_STEP, _FIRST, _SECOND = (list(COLUMNS).index(name) for name in ("step", "first", "second"))


class Cracks:
    """Cracks that were seen on this rank: ``values`` (k, columns), see ``COLUMNS``."""

    def __init__(self, values=None):
        self.values = np.zeros((0, len(COLUMNS))) if values is None else values

    def note(self, sim, bonds, some):
        """Add bonds, by their numbers, that broke in the present step; returns what they stored."""
        position, radius = (sim.grains.view(name, ghosts=True) for name in ("position", "radius"))
        first, second = bonds.first[some], bonds.second[some]
        branch = sim.box.difference(position[first], position[second])
        distance = np.sqrt((branch * branch).sum(axis=1, keepdims=True))
        normal = branch / distance
        gap = distance[:, 0] - radius[first] - radius[second]
        middle, _ = sim.box.wrap(position[second] + (radius[second] + 0.5 * gap)[:, None] * normal)
        when = np.tile([sim.step_number, sim.time], (len(some), 1))
        what = np.stack([bonds.kind[some], bonds.broken[some]], axis=1)
        energy = bonds.energies(sim.grains, some)[:, None]
        self.values = np.concatenate([self.values, np.hstack([when, bonds.ids[some], what, middle, normal, energy])])
        return energy

    def in_order(self, comm, over):
        """Those of all ranks, each rank a part: by ascending ids of the grains, and by step.

        Args:
            over: above all ids.

        Returns:
            ((m, columns) this rank's part, how many lower ranks have, how many all have).
        """
        parts = ById(comm, self.values[:, _FIRST].astype(np.int64), 0, over)
        values = parts.bring(self.values)
        return values[np.lexsort((values[:, _STEP], values[:, _SECOND], values[:, _FIRST]))], parts.begin, parts.total


def table(sim):
    """All cracks of all ranks, on every rank, which all must call: column -> array, see ``COLUMNS``; by ascending step, and then
    by the ids of the grains."""
    values = np.concatenate(sim.comm.all_gather(sim.bonds.cracks.values))
    values = values[np.lexsort((values[:, _SECOND], values[:, _FIRST], values[:, _STEP]))]
    return {name: values[:, column] for column, name in enumerate(COLUMNS)}
