"""Bonds go where their grains go, and ghosts follow them however far the grains part.

Each holder of a bond knows who owns the other grain. So before grains migrate, the two tell each other where theirs go, with one
message between ranks that share bonds; nobody has to be searched for.
"""

import numpy as np

from barchan.bonds.bonds import rows_of
from barchan.bonds.cracks import Cracks
from barchan.errors import CheckpointError
from barchan.parallel.guard import raise_together
from barchan.parallel.mapping import Mapping, by_rank


def migrate(comm, bonds, ids, owner, partners):
    """Each bond to the ranks that will own its grains.

    Args:
        bonds: ``Bonds``; modified. Broken ones are dropped.
        ids, owner: (n,) of this rank's grains, and where they go.
        partners: ranks that grains may go to, as ``parallel.migrate`` has them.
    """
    bonds.forget_broken()
    if comm.size == 1 or not bonds.active:
        return
    mine = bonds.owners == comm.rank
    new = np.where(mine, 0, -1).astype(np.int32)
    new[mine] = owner[rows_of(ids, bonds.ids[mine])]
    _tell_partners(comm, bonds, mine, new)
    leaves = [mine[:, side] & (new[:, [side]] != bonds.owners).all(axis=1) for side in (0, 1)]  # to a rank that has it not
    leaves[1] &= new[:, 0] != new[:, 1]  # both to one rank: the owner of the first sends it
    side, rows = np.nonzero(np.array(leaves))
    travel = Mapping.define(comm, by_rank(new[rows, side]), partners)
    travel.push(bonds.ids[rows]).push(new[rows]).push(bonds.values()[rows]).send()
    arrived = [travel.pop().copy() for _ in range(3)]
    staying = (new == comm.rank).any(axis=1)
    bonds.owners = new
    bonds.keep(staying)
    bonds.add(*arrived)


def _tell_partners(comm, bonds, mine, new):
    """Where the other grains of bonds go, as their owners tell; ``new`` is modified."""
    across = np.flatnonzero(~mine.all(axis=1))
    across = across[np.lexsort((bonds.ids[across, 1], bonds.ids[across, 0]))]  # in the order of the other rank, too
    here, there = np.where(mine[across, 0], 0, 1), np.where(mine[across, 0], 1, 0)
    sends = by_rank(bonds.owners[across, there])
    told = Mapping(comm, sends, {rank: len(rows) for rank, rows in sends.items()}).push(new[across, here]).send().pop()
    asked = np.concatenate([np.zeros(0, dtype=np.int64), *sends.values()])
    new[across[asked], there[asked]] = told


def sends(comm, bonds, grains):
    """Rank -> ascending rows of this rank's grains that are bonded to grains there."""
    found = {}
    for side in (0, 1) if comm.size > 1 and len(bonds) else ():
        across = (bonds.owners[:, side] == comm.rank) & (bonds.owners[:, 1 - side] != comm.rank)
        rows = rows_of(grains.view("id"), bonds.ids[across, side]).astype(np.int64)
        for rank, some in by_rank(bonds.owners[across, 1 - side]).items():
            found[rank] = np.union1d(found.get(rank, rows[:0]), rows[some])
    return found


def wanted(bonds, grains):
    """(ghosts,) bool: those that are bonded to a grain of this rank."""
    return np.isin(grains.view("id", ghosts=True)[grains.n :], bonds.ids)


def deal(comm, bonds, ids, owner, state):
    """Give bonds from a file to the owners of their grains; they take the place of those that there are.

    Args:
        bonds: ``Bonds``; modified.
        ids, owner: (n,) of grains that this rank has read, and where they go.
        state: ``checkpoint.State`` of these grains.
    """
    bonds.clear()
    bonds.active, bonds.cracks = state.about["bonds"]["active"], Cracks(state.cracks)
    if not bonds.active:
        return
    rows, over = state.bonds, state.about["next_id"]
    first, others = np.repeat(np.arange(len(ids)), np.diff(rows.start)), _ask(comm, ids, owner, rows.keys, over)
    missing = rows.keys[others < 0]
    error = CheckpointError(f"the checkpoint has a bond with grain {missing[0]}, which is not in it") if len(missing) else None
    raise_together(comm, error)
    both = np.stack([owner[first], others], axis=1).astype(np.int32)
    pairs = np.stack([ids[first], rows.keys], axis=1)
    numbers = np.arange(len(pairs))
    apart = numbers[both[:, 0] != both[:, 1]]
    chosen, to = np.concatenate([numbers, apart]), np.concatenate([both[:, 0], both[apart, 1]])
    travel = Mapping.define(comm, by_rank(to))
    travel.push(pairs[chosen]).push(both[chosen]).push(rows.values[chosen]).send()
    bonds.add(*(travel.pop().copy() for _ in range(3)))


def _ask(comm, ids, owner, wanted, over):
    """Where the grains with the ``wanted`` ids go, -1 if there is none; rank id * size // over knows."""
    register = Mapping.define(comm, by_rank(ids * comm.size // over))
    known, to = register.push(ids).push(owner).send().pop().copy(), register.pop().copy()
    question = Mapping.define(comm, by_rank(wanted * comm.size // over))
    asked = question.push(wanted).send().pop()
    there = np.isin(asked, known)
    answer = np.full(len(asked), -1)
    answer[there] = to[rows_of(known, asked[there])]
    found = np.empty(len(wanted), dtype=np.int64)
    found[question.rows] = question.reverse().push(answer).send().pop()
    return found
