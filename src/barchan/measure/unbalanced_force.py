"""How far a sample is from equilibrium."""

import math

import numpy as np

from barchan.measure.base import flowing_rows, squared
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts, dot, touching_pairs, touching_walls


def unbalanced_force(sim):
    """Mean resultant force of the grains that are not frozen over mean force of the contacts, with grains and with walls, and of
    the bonds.

    Both are means of magnitudes. The resultant is that of the next kick, with contacts, gravity and all. It tends to 0 as the
    sample comes to rest; infinite without forces in them.

    Raises:
        SceneError: grains or walls were changed since the last run.
    """
    check_contacts(sim)
    bonds = sim.bonds
    forces = [touching_walls(sim).force, *(pairs.force for pairs in touching_pairs(sim))]
    if len(bonds):
        forces.append(bonds.out[:3, bonds.holding & (bonds.first < sim.grains.n)])
    forces = np.concatenate(forces, axis=1)
    contact = exact_sums((np.sqrt(dot(forces, forces)), np.ones(forces.shape[1])), sim.comm)[:, 0]
    resultants = np.sqrt(squared(sim.grains.view("force")[flowing_rows(sim)]))
    resultant = exact_sums((resultants, np.ones(len(resultants))), sim.comm)[:, 0]
    if contact[0] == 0.0:
        return math.inf
    return float(resultant[0] / max(resultant[1], 1.0) / (contact[0] / contact[1]))
