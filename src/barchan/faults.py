"""What is wrong in a step: kept by the rank that finds it, known to all with the next reduction, told by one."""

import warnings

from barchan import preflight
from barchan.parallel.guard import raise_together

#: Overlap, relative to the smaller diameter, above which contacts are counted and the user is warned once.
ALLOWED_OVERLAP = 0.05


class Faults:
    """What this rank has found.

    Attributes:
        found: the error that ends the run, or None.
        large_overlaps: contacts above ``ALLOWED_OVERLAP``, summed over the steps.
    """

    def __init__(self):
        self.found, self.large_overlaps, self._warned = None, 0, False

    def note(self, sim, large, too_large, not_finite):
        """Keep what is wrong with the forces of this step."""
        if not_finite:
            self.found = preflight.bad_force(sim)
        elif too_large:
            self.found = preflight.too_large_overlap(sim)
        self.large_overlaps += large

    @property
    def signs(self):
        """For a reduction over all ranks: whether there is an error, and whether there are large overlaps."""
        return float(self.found is not None), float(self.large_overlaps > 0)

    def take_note(self, sim, error, large, depth):
        """What the reduction of ``signs`` gave: all ranks stop with an error, or one warns of large overlaps.

        Args:
            depth: of calls from here to the line that called run().
        """
        if large and not self._warned:
            self._warned = True
            if sim.comm.rank == 0:
                warnings.warn(
                    f"step {sim.step_number}: there are contacts that overlap by more than {100 * ALLOWED_OVERLAP:g} % of the "
                    f"smaller diameter; a stiffer material is closer to hard grains",
                    stacklevel=depth + 1,
                )
        if error:
            found, self.found = self.found, None
            raise_together(sim.comm, found)

    def restart(self, large_overlaps):
        """Forget an error; so many large overlaps were counted before."""
        self.found, self.large_overlaps, self._warned = None, large_overlaps, large_overlaps > 0
