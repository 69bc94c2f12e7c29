"""Contacts in figures: how many, how deep, how strong."""

import numpy as np

from barchan.measure.base import Result
from barchan.measure.coordination import coordination
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts, touching_pairs, touching_walls


class ContactStatistics:
    """Contacts that touch, of grains with grains and with walls; each counts once.

    All results are 0 when there are no contacts.
    """

    count = Result("number of contacts")
    coordination = Result(
        "mean number of contacts of a grain that is not frozen; one with a wall or a frozen grain counts for the moving one only"
    )
    largest_overlap = Result("largest overlap relative to the smaller diameter")
    mean_normal_force = Result("mean normal force of a contact, positive when it pushes apart [force]")

    def compute(self, sim):
        """Measure; returns self.

        Raises:
            SceneError: grains or walls were changed since the last run.
        """
        check_contacts(sim)
        radius = sim.grains.view("radius", True)
        at_walls = touching_walls(sim)
        relative, forces = [at_walls.overlap / (2.0 * radius[at_walls.grain])], [at_walls.normal_force]
        for pairs in touching_pairs(sim):
            relative.append(pairs.overlap / (2.0 * np.minimum(radius[pairs.first], radius[pairs.second])))
            forces.append(pairs.normal_force)
        relative, forces = np.concatenate(relative), np.concatenate(forces)
        self.count = int(sim.comm.sum([len(forces)])[0])
        self.coordination = coordination(sim).plain
        self.largest_overlap = float(sim.comm.maximum([relative.max(initial=0.0)])[0])
        self.mean_normal_force = float(exact_sums((forces,), sim.comm)[0, 0]) / max(self.count, 1)
        return self
