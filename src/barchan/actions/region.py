"""Which grains a user's function of positions chooses."""

import numpy as np

from barchan.errors import SceneError
from barchan.parallel.guard import raise_together
from barchan.words import shown


def chosen(sim, what, region):
    """Which of this rank's grains are in a region, (n,) booleans. All ranks must call this; one without grains asks nothing.

    Args:
        what: who asks, for the message.
        region: function of positions (k, 3) [length] that returns (k,) booleans.

    Raises:
        SceneError: it is no function, or returns something else.
    """
    if not callable(region):
        raise SceneError(f"{what} = {shown(region)} must be a function of positions (k, 3) [length] that returns (k,) booleans")
    count, fault = sim.grains.n, None
    found = np.asarray(region(sim.grains.view("position").copy())) if count else np.zeros(0, dtype=bool)
    if found.shape != (count,) or found.dtype != bool:
        fault = SceneError(
            f"{what}() returned an array of {found.dtype} and shape {found.shape} for {count} positions; it must return a "
            f"boolean for each"
        )
    raise_together(sim.comm, fault)
    return found
