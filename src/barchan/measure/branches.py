"""The branches of all contacts and bonds: what lies between the centres, or between a centre and the boundary of the sample."""

from typing import NamedTuple

import numpy as np

from barchan.measure.touching import touching_pairs, touching_walls


class Branches(NamedTuple):
    """Branches of this rank's contacts and bonds, each on one rank, (3, k) each.

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
    if sim.bonds.active:
        found.append(_of_bonds(sim))
    return Branches(*(np.concatenate(parts, axis=1) for parts in zip(*found)))


def _of_pairs(sim, pairs):
    radius = sim.grains.view("radius", True)
    arm = radius[pairs.first] - 0.5 * pairs.overlap
    share = arm / (radius[pairs.first] + radius[pairs.second] - pairs.overlap)
    return _between_grains(sim, pairs.first, pairs.second, share, pairs.branch, pairs.force)


def _of_bonds(sim):
    bonds, place = sim.bonds, sim.grains.block("place", True)
    some = np.flatnonzero(bonds.holding & (bonds.first < sim.grains.n))
    first, second = bonds.first[some], bonds.second[some]
    share = place[first, 3] / (place[first, 3] + place[second, 3])
    branch = sim.box.difference(place[first, :3], place[second, :3]).T
    return _between_grains(sim, first, second, share, branch, bonds.out[:3, some])


def _between_grains(sim, first, second, share, branch, force):
    """Start, branch and force of some pairs, that meet at a ``share`` of the branch; of a frozen grain's half nothing is left."""
    position, frozen = sim.grains.view("position", True), sim.grains.view("frozen", True)
    begin, end = np.where(frozen[first], share, 0.0), np.where(frozen[second], share, 1.0)
    return position[first].T - begin * branch, (end - begin) * branch, force
