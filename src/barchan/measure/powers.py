"""The power of all forces at the present step, by kind: what acts on the grains, and where it comes from or goes to.

The force of a contact has three parts. What its grains would feel at rest, without a memory, is the *normal* part, for which the
law is asked once more, by its compiled loop; what is more along the normal is that of *dashpots*; all the rest is *tangential*.
Each part is summed by grain as forces are, and meets velocities of the full step; walls and frozen grains move as they are told,
and what they give is *walls*.
"""

from typing import NamedTuple

import numpy as np

from barchan.forces import Gravity
from barchan.kernels.couples import add_couples
from barchan.kernels.gather import gather_forces
from barchan.kernels.lanes import LANES
from barchan.kernels.template import block_rooms, whole_blocks
from barchan.measure.base import full_step, squared
from barchan.measure.sums import exact_sums


class Powers(NamedTuple):
    """Power on the grains, negative where it takes from them [force length/time]: of gravity, of walls and frozen grains that
    move, of contacts, of ``Simulation.damping``, of bonds, and of a box that is stretched, by contacts, bonds and motion."""

    gravity: float
    walls: float
    normal: float
    tangential: float
    dashpots: float
    damping: float
    bonds: float
    box: float


def powers(sim):
    """The ``Powers`` of the present step, of which forces must be known; all ranks must call."""
    grains, contacts = sim.grains, sim.contacts
    velocity, omega = full_step(sim, slice(None))
    flows, at_surface = grains.view("frozen") == 0, contacts.surface[7:10]
    gravity = grains.view("mass")[:, None] * np.array(Gravity(sim.gravity).at(sim.time))

    def of(out):
        """Power of some parts of all contacts, by grain and by contact with a wall, whose surface moves."""
        force, torque = _gathered(sim, out)
        at_walls, stretched = out[:3, contacts.slot[contacts.n_pairs :]], _power(out[:3, contacts.slot[pairs]].T, parting)
        by_grain = _power(force, velocity) + _power(torque, omega)
        return force, torque, by_grain, np.concatenate([(at_walls * at_surface).sum(axis=0), -stretched])

    pairs, parting = _parted(sim, contacts.first, contacts.second, contacts.slot[: contacts.n_pairs] > 0)
    force, torque, by_grain, by_wall = of(contacts.out)
    others = [of(out)[2:] for out in (_along_normals(sim), _at_rest(sim))]
    within = [np.concatenate([grain, -wall]) for grain, wall in ((by_grain, by_wall), *others)]
    by_wall, by_box = np.split(by_wall, [len(contacts.wall_grain)])
    of_bonds = sim.bonds.sums(grains.n)
    by_bonds = _power(of_bonds[0], velocity) + _power(of_bonds[1], omega)
    bonds, parting = _parted(sim, sim.bonds.first, sim.bonds.second, sim.bonds.holding)
    bonds_by_box = -_power(sim.bonds.out[:3, bonds].T, parting)
    no_walls = np.zeros(len(by_wall))
    force, torque = force + of_bonds[0], torque + of_bonds[1]
    total = _power(grains.view("force") - force - gravity, velocity) + _power(grains.view("torque") - torque, omega)
    columns = [
        np.concatenate([np.where(flows, _power(gravity, velocity), 0.0), no_walls]),
        np.concatenate([np.where(flows, 0.0, -by_grain - by_bonds), by_wall]),
        np.concatenate([np.where(flows, total, 0.0), no_walls]),
        np.concatenate([by_bonds, no_walls]),
    ]
    motion = -_power(grains.view("mass")[:, None] * velocity, velocity @ sim.box.gradient.T)
    of_box = np.concatenate([by_box, bonds_by_box, np.where(flows, motion, 0.0)])
    actual, along, normal = exact_sums(within, sim.comm)[:, 0].tolist()
    of_gravity, of_walls, damping, bonds = exact_sums(columns, sim.comm)[:, 0].tolist()
    box, of_bonds = (float(exact_sums([terms], sim.comm)[0, 0]) for terms in (of_box, bonds_by_box))
    return Powers(of_gravity, of_walls, normal, actual - along, along - normal, damping, bonds - of_bonds, box)


