"""Energy stored in the normal force of contacts, for any law: its own compiled loop, integrated.

W = integral of F_n from 0 to the overlap, with the force of grains at rest and no memory. With overlap = depth u^2 the
force of every law made of half-integer powers of it is a polynomial in u, and the quadrature of Gauss and Legendre with
three points is exact up to the power 2: for the laws shipped here the only error is rounding, 1e-15 R/overlap. For a user's
law with a kink, such as a spring that changes its stiffness, the error is that of the quadrature. A law whose
normal force has a memory has no such energy; what comes out then means nothing.
"""

import numpy as np

from barchan.kernels.lanes import LANES
from barchan.kernels.template import block_rooms, whole_blocks
from barchan.measure.touching import touching_pairs, touching_walls
from barchan.walls.response import alone

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)

#: Points on (0, 1): overlap relative to the full one, and weight of the force there in units of the full overlap.
_POINTS = tuple(((0.5 + 0.5 * x) ** 2, w * (0.5 + 0.5 * x)) for x, w in zip(_NODES.tolist(), _WEIGHTS.tolist()))


def elastic_energies(sim):
    """Energies of this rank's contacts that touch, each contact on one rank, (k,) [force length]."""
    return np.concatenate(
        [
            *(_of_pairs(sim, pairs) for pairs in touching_pairs(sim)),
            _of_walls(sim, touching_walls(sim)),
        ]
    )


def _integral(force, overlap):
    """Integral of ``force`` from 0 to ``overlap`` (k,)."""
    return overlap * sum(weight * force(part * overlap) for part, weight in _POINTS)


def _columns(sim, count):
    """Columns for contacts without memory: slot, history, forces, and marks of their grains."""
    slot, width = _for_lanes(np.zeros(count, dtype=np.uint32)), sim.contacts.history_width
    out, marks = np.zeros((sim.contacts.out_rows, 1 + count)), np.zeros(2 * count, dtype=np.uint8)
    return slot, np.zeros((width, 1 + whole_blocks(count))), out, marks


def _for_lanes(values):
    """The same, with memory behind it for those that are looked at beside the last."""
    return np.concatenate([values, np.zeros(LANES, values.dtype)])[: len(values)]


def _of_pairs(sim, pairs):
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

    def force(overlap):
        place[::2, 0] = touch - overlap
        sim.loops.pair_forces(*state, np.zeros(3), np.full(3, np.inf), 0.0, np.inf, np.inf)
        return columns[-2][0, slot]

    return _integral(force, pairs.overlap)


def _of_walls(sim, at_walls):
    """Each grain at rest before its wall."""
    force = alone(sim, at_walls.contact)
    return _integral(lambda overlap: force(overlap, 0.0), at_walls.overlap)
