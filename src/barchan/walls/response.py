"""How stiff and how viscous the contacts at walls are, for any law: its own compiled loop, asked how the normal force changes."""

import numpy as np

#: Change of overlap, relative to it, over which the slope of the force is taken.
_STEP = 1e-3


def response(sim):
    """Slope of the normal force of each contact with a wall over its overlap, and over the speed at which they approach, for
    grains without a past: (2, wall contacts) [force/length, force time/length]; 0 where nothing touches."""
    contacts = sim.contacts
    answer = np.zeros((2, len(contacts.wall_grain)))
    found = np.flatnonzero(contacts.slot[contacts.n_pairs :] > 0)
    if not len(found):
        return answer
    force = _at_rest(sim, contacts, found)
    overlap = np.maximum(sim.grains.view("radius")[contacts.wall_grain[found]] - contacts.surface[0, found], 1e-12)
    speed = overlap / sim.dt  # of the size of what moves there
    alone = force(overlap, 0.0)
    answer[0, found] = (force(overlap * (1.0 + _STEP), 0.0) - alone) / (_STEP * overlap)
    answer[1, found] = (force(overlap, speed) - alone) / speed
    return np.maximum(answer, 0.0)


def _at_rest(sim, contacts, found):
    """A function of overlap and approaching speed: normal force of each grain alone before its wall, which is turned across x."""
    grains, count = sim.grains, len(found)
    rows = contacts.wall_grain[found]
    place, motion, spin, surface = grains.block("place")[rows], *np.zeros((2, count, 4)), np.zeros((11, count))
    motion[:, 3] = grains.view("inverse_mass")[rows]
    surface[1] = surface[4] = 1.0
    surface[10] = contacts.surface[10, found]
    out, marks = np.zeros((contacts.out_rows, 1 + count)), np.zeros(count, dtype=np.uint8)
    slot, history = np.zeros(count, dtype=np.uint32), np.zeros((contacts.history_width, 1 + count))
    materials = grains.block("material")[rows], contacts.wall_material[found]
    many = (np.uint32(len(sim.materials)), sim.table, slot, history, out, marks)
    room, zero = np.zeros((contacts.history_width, count)), np.uint64(0)
    state = (np.arange(count, dtype=np.uint32), surface, place, motion, spin, *materials, *many, room, zero, zero)

    def force(overlap, speed):
        slot[:] = 0
        surface[0], motion[:, 0] = place[:, 3] - overlap, -speed
        sim.loops.wall_forces(*state, 0.0, np.inf, np.inf)
        return out[0, slot]

    return force
