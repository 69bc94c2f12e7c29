"""Grains remember where they are now, so that a strain can be measured from here on."""

import numpy as np

from barchan.actions.region import chosen
from barchan.errors import SceneError
from barchan.measure.strain import COLUMNS, followed, holds_places


def mark_places(sim, name="reference", where=None):
    """Let grains remember their present places, from which ``barchan.measure.strain`` measures. All ranks must call this.

    The places are a field of the grains: they migrate with them, and checkpoints keep them. Grains that come later have
    none. Marked anew under the same name, the places of before are forgotten.

    Args:
        name: of the field, a Python identifier; several references may be kept under names of their own.
        where: function of positions (k, 3) [length] that returns (k,) booleans: which grains are marked; default: all.

    Raises:
        SceneError: the name cannot be that of a field or is that of another one, or the region returns something else.
    """
    grains = sim.grains
    if name not in (field.name for field in grains.table):
        sim.add_field(name, len(COLUMNS), dimension="length")
    if not holds_places(grains.field(name)):
        raise SceneError(f"mark_places: name = {name!r} is that of another field of the grains; give one of its own")
    marked = np.ones(grains.n, dtype=bool) if where is None else chosen(sim, "mark_places: where", where)
    grains.view(name)[...] = np.column_stack([followed(sim), np.ones(grains.n)]) * marked[:, None]
