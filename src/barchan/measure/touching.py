"""Which contacts touch: each on exactly one rank, that of its first grain."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError

#: Contacts at a time: temporary arrays stay in the cache (measured: twice as fast) and memory is bounded.
BATCH = 16_384


class Pairs(NamedTuple):
    """Pairs of grains that touch, (k,) each: number of the contact, rows, overlap [length], normal force, positive when it parts
    them [force]; and (3, k) each: branch from the centre of the second to that of the first [length], force on the first
    [force]."""

    contact: np.ndarray
    first: np.ndarray
    second: np.ndarray
    overlap: np.ndarray
    normal_force: np.ndarray
    branch: np.ndarray
    force: np.ndarray


class AtWalls(NamedTuple):
    """Grains that touch walls, (k,) each: number of the contact among those with walls, row, and the rest as in ``Pairs``; the
    branch comes from the contact point, the foot of the centre on the wall."""

    contact: np.ndarray
    grain: np.ndarray
    overlap: np.ndarray
    normal_force: np.ndarray
    branch: np.ndarray
    force: np.ndarray


def check_contacts(sim):
    """Refuse contacts and forces that are out of date.

    Raises:
        SceneError: grains or walls were changed since the last run, or the state was restored and no step was made.
    """
    check_listed(sim)
    if not sim.is_primed:
        raise _changed(sim)


def check_listed(sim):
    """Refuse contacts whose grains are not those of the list. The forces on the grains may be out of date.

    Raises:
        SceneError: grains or walls were changed since the last run, or the state was restored and no step was made.
    """
    if not sim.is_listed:
        raise _changed(sim)
    check_computed(sim)


def check_computed(sim):
    """Refuse forces of contacts that do not exist yet.

    Raises:
        SceneError: the state was restored and no step was made.
    """
    if not sim.contacts.computed:
        raise SceneError(
            f"step {sim.step_number}: the contacts are not computed yet, since the state was restored, or bonds were installed; "
            f"run a step first"
        )


def _changed(sim):
    return SceneError(
        f"step {sim.step_number}: the scene was changed since its contacts were computed; call prepare() or run() "
        f"before measuring them"
    )


def touching_pairs(sim):
    """``Pairs`` of the present state, in batches."""
    contacts, place = sim.contacts, sim.grains.block("place", True)
    for begin in range(0, contacts.n_pairs, BATCH):
        some = slice(begin, min(begin + BATCH, contacts.n_pairs))
        first, second = contacts.first[some], contacts.second[some]
        one, other = np.take(place, first, axis=0), np.take(place, second, axis=0)
        branch = sim.box.difference(one[:, :3], other[:, :3]).T
        distance = np.sqrt(dot(branch, branch))
        overlap = one[:, 3] + other[:, 3] - distance
        found = np.flatnonzero((contacts.slot[some] > 0) & (first < sim.grains.n))
        force = contacts.forces(some)
        normal_force = dot(force, branch) / distance
        columns = (column[..., found] for column in (first, second, overlap, normal_force, branch, force))
        yield Pairs(begin + found, *columns)


def touching_walls(sim):
    """``AtWalls`` of the present state."""
    contacts = sim.contacts
    overlap = sim.grains.view("radius")[contacts.wall_grain] - contacts.surface[0]
    walls = slice(contacts.n_pairs, None)
    found = np.flatnonzero(contacts.slot[walls] > 0)
    force, normal = contacts.forces(walls)[:, found], contacts.surface[1:4, found]
    branch = normal * contacts.surface[0, found]
    return AtWalls(found, contacts.wall_grain[found], overlap[found], dot(force, normal), branch, force)


def dot(a, b):
    """Scalar products of vectors (3, k), added in a fixed order."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
