"""What lies around a rank's grains further away than its ghosts: others' grains and periodic images, copied for once."""

from itertools import product

import numpy as np

from barchan.domain import SHEARS
from barchan.parallel.mapping import Mapping


def surroundings(box, comm, place, ids, margin):
    """Copies of all grains, and periodic images of them, within ``margin`` [length] of the brick around this rank's grains.

    All ranks must call this. Unlike ghosts, images are shifted. Those of one grain follow on one another in one order on all
    ranks, the grain itself first.

    Args:
        box: the ``Box``.
        place: (n, 4) positions and radii of this rank's grains [length].
        ids: (n,) theirs.

    Returns:
        Places and ids of the copies, (k, 4) and (k,), without this rank's own grains where they are.
    """
    low, high = place[:, :3].min(axis=0, initial=np.inf), place[:, :3].max(axis=0, initial=-np.inf)
    bricks = np.array(comm.all_gather((low - margin, high + margin)))
    shifts = _shifts(box, margin)
    images = np.concatenate([place + np.append(shift, 0.0) for shift in shifts])
    near = [_ranks_near(bricks, low, high, shift) for shift in shifts]
    sends = {}
    for rank in np.unique(np.concatenate(near)).tolist():
        inside = ((images[:, :3] >= bricks[rank, 0]) & (images[:, :3] <= bricks[rank, 1])).all(axis=1)
        inside[: len(place)] &= rank != comm.rank
        sends[rank] = np.flatnonzero(inside)
    own = sends.pop(comm.rank, np.zeros(0, dtype=np.int64))
    travels = Mapping.define(comm, sends)
    numbers = np.tile(ids, len(shifts))
    travels.push(images).push(numbers).send()
    parts = (images[own], travels.pop()), (numbers[own], travels.pop())
    return tuple(np.concatenate(both) for both in parts)


def _shifts(box, margin):
    """What takes a place to its periodic images up to ``margin`` away, no shift first, (k, 3) [length]."""
    counts = [int(np.ceil(margin / box.length[axis])) if box.periodic[axis] else 0 for axis in range(3)]
    turns = np.array(sorted(product(*(range(-count, count + 1) for count in counts)), key=lambda turn: (any(turn), turn)))
    shifts = turns * box.length
    for (flow, along), tilt in zip(SHEARS, box.tilt):
        shifts[:, flow] += turns[:, along] * tilt
    return shifts


def _ranks_near(bricks, low, high, shift):
    """Ranks whose brick a brick from ``low`` to ``high`` meets, shifted."""
    return np.flatnonzero(((low + shift <= bricks[:, 1]) & (high + shift >= bricks[:, 0])).all(axis=1))
