"""The bonds of one rank's grains, and what they do in a step."""

import numpy as np

from barchan.bonds.cracks import Cracks
from barchan.errors import NotFiniteError, RunError
from barchan.kernels import bonds as kernels
from barchan.kernels.bond_template import BLOCK, NOT_FINITE, OUT_ROWS, SEEN, TOO_LONG
from barchan.kernels.compiler import shares
from barchan.kernels.generate_bond import make_bond_loops
from barchan.neighbors.rows import ContactRows

#: A bond that is broken, and of which it is known.
_TOLD = 255


class Bonds:
    """Bonds by pairs of ids, each held by the owners of both its grains, who compute it alike.

    Args:
        kinds: list of ``Bond``, of one law.

    Attributes:
        kinds: as given, a tuple; ``law`` is theirs, None if there are none.
        active: True once bonds were installed on any rank.
        ids: (m, 2) of the grains, the smaller first.
        owners: (m, 2) ranks that own them.
        kind: (m,) number of its kind. strength: (m,) relative to that of the kind.
        history: (width, m) what each remembers, in the order of the law's ``history``.
        broken: (m,) number of the mode in which it broke in this step, 255 if that was earlier, 0 if it holds.
        first, second: (m,) rows of the grains, while there is a neighbour list.
        out: (9, m) force on the first, torque on the first, torque on the second.
        cracks: what this rank saw break.
    """

    def __init__(self, kinds):
        self.kinds, self.law = tuple(kinds), kinds[0].law if kinds else None
        self.table = np.array([kind.values for kind in kinds], dtype=np.float64).T.copy()
        self.active, self._loops, self.cracks = False, None, Cracks()
        self.clear()

    def clear(self):
        """Forget all bonds."""
        self._take_up(np.zeros((0, 2), np.int64), np.zeros((0, 2), np.int32), np.zeros((0, 2 + self.width)))

    def __len__(self):
        return len(self.kind)

    @property
    def width(self):
        """Numbers that a bond remembers."""
        return self.law.history_width if self.law else 0

    @property
    def holding(self):
        """(m,) bool: those that are not broken."""
        return self.broken == 0

    def n_counted(self, rank):
        """How many hold and are a rank's to count, as the owner of the first grain."""
        return int(np.count_nonzero(self.holding & (self.owners[:, 0] == rank)))

    # -- the list ----------------------------------------------------------------------------------------------------

    def add(self, ids, owners, values):
        """Take up more bonds.

        Args:
            ids, owners: (k, 2).
            values: (k, 2 + width) kind, strength, and what each remembers.
        """
        before = (self.ids, self.owners, self.values())
        self._take_up(*(np.concatenate(both) for both in zip(before, (ids, owners, values))))

    def values(self):
        """Kind, strength and memory of each, (m, 2 + width)."""
        return np.concatenate([self.kind[:, None], self.strength[:, None], self.history.T], axis=1)

    def keep(self, some):
        """Keep some, given by number or by (m,) bool, in that order."""
        self.ids, self.owners, self.kind, self.strength = (a[some] for a in (self.ids, self.owners, self.kind, self.strength))
        self.history, self.broken = np.ascontiguousarray(self.history[:, some]), self.broken[some]

    def forget_broken(self):
        """Drop those that are broken; they are among the cracks."""
        if not self.holding.all():
            self.keep(self.holding)

    def forget(self, ids):
        """Drop bonds of grains that are taken out of the scene."""
        gone = np.isin(self.ids, ids).any(axis=1)
        if gone.any():
            self.keep(~gone)

    def _take_up(self, ids, owners, values):
        self.ids, self.owners = ids, owners
        self.kind, self.strength = values[:, 0].astype(np.uint32), np.ascontiguousarray(values[:, 1])
        self.history, self.broken = np.ascontiguousarray(values[:, 2:].T), np.zeros(len(ids), dtype=np.uint8)
        self.first = self.second = np.zeros(0, dtype=np.uint32)
        self.out = np.zeros((OUT_ROWS, 0))

    def settle(self, grains):
        """Number the grains of all bonds by their rows, and put the bonds in the order of these."""
        if not len(self):
            self.first = self.second = np.zeros(0, dtype=np.uint32)
            return
        own = grains.view("id", ghosts=True)
        rows = rows_of(own, self.ids)
        order, begin = np.empty(len(self), dtype=np.int64), np.empty(len(own) + 1, dtype=np.int64)
        kernels.order_by_row(rows[:, 0], begin, order)
        self.keep(order)
        self.first, self.second = np.ascontiguousarray(rows[order].T)
        self.start, self.incidence = np.empty(grains.n + 1, np.uint32), np.empty(2 * len(self), np.uint32)
        kernels.list_bonds(self.first, self.second, own, self.start, self.incidence)
        self.count = np.diff(self.start)
        self.out = np.zeros((OUT_ROWS, len(self)))

    # -- a step ------------------------------------------------------------------------------------------------------

    def act(self, sim, dt):
        """Add what bonds do to ``force`` and ``torque`` of the grains; what they remember advances by ``dt``.

        Returns:
            Number of grains whose force is not finite, at least: 0 if all are.
        """
        grains, frame = sim.grains, sim.box.frame
        if not len(self):
            return 0
        state = (grains.block(name, ghosts=True) for name in ("place", "motion", "spin"))
        bonds = (self.first, self.second, self.kind, self.strength, *state, self.table, self.history, self.broken, self.out)
        parts = shares(len(self))
        rooms = (np.empty((len(parts) - 1, *lines, BLOCK)) for lines in ((SEEN,), (self.width,), ()))
        if self._compiled().bond_forces(parts, *bonds, *rooms, frame.length, frame.half, frame.tilt, frame.rate, dt):
            self._tell(sim)
        return self._add_to(grains.block("force"), grains.block("torque"))

    def sums(self, n_owned):
        """What bonds do to each owned grain: force and torque, (n, 3) each."""
        force, torque = np.zeros((2, n_owned, 3))
        if len(self):
            self._add_to(force, torque)
        return force, torque

    def _add_to(self, force, torque):
        return kernels.add_bond_forces(self.start, self.count, self.incidence, self.out, force, torque)

    def _tell(self, sim):
        """Put those that broke in this step among the cracks, each on one rank; or name one that cannot be gone on with."""
        new = np.flatnonzero((self.broken != 0) & (self.broken != _TOLD))
        impossible = new[self.broken[new] >= NOT_FINITE]
        if len(impossible):
            sim.faults.found = self._fault(sim, impossible[0])
            self.broken[impossible] = 0
            new = np.setdiff1d(new, impossible)
        own = new[self.first[new] < sim.grains.n]
        energies = self.cracks.note(sim, self, own)
        if not np.isfinite(energies).all():
            sim.faults.found = NotFiniteError(
                f"step {sim.step_number}: bond law '{self.law.name}': its energy() is not finite for a bond that broke"
            )
        self.broken[new] = _TOLD
        kernels.take_off(self.broken, self.start, self.count, self.incidence)

    def _fault(self, sim, k):
        """The error for bond ``k``, by what stands for its mode."""
        pair = f"bond between grains {self.ids[k, 0]} and {self.ids[k, 1]}, step {sim.step_number}, t = {sim.time:g}"
        if self.broken[k] == TOO_LONG:
            return RunError(
                f"{pair}: along an axis it has grown longer than half the period, in a box of {sim.box.length.tolist()} "
                f"[length]; from there on its nearest image is another one. Widen the box, or use a bond that breaks earlier"
            )
        if self.broken[k] == NOT_FINITE:
            return NotFiniteError(f"{pair}: what it remembers is not finite; look at bond law '{self.law.name}'")
        modes = ", ".join(f"{number}: {mode}" for number, mode in enumerate(self.law.modes, 1))
        return RunError(
            f"{pair}: bond law '{self.law.name}' returned a mode that it has not; it must be 0 while the bond holds, or one of "
            f"{modes}"
        )

    def energies(self, grains, some):
        """What some bonds, by their numbers, store [force length]; 0 if the law does not tell."""
        energies, radius = np.zeros(len(some)), grains.view("radius", ghosts=True)
        if len(some) and self._compiled().energies is not None:
            radii = (np.ascontiguousarray(radius[rows[some]]) for rows in (self.first, self.second))
            self._loops.energies(*radii, self.kind[some], self.table, np.ascontiguousarray(self.history[:, some]), energies)
        return energies

    def _compiled(self):
        self._loops = self._loops or make_bond_loops(self.law, len(self.kinds) == 1)
        return self._loops

    # -- files -------------------------------------------------------------------------------------------------------

    def rows(self, ids, rank):
        """``ContactRows`` of grains by their ids (k,): of each bond that holds the grain with the smaller id has it."""
        own = np.flatnonzero(self.holding & (self.owners[:, 0] == rank))
        own = own[np.lexsort((self.ids[own, 1], self.ids[own, 0]))]
        firsts = self.ids[own, 0]
        begin, over = (np.searchsorted(firsts, ids, side) for side in ("left", "right"))
        start = np.concatenate([[0], np.cumsum(over - begin)]).astype(np.int64)
        chosen = own[np.repeat(begin - start[:-1], over - begin) + np.arange(start[-1])]
        return ContactRows(start, self.ids[chosen, 1], self.values()[chosen])


def rows_of(ids, wanted):
    """Rows of the grains with the ``wanted`` ids, same shape.

    Args:
        ids: (n,) of all rows; each that is wanted is among them.
    """
    order = np.argsort(ids)
    return order[np.searchsorted(ids, wanted, sorter=order)].astype(np.uint32)
