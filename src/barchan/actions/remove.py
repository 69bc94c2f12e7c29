"""Grains in a part of space are taken out and counted: a sample is trimmed, a pit is dug."""

from typing import NamedTuple

import numpy as np

from barchan.actions.region import chosen
from barchan.kernels.exact_sum import exact_sum


class Removed(NamedTuple):
    """What was taken out on all ranks: ``grains``, a number, and their ``mass`` [mass]."""

    grains: int
    mass: float


def remove_where(sim, region):
    """Take the grains whose centres lie in a region out of the scene, frozen ones too. All ranks must call this.

    Args:
        region: function of positions (k, 3) [length] that returns (k,) booleans, such as ``lambda p: p[:, 2] > 0.1``: what is
            above a height.

    Returns:
        ``Removed``: number and mass, the same on all ranks.

    Raises:
        SceneError: the region returns something else.
    """
    grains = sim.grains
    inside = chosen(sim, "remove_where: region", region)
    mass = exact_sum(grains.view("mass")[inside], sim.comm)
    count = int(sim.comm.sum([np.count_nonzero(inside)])[0])
    if count:
        sim.remove(grains.view("id")[inside])
    return Removed(count, mass)
