"""The branches of all contacts: what lies between the centres, or between a centre and the boundary of the sample."""

from typing import NamedTuple

import numpy as np

from barchan.measure.touching import touching_pairs, touching_walls


class Branches(NamedTuple):
    """Branches of this rank's contacts, each contact on one rank, (3, k) each.

    A branch reaches from ``start``, the centre of the first grain, against ``branch`` to the centre of the second [length];
    ``force`` acts on the first [force]. Walls and frozen grains are the boundary of the sample: there the branch ends at the
    contact point, on the wall or in the middle of the overlap. Ends may lie beyond a periodic face.
    """

    start: np.ndarray
    branch: np.ndarray
    force: np.ndarray


def branches(sim):
    """``Branches`` of the present state."""
    at_walls = touching_walls(sim)
    found = [(sim.grains.view("position")[at_walls.grain].T, at_walls.branch, at_walls.force)]
    found += [_of_pairs(sim, pairs) for pairs in touching_pairs(sim)]
    return Branches(*(np.concatenate(parts, axis=1) for parts in zip(*found)))


def _of_pairs(sim, pairs):
    """Start, branch and force of some pairs; of a frozen grain's half nothing is left."""
    place, frozen = sim.grains.block("place", True), sim.grains.view("frozen", True)
    radius = place[:, 3]
    arm = radius[pairs.first] - 0.5 * pairs.overlap
    contact = arm / (radius[pairs.first] + radius[pairs.second] - pairs.overlap)
    begin, end = np.where(frozen[pairs.first], contact, 0.0), np.where(frozen[pairs.second], contact, 1.0)
    return place[pairs.first, :3].T - begin * pairs.branch, (end - begin) * pairs.branch, pairs.force
