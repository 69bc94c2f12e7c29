"""Grains that crossed into another rank's part of space move there, with all their fields and remembered contacts."""

import numpy as np

from barchan.errors import LostGrainError
from barchan.kernels.history import NOWHERE
from barchan.neighbors.contacts import NOTHING
from barchan.neighbors.rows import ContactRows
from barchan.parallel.mapping import Mapping, by_rank


def rehome(comm, owner, partners, grains, contacts, rows):
    """Every grain to its owner, with what it remembers of its contacts.

    Args:
        owner, partners: as ``destinations`` returns them.
        grains: modified; ghosts are dropped.
        contacts: the list, which is put aside; None if there is none.
        rows: ``ContactRows`` of the grains, if there is no list.

    Returns:
        (``ContactRows`` of the grains that are owned now: all, or with a list those of grains that came; what is ``Remembered``
        of the list; the row in it of each grain that is owned now, or ``NOWHERE``).
    """
    if contacts is None:
        known, origin = NOTHING, np.full(grains.n, NOWHERE)
    else:
        leaving = owner != comm.rank
        rows, known = contacts.detach(leaving, on_both=True), contacts.put_aside(leaving)
        origin = np.arange(grains.n, dtype=np.uint32)
    grains.drop_ghosts()
    if comm.size > 1:
        rows, moved = migrate(comm, owner, grains, rows, partners)
        origin = np.full(grains.n, NOWHERE) if contacts is None else moved
    return rows, known, origin


def destinations(comm, topology, grains, reach):
    """Where the grains of this rank have to go: to the rank that owns their place.

    Args:
        reach: how near ranks are to each other [length] that are looked among first.

    Returns:
        ((n,) rank of each grain, partners as ``migrate`` takes them: those within reach, unless a grain has further to go).
    """
    if comm.size == 1:
        return np.broadcast_to(comm.rank, grains.n), None
    owner, near = topology.owner(grains.view("position")), topology.neighbours(comm.rank, reach)
    leaving = owner[owner != comm.rank]
    far = bool(np.isin(leaving, near, invert=True).any())
    return owner, None if comm.maximum([float(far)])[0] else near


def migrate(comm, owner, grains, rows, partners=None):
    """Send every owned grain to its owner: one message a rank with all fields, one with the contacts.

    Args:
        owner: (n,) rank of each grain.
        grains: ``Grains`` without ghosts; modified.
        rows: ``ContactRows`` of its grains.
        partners: ranks within reach, if no grain of any rank goes further (local mapping); None: any rank (global).

    Returns:
        (rows of the grains that are owned now, the row that each was, ``NOWHERE`` of one that came).

    Raises:
        LostGrainError: the number of grains over all ranks has changed.
    """
    before = grains.n
    leaving = by_rank(owner, but=comm.rank)
    travel = Mapping.define(comm, leaving, partners)
    counts = np.diff(rows.start)
    for name in grains.block_names:
        travel.push(grains.block(name))
    travel.push(counts).send()
    staying = grains.take_out(owner != comm.rank)
    arrived = {name: travel.pop() for name in grains.block_names}
    grains.append_rows(arrived, travel.n_received)
    joined = ContactRows.join([rows.take(staying), move_rows(travel, rows, travel.pop())])
    moved = comm.sum([before, grains.n])
    if moved[0] != moved[1]:
        raise LostGrainError(
            f"{moved[0]} grains before the migration, {moved[1]} after it: an error of barchan, please report it"
        )
    return joined, np.concatenate([staying, np.full(travel.n_received, NOWHERE)]).astype(np.uint32)


def move_rows(travel, rows, counts):
    """Contacts of the grains that ``travel``; those that arrive are ``counts`` for each grain."""
    sends = {rank: _row_numbers(rows.start, grains) for rank, grains in travel.sends.items()}
    ends = np.cumsum([0, *travel.receives.values()])
    receives = {source: int(counts[a:b].sum()) for source, a, b in zip(travel.receives, ends[:-1], ends[1:])}
    contacts = Mapping(travel.comm, sends, receives).push(rows.keys).push(rows.values).send()
    return ContactRows(np.concatenate([[0], np.cumsum(counts)]), contacts.pop().copy(), contacts.pop().copy())


def _row_numbers(start, grains):
    """Numbers of the rows of the given grains, one grain after another."""
    counts = start[grains + 1] - start[grains]
    first = np.repeat(start[grains] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    return first + np.arange(counts.sum())
