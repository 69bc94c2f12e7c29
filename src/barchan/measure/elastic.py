"""Energy stored in contacts: what the law tells of each, or the integral of its normal force.

A law's own ``energy`` knows its springs, too. Of a law without, the normal force is integrated: W = integral of F_n from 0 to the
overlap, with the force of grains at rest and no memory, by the law's compiled loop. With overlap = depth u^2 the
force of every law made of half-integer powers of it is a polynomial in u, and the quadrature of Gauss and Legendre with
three points is exact up to the power 2. For a law with a kink, such as a spring that changes its stiffness, the error is
that of the quadrature. A law whose normal force has a memory has no such energy; what comes out then means nothing.
"""

import numpy as np

from barchan.kernels.lanes import LANES
from barchan.kernels.template import LEAST_OVERLAP, block_rooms, whole_blocks
from barchan.measure.touching import touching_pairs, touching_walls
from barchan.walls.response import alone

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)

#: Points on (0, 1): overlap relative to the full one, and weight of the force there in units of the full overlap.
_POINTS = tuple(((0.5 + 0.5 * x) ** 2, w * (0.5 + 0.5 * x)) for x, w in zip(_NODES.tolist(), _WEIGHTS.tolist()))


def elastic_energies(sim):
    """Energies of this rank's contacts that touch, each contact on one rank: in the normal force and in tangential springs,
    (2, k) [force length]; without an energy of the law's own, none in springs."""
    of_pairs, of_walls = (_of_pairs, _of_walls) if sim.loops.energies is None else (_told_of_pairs, _told_of_walls)
    memory = sim.contacts.memory()
    found = [of_pairs(sim, pairs, memory) for pairs in touching_pairs(sim)]
    return np.concatenate([*found, of_walls(sim, touching_walls(sim), memory)], axis=1)


def _told_of_pairs(sim, pairs, memory):
    material, radius = (sim.grains.view(name, True) for name in ("material", "radius"))
    one, other = radius[pairs.first], radius[pairs.second]
    effective, materials = one * other / (one + other), (material[pairs.first], material[pairs.second])
    return _told(sim, pairs.overlap, (one, other, effective), materials, memory[:, pairs.contact])


def _told_of_walls(sim, at_walls, memory):
    radius, contacts = sim.grains.view("radius")[at_walls.grain], sim.contacts
    effective = radius / (1.0 + contacts.surface[10, at_walls.contact] * radius)
    materials = sim.grains.view("material")[at_walls.grain], contacts.wall_material[at_walls.contact]
    return _told(sim, at_walls.overlap, (radius, radius, effective), materials, memory[:, contacts.n_pairs + at_walls.contact])


def _told(sim, overlap, radii, materials, memory):
    """By the law's own loop."""
    least = -np.inf if sim.law.reach else LEAST_OVERLAP
    pair = (materials[0].astype(np.int64) * len(sim.materials) + materials[1]).astype(np.int64)
    energies = np.empty((2, len(overlap)))
    radii = (np.ascontiguousarray(radius) for radius in radii)
    sim.loops.energies(np.maximum(overlap, least), *radii, pair, sim.table, np.ascontiguousarray(memory), energies)
    return energies


def _integral(force, overlap):
    """Integral of ``force`` from 0 to ``overlap`` (k,), and nothing in springs, (2, k)."""
    work = overlap * sum(weight * force(part * overlap) for part, weight in _POINTS)
    return np.stack([work, 0.0 * work])


def _columns(sim, count):
    """Columns for contacts without memory, that have begun: slot, history, forces, and marks of their grains."""
    slot, width = _for_lanes(np.ones(count, dtype=np.uint32)), sim.contacts.history_width
    out, marks = np.zeros((sim.contacts.out_rows, 1 + count)), np.zeros(2 * count, dtype=np.uint8)
    return slot, np.zeros((width, 1 + whole_blocks(count))), out, marks


def _for_lanes(values):
    """The same, with memory behind it for those that are looked at beside the last."""
    return np.concatenate([values, np.zeros(LANES, values.dtype)])[: len(values)]


def _of_pairs(sim, pairs, _):
    """Grain 2 c stands alone with grain 2 c + 1, along x and at rest."""
    grains, count = sim.grains, len(pairs.first)
    rows = np.stack([pairs.first, pairs.second], axis=1).ravel()
    place, motion, spin = np.zeros((3, 2 * count, 4))
    place[:, 3], motion[:, 3] = grains.view("radius", True)[rows], grains.view("inverse_mass", True)[rows]
    material, touch = grains.block("material", True)[rows], place[::2, 3] + place[1::2, 3]
    slot, *columns = _columns(sim, count)
    first, second = (_for_lanes(np.arange(side, 2 * count, 2, dtype=np.uint32)) for side in (0, 1))
    parts, *rooms = block_rooms(count, sim.contacts.history_width)
    candidates = (parts, first, second, np.uint32(2 * count))
    state = (*candidates, place, motion, spin, material, np.uint32(len(sim.materials)), sim.table, slot, *columns, *rooms)

    no_box = np.zeros(3), np.full(3, np.inf), np.zeros(3), np.zeros(6)

    def force(overlap):
        place[::2, 0] = touch - overlap
        sim.loops.pair_forces(*state, *no_box, 0.0, np.inf, np.inf)
        return columns[-2][0, slot]

    return _integral(force, pairs.overlap)


def _of_walls(sim, at_walls, _):
    """Each grain at rest before its wall."""
    force = alone(sim, at_walls.contact)
    return _integral(lambda overlap: force(overlap, 0.0), at_walls.overlap)