def _parted(sim, first, second, some):
    """Numbers of ``some`` pairs, of which this rank owns the first grain, and how fast the box parts their centres, (k, 3)."""
    chosen, place = np.flatnonzero(some & (first < sim.grains.n)), sim.grains.block("place", True)
    if not sim.box.moves:
        chosen = chosen[:0]
    return chosen, sim.box.difference(place[first[chosen], :3], place[second[chosen], :3]) @ sim.box.gradient.T


def _power(force, velocity):
    """Scalar products of vectors (k, 3), added in a fixed order."""
    (fx, fy, fz), (vx, vy, vz) = force.T, velocity.T
    return fx * vx + fy * vy + fz * vz


def _gathered(sim, out):
    """Force and torque of all contacts on each grain, (n, 3) each, from their columns."""
    grains, contacts = sim.grains, sim.contacts
    lists = (contacts.start, contacts.touched, contacts.incidence, contacts.slot, out)
    force, torque = (np.empty_like(grains.block(name)) for name in ("force", "torque"))
    gather_forces(*lists, grains.block("place"), grains.block("mass"), np.zeros(3), force, torque)
    if contacts.couple:
        add_couples(*lists, torque)
    return force, torque


def _along_normals(sim):
    """The columns of all contacts, of normal forces alone."""
    contacts, place = sim.contacts, sim.grains.block("place", True)
    touching = np.flatnonzero(contacts.slot)
    pairs, walls = touching[touching < contacts.n_pairs], touching[touching >= contacts.n_pairs] - contacts.n_pairs
    branch = sim.box.difference(place[contacts.first[pairs], :3], place[contacts.second[pairs], :3])
    normal = np.concatenate([branch / np.sqrt(squared(branch))[:, None], contacts.surface[1:4, walls].T])
    out, columns = np.zeros_like(contacts.out), contacts.slot[touching]
    out[:3, columns] = (_power(contacts.out[:3, columns].T, normal)[:, None] * normal).T
    return out


def _at_rest(sim):
    """The columns of all contacts, had their grains and walls no velocity, and they no memory."""
    grains, contacts, frame = sim.grains, sim.contacts, sim.box.frame
    place, motion, spin, material = (grains.block(name, True) for name in ("place", "motion", "spin", "material"))
    motion, spin, surface = motion.copy(), spin.copy(), contacts.surface.copy()
    motion[:, :3], spin[:, :3], surface[4:7], surface[7:10] = 0.0, 0.0, surface[1:4], 0.0
    slot = np.concatenate([contacts.slot, np.zeros(LANES, np.uint32)])[: len(contacts.slot)]  # lanes look beside the last
    history, out, changed = (np.zeros_like(array) for array in (contacts.history, contacts.out, contacts.changed))
    width = contacts.history_width
    law = (np.uint32(len(sim.materials)), sim.table, slot, history, out, changed)
    still = (0.0, np.inf, np.inf)  # no time passes, and no overlap is too large
    for begin, end in contacts.parts:
        if begin < end:
            parts, *rooms = block_rooms(end, width, begin)
            pairs = (parts, contacts.first, contacts.second, np.uint32(grains.n), place, motion, spin, material)
            sim.loops.pair_forces(*pairs, *law, *rooms, frame.length, frame.half, frame.tilt, np.zeros(6), *still)
    count = len(contacts.wall_grain)
    if count:
        walls = (contacts.wall_grain, surface, place, motion, spin, material, contacts.wall_material)
        columns = (np.empty((width, count)), np.uint64(contacts.n_pairs), np.uint64(whole_blocks(contacts.n_pairs)))
        sim.loops.wall_forces(*walls, *law, *columns, *still)
    return out
