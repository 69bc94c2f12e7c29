"""When and how space is shared among the ranks anew.

Grains move, and with them the work. The rule of Moon & Saltz (1994), which PPM uses too ("SAR", stop at rise), weighs what
a new decomposition costs against what ranks lose that wait for the slowest. It follows the clock, so rank 0 decides for all;
it changes no bit.
"""

from time import perf_counter

import numpy as np

from barchan.errors import SceneError
from barchan.parallel.partition.bisection import bisection
from barchan.parallel.partition.labels import matched
from barchan.parallel.topology import MOST, SUBDOMAINS, Topology, shape_of
from barchan.words import shown

#: Cost of a grain that touches nothing, of a candidate and of a contact, on each of its sides: nanoseconds of a step, about, as
#: estimated from the profile of the dense flow in ``docs/design/performance.md``.
GRAIN, CANDIDATE, CONTACT = 20, 4, 9


#: A rank with few grains is slow for what it has, gets fewer, and so on: no measured speed is further from the median.
FASTEST = 4.0


class Balance:
    """Watches what the ranks have to do.

    Attributes to set at any time between runs:
        when: "it pays" (by the rule of Moon & Saltz), "never" (equal parts of space for ever), or a function of the step that
            says whether a rebuild in that step shall share anew.
        speeds: (ranks,) relative speeds of the processors; "measured": from the time that each took for its cost since space was
            shared last; None: all alike.

    Attributes to read:
        count: how often space was shared anew.
        seconds: what that took on this rank.
        imbalance: largest over mean cost of a rank's grains when space was shared last; 1 before.

    There are no others: a typo is an error.
    """

    __slots__ = ("_before", "_last_cost", "_own", "_slowest", "_steps", "count", "imbalance", "seconds", "speeds", "when")

    def __init__(self):
        self.when, self.speeds = "it pays", None
        self.count, self.seconds, self.imbalance = 0, 0.0, 1.0
        self._restart()

    def _restart(self):
        self._steps, self._slowest, self._own, self._before = 0, 0.0, 0.0, np.inf

    def note(self, slowest, own, steps):
        """Steps in which the slowest rank of each computed for ``slowest`` seconds in all, and this one for ``own``."""
        self._steps += steps
        self._slowest += slowest
        self._own += own

    def is_due(self, comm, step):
        """Whether to share anew in this rebuild: the same answer on all ranks, which all must ask."""
        if not callable(self.when) and self.when not in ("it pays", "never"):
            raise SceneError(f"balance.when = {shown(self.when)} must be 'it pays', 'never' or a function of the step")
        if comm.size == 1 or self.when == "never":
            return False
        if callable(self.when):
            return bool(comm.from_first(bool(self.when(step))))
        if self.count == 0:
            return True
        waited = self._slowest - float(comm.sum([int(1e9 * self._own)])[0]) * 1e-9 / comm.size
        return bool(comm.from_first(self._stops_to_fall(waited)))

    def _stops_to_fall(self, waited):
        """W(n) = [C + sum of (t_max - t_avg)] / n rose since the last rebuild: C is what sharing anew took, n counts the steps
        since."""
        if self._steps == 0:
            return False
        degradation = (self._last_cost + waited) / self._steps
        rises, self._before = degradation > self._before, degradation
        return rises

    def shared(self, sim, widest):
        """The topology of ``sim`` for the time to come: the one of now, or, when one is due, one in which each rank's grains cost
        as much as its speed allows. All ranks must call this.

        Args:
            widest: largest radius on any rank [length].

        Raises:
            SceneError: ``when`` or ``speeds`` cannot be used.
        """
        return self.anew(sim, widest) if self.is_due(sim.comm, sim.step_number) else sim.topology

    def anew(self, sim, widest):
        """The same, whether it is due or not."""
        begin = perf_counter()
        topology = self._decompose(sim.comm, sim.box, sim.grains, _costs(sim), widest)
        self._restart()
        self.count += 1
        self._last_cost = float(sim.comm.maximum([perf_counter() - begin])[0])
        self.seconds += perf_counter() - begin
        return topology

    def _decompose(self, comm, box, grains, cost, widest):
        position, speeds = grains.view("position"), self._present_speeds(comm, float(cost.sum()))
        count = SUBDOMAINS * comm.size
        enough = min(count, int(comm.sum([grains.n])[0]) // 4)  # of sub-domains with grains, some grains in each
        while True:
            shape = shape_of(box, count, 2.0 * widest)
            new = Topology(box, shape, np.zeros(int(np.prod(shape)), dtype=np.int32), comm.size)
            summed = np.bincount(new.subdomain(position), weights=cost, minlength=len(new.owners))
            summed = comm.sum(summed.astype(np.int64))
            if np.count_nonzero(summed) >= enough or not _can_be_finer(shape, box, count, widest):
                break
            count *= 2
        parts = bisection(summed, shape, new.edge, speeds)
        held = np.bincount(parts[new.subdomain(position)], weights=cost, minlength=comm.size)
        overlaps = comm.all_gather({int(part): int(held[part]) for part in np.flatnonzero(held)})
        new.owners[:] = matched(overlaps, speeds)[parts]
        load = np.bincount(new.owners, weights=summed, minlength=comm.size) / speeds
        self.imbalance = float(load.max() / max(load.mean(), 1.0))
        return new

    def _present_speeds(self, comm, cost):
        """Relative speed of each rank; ``cost`` is that of a step on this one."""
        if not isinstance(self.speeds, str) or self.speeds != "measured":
            return self._checked_speeds(comm.size)
        times = comm.all_gather((cost, self._own / max(self._steps, 1)))
        speeds = np.array([cost / seconds if cost > 0.0 and seconds > 0.0 else np.nan for cost, seconds in times])
        if np.isnan(speeds).all():
            return np.ones(comm.size)
        middle = np.nanmedian(speeds)
        return np.clip(np.where(np.isnan(speeds), middle, speeds) / middle, 1.0 / FASTEST, FASTEST)

    def _checked_speeds(self, size):
        try:
            speeds = np.ones(size) if self.speeds is None else np.array(self.speeds, dtype=np.float64)
            sound = speeds.shape == (size,) and bool((np.isfinite(speeds) & (speeds > 0.0)).all())
        except (TypeError, ValueError):
            sound = False
        if not sound:
            raise SceneError(
                f"balance.speeds = {shown(self.speeds)} must be 'measured', or one positive number for each of {size} ranks"
            )
        return speeds


def _can_be_finer(shape, box, count, widest):
    """Whether twice as many sub-domains would still be wider than the widest grain, and few enough to be known to all."""
    return count < MOST and bool((shape_of(box, 2 * count, 2.0 * widest) > shape).any())


def _costs(sim):
    """What each grain costs in a step, integers: its candidates and contacts, if they are known."""
    cost = np.full(sim.grains.n, GRAIN, dtype=np.int64)
    if sim.is_listed:
        cost += CANDIDATE * np.diff(sim.contacts.start.astype(np.int64)) + CONTACT * sim.contacts.touched
    return cost
