"""What grains do to the walls of a scene: summed over all contacts and ranks when somebody asks."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.exact_sum import LIMBS
from barchan.kernels.loads import SUMS, sum_by_wall, sum_loads, values_of
from barchan.walls.response import response


class Load(NamedTuple):
    """What grains do to one wall.

    ``force``, ``torque``: on the wall, torque about its point, three numbers each [force, force length]. ``pressing``: sum of
    normal forces, positive when grains press [force]. ``contacts``: how many grains touch.
    """

    force: tuple
    torque: tuple
    pressing: float
    contacts: int


class Response(NamedTuple):
    """How the normal forces on one wall change, while grains stay where they are, as it closes in: with the way, ``stiffness``
    [force/length], and with the speed, ``viscosity`` [force time/length]."""

    stiffness: float
    viscosity: float


class Loads:
    """The loads of all walls of a simulation. The sums are exact: the same bits on any number of threads and ranks."""

    def __init__(self, sim):
        self._sim, self._loads, self._responses = sim, None, None

    def forget(self):
        """Forces are computed anew."""
        self._loads = self._responses = None

    def of(self, wall):
        """The ``Load`` of one of the walls; all ranks must ask.

        Raises:
            SceneError: the scene was changed since its contacts were computed.
        """
        if self._loads is None and self._is_known:
            self._loads = self._sum_loads()
        return self._known(self._loads)[wall.number]

    def response_of(self, wall):
        """The ``Response`` of one of the walls; all ranks must ask. Raises what ``of`` raises."""
        if self._responses is None and self._is_known:
            self._responses = self._sum_responses()
        return self._known(self._responses)[wall.number]

    def keep(self):
        """Sum them now, if forces are those of the present state: the list of contacts may be put away. All ranks must call."""
        sim = self._sim
        if sim.walls and sim.comm.maximum([float(not sim.is_primed)])[0]:  # where one rank was edited, all are
            self.forget()
        elif sim.walls and self._is_known:
            self._loads = self._loads or self._sum_loads()
            self._responses = self._responses or self._sum_responses()

    @property
    def _is_known(self):
        sim = self._sim
        return sim.is_primed and sim.is_listed and sim.contacts.computed

    def _known(self, found):
        if found is None or not self._sim.is_primed:
            raise SceneError(
                f"step {self._sim.step_number}: the scene was changed since its contacts were computed; call prepare() or run() "
                f"before asking what grains do to its walls"
            )
        return found

    def _sum_loads(self):
        sim = self._sim
        contacts, points = sim.contacts, np.array([wall.point for wall in sim.walls])
        state = (contacts.slot, contacts.out, contacts.surface, contacts.wall_grain, sim.grains.block("place"))
        sums = self._sums(SUMS, lambda begin, limbs: sum_loads(begin, contacts.n_pairs, *state, points, limbs))
        return [Load(tuple(row[:3]), tuple(row[3:6]), row[6], int(row[7])) for row in sums]

    def _sum_responses(self):
        values = response(self._sim)
        return [Response(*row) for row in self._sums(2, lambda begin, limbs: sum_by_wall(begin, values, limbs))]

    def _sums(self, rows, accumulate):
        sim = self._sim
        limbs = np.zeros((len(sim.walls), rows, LIMBS + 1), dtype=np.int64)
        accumulate(np.array([0, *(end for _, end in sim.contacts.wall_ranges)]), limbs)
        sums = np.empty(limbs.shape[:2])
        values_of(sim.comm.sum(limbs), sums)
        return sums.tolist()

    def state(self):
        """What a checkpoint keeps: plain numbers for each wall, or nothing where forces are not those of the state."""
        self.keep()
        if self._loads is None or self._responses is None:
            return []
        return [[*load.force, *load.torque, *load[2:], *more] for load, more in zip(self._loads, self._responses)]

    def restore(self, state):
        """Take up what ``state`` returned."""
        self._loads = [Load(tuple(row[:3]), tuple(row[3:6]), row[6], int(row[7])) for row in state] or None
        self._responses = [Response(*row[SUMS:]) for row in state] or None
