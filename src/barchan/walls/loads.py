"""What grains do to the walls of a scene: summed over all contacts and ranks when somebody asks."""

import math
from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.exact_sum import LIMBS, value_of
from barchan.kernels.loads import SUMS, sum_loads
from barchan.walls.response import response


class Load(NamedTuple):
    """What grains do to one wall.

    ``force``, ``torque``: on the wall, torque about its point, three numbers each [force, force length]. ``pressing``: sum of
    normal forces, positive when grains press [force]. ``stiffness``, ``viscosity``: how it changes with the place of the wall and
    with its speed towards the grains, while these do not move [force/length, force time/length]. ``contacts``: how many grains
    touch.
    """

    force: tuple
    torque: tuple
    pressing: float
    stiffness: float
    viscosity: float
    contacts: int


class Loads:
    """The loads of all walls of a simulation. The sums are exact: the same bits on any number of threads and ranks."""

    def __init__(self, sim):
        self._sim, self._known = sim, None

    def forget(self):
        """Forces are computed anew."""
        self._known = None

    def of(self, wall):
        """The ``Load`` of one of the walls; all ranks must ask.

        Raises:
            SceneError: the scene was changed since its contacts were computed.
        """
        self.keep()
        if self._known is None:
            raise SceneError(
                f"step {self._sim.step_number}: the scene was changed since its contacts were computed; call prepare() or run() "
                f"before asking what grains do to its walls"
            )
        return self._known[-1 - wall.key]

    def keep(self):
        """Sum them now, if forces are those of the present state: the list of contacts may be put away. All ranks must call."""
        sim = self._sim
        if not sim.is_primed:
            self._known = None
        elif self._known is None and sim.walls and sim.is_listed and sim.contacts.computed:
            self._known = self._sum()

    def _sum(self):
        sim = self._sim
        contacts, walls = sim.contacts, sim.walls
        limbs = np.zeros((len(walls), SUMS, LIMBS + 1), dtype=np.int64)
        points = np.array([wall.point for wall in walls])
        begin = np.array([0, *(end for _, end in contacts.wall_ranges)])
        state = (contacts.slot, contacts.out, contacts.surface, response(sim), contacts.wall_grain, sim.grains.block("place"))
        sum_loads(begin, contacts.n_pairs, *state, points, limbs)
        limbs = sim.comm.sum(limbs)
        sums = [[math.nan if row[-1] else value_of(row[:-1]) for row in rows] for rows in limbs]
        return [Load(tuple(row[:3]), tuple(row[3:6]), *row[6:9], int(row[9])) for row in sums]

    def state(self):
        """What a checkpoint keeps: plain numbers for each wall, or nothing where forces are not those of the state."""
        self.keep()
        return [[*load.force, *load.torque, *load[2:]] for load in self._known or ()]

    def restore(self, state):
        """Take up what ``state`` returned."""
        self._known = [Load(tuple(row[:3]), tuple(row[3:6]), *row[6:9], int(row[9])) for row in state] or None
