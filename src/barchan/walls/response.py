"""What the law says of contacts at walls alone: each grain before its wall, without a past."""

import numpy as np

#: Change of overlap, relative to it, over which the slope of the force is taken.
_STEP = 1e-3

#: Overlap relative to the radius from which contacts are taken to be that deep: the slope of the force must have a size.
_LEAST = 1e-9


def response(sim):
    """Slope of the normal force of each contact with a wall over its overlap, and over the speed at which they approach, for
    grains without a past: (2, wall contacts) [force/length, force time/length]; 0 where nothing touches."""
    contacts = sim.contacts
    answer = np.zeros((2, len(contacts.wall_grain)))
    found = np.flatnonzero(contacts.slot[contacts.n_pairs :] > 0)
    if not len(found):
        return answer
    force, radius = alone(sim, found), sim.grains.view("radius")[contacts.wall_grain[found]]
    overlap = np.maximum(radius - contacts.surface[0, found], _LEAST * radius)
    speed = overlap / sim.dt  # of the size of what moves there
    at_rest = force(overlap, 0.0)
    answer[0, found] = (force(overlap * (1.0 + _STEP), 0.0) - at_rest) / (_STEP * overlap)
    answer[1, found] = (force(overlap, speed) - at_rest) / speed
    return np.maximum(answer, 0.0)


def alone(sim, some):
    """Normal forces of contacts with walls, by the compiled loop of the law: each grain stands alone before its wall, which is
    turned across x, and approaches it.

    Args:
        some: (k,) numbers of the contacts among those with walls.

    Returns:
        Function (overlap (k,) [length], speed [length/time]) -> normal forces (k,) [force].
    """
    grains, contacts, count = sim.grains, sim.contacts, len(some)
    rows = contacts.wall_grain[some]
    place, motion, spin, surface = grains.block("place")[rows], *np.zeros((2, count, 4)), np.zeros((11, count))
    motion[:, 3] = grains.view("inverse_mass")[rows]
    surface[1] = surface[4] = 1.0
    surface[10] = contacts.surface[10, some]
    out, marks = np.zeros((contacts.out_rows, 1 + count)), np.zeros(count, dtype=np.uint8)
    slot, history = np.zeros(count, dtype=np.uint32), np.zeros((contacts.history_width, 1 + count))
    materials = grains.block("material")[rows], contacts.wall_material[some]
    many = (np.uint32(len(sim.materials)), sim.table, slot, history, out, marks)
    room, zero = np.zeros((contacts.history_width, count)), np.uint64(0)
    state = (np.arange(count, dtype=np.uint32), surface, place, motion, spin, *materials, *many, room, zero, zero)

    def force(overlap, speed):
        slot[:] = 1  # it has begun, and may last beyond touching
        surface[0], motion[:, 0] = place[:, 3] - overlap, -speed
        sim.loops.wall_forces(*state, 0.0, np.inf, np.inf)
        return out[0, slot]

    return force
