"""What a neighbour list has to hold: how far beyond touching, and in which size classes it is searched."""

import numpy as np

from barchan.errors import SceneError
from barchan.neighbors.classes import SizeClasses, survey
from barchan.words import shown

#: Skin relative to a typical diameter: the geometric mean, since small grains are many.
DEFAULT_SKIN = 0.1


class Scope:
    """The scope of a simulation's list.

    Attributes:
        skin: how far two surfaces may approach before it is made anew [length].
        law_reach: how far apart the surfaces of a contact may be [length].
        sizes: ``Survey`` of all grains.
    """

    def __init__(self):
        self.skin, self.law_reach, self.sizes, self._separators, self._way = None, 0.0, None, None, None

    @property
    def reach(self):
        """How far apart the surfaces of listed pairs are [length]."""
        return self.law_reach + self.skin

    @property
    def cutoff(self):
        """How far apart the centres of listed pairs may be [length]."""
        return 2.0 * self.sizes.widest + self.reach

    def follow(self, sim, listed):
        """Take up the grains, the law, the skin and the separators that a simulation has now. All ranks must call this.

        Args:
            listed: there is a list, and the grains are those that it was made of.

        Returns:
            Whether a list that was made before is no good.

        Raises:
            SceneError: ``size_classes`` has what cannot be used.
        """
        if not isinstance(sim.size_classes, SizeClasses):
            raise SceneError(f"size_classes = {shown(sim.size_classes)} must be a barchan.neighbors.classes.SizeClasses")
        separators, before = sim.size_classes.checked(), (self.skin, self.law_reach)
        way = sim.size_classes.strategy, sim.size_classes.cell
        listed = listed and sim.size_classes.choice is not None
        stale = not (listed and np.array_equal(separators, self._separators) and way == self._way)
        if stale:
            self.sizes = survey(sim.comm, sim.box, sim.grains.block("place"), () if separators is None else separators)
        self.skin = sim.skin if sim.skin is not None else DEFAULT_SKIN * 2.0 * self.sizes.typical
        self.law_reach = sim.law.largest_reach(sim.table, self.sizes.widest)
        stale = stale or before != (self.skin, self.law_reach)
        if stale:
            sim.size_classes.suit(self.sizes, self.reach)
            self._separators, self._way = separators, way
        return stale
