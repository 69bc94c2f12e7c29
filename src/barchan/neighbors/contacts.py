"""The neighbour list and what its contacts carry: forces of this step and memory of the past.

Contacts are numbered: pairs of grains first, then grains at walls. Arrays have spare room and grow when a rebuild needs it.
"""

from typing import NamedTuple

import numpy as np

from barchan import memory
from barchan.kernels import border as border_kernels
from barchan.kernels import history as history_kernels
from barchan.kernels import incidence as incidence_kernels
from barchan.kernels.compiler import shares
from barchan.kernels.couples import add_couples
from barchan.kernels.gather import gather_forces
from barchan.kernels.history import NOWHERE
from barchan.kernels.steps import Lists, Rooms
from barchan.kernels.template import BLOCK, block_rooms, whole_blocks
from barchan.neighbors.rows import ContactRows
from barchan.neighbors.search import PairSearch

#: Contacts of a grain that are sorted by rank, or listed, at a time.
AT_A_TIME = 32


class Setting(NamedTuple):
    """What the forces of contacts depend on, besides the grains.

    ``table``: (parameters, pairs of materials) of the law; ``frame``: a ``Frame``; overlaps relative to the smaller diameter.
    """

    n_materials: int
    table: np.ndarray
    frame: object
    dt: float
    allowed_overlap: float
    max_overlap: float


class Remembered(NamedTuple):
    """The contacts that touched, while their list is replaced: see ``kernels.history``.

    ``rows``: (3, ...) both rows, or row and -1 - key of a wall, and column, of ``count`` contacts of which ``n_pairs`` are pairs.
    ``entries``: from ``begin[i]`` to ``begin[i + 1]`` those of grain i, as 2 * contact + side, in the order of its sum.
    ``moved``: room for their new numbers. ``columns``: how many are in use. ``strangers``: rows of ghosts and of grains that
    leave, and ``ids`` of these. ``n_rows``: of all grains and ghosts.
    """

    n_pairs: int
    count: int
    rows: np.ndarray
    begin: np.ndarray
    entries: np.ndarray
    moved: np.ndarray
    columns: int
    strangers: np.ndarray
    ids: np.ndarray
    n_rows: int


#: What is remembered where there was no list.
NOTHING = Remembered(
    *(0, 0, np.zeros((3, 0), dtype=np.uint32), *np.zeros((3, 1), dtype=np.uint32), 1, *np.zeros((2, 0), dtype=np.int64), 0)
)


class Contacts:
    """Candidates for contact of one rank.

    Attributes:
        seen: (4, ...) coordinates and radii of the grains when the list was made, owned ones first, until the grains are ordered
            anew.
        first, second: (pairs,) rows of the grains; the first has the smaller id.
        wall_grain, wall_key, wall_material: (wall contacts,) row of the grain, key and material of the wall.
        start, incidence: contacts of each owned grain i, ``incidence[start[i]:start[i + 1]]``, as 2 * contact + side.
        touched: (owned,) how many of them touch; they come first, in ascending order of the partner's key.
        changed: (rows,) 1 for grains of which that may no longer be so, since a contact began or ended.
        slot: (contacts,) column in which a contact that touches keeps its force; 0 of one that does not. Between a rebuild and
            the next forces only that tells anything.
        history: (width, columns) memory of the law as seen from the first grain, in the order of ``kernels/template.py``;
            column 0 holds zeros. There is a column for each candidate of whole blocks, and for each wall contact.
        out: (6 to 11, columns): force on the first, n x F_t, for lens arms the arms of both, for laws with couples that on the
            first (``kernels/template.py``); column 0 holds zeros.
        surface: (11, wall contacts) geometry of wall contacts at this step.
        computed: True once ``out`` and ``surface`` belong to this list.
        search: the ``PairSearch`` that finds the pairs.
    """

    def __init__(self, law):
        self.history_width, self.couple = law.history_width, law.couple
        self.out_rows = 6 + 2 * (law.lever == "lens") + 3 * law.couple
        self.seen = np.zeros((4, 0))
        self.first = self.second = np.zeros(0, dtype=np.uint32)
        self.wall_grain = self.wall_material = np.zeros(0, dtype=np.uint32)
        self.wall_key = np.zeros(0, dtype=np.int64)
        self.start, self.incidence = np.zeros(1, dtype=np.uint32), np.zeros(0, dtype=np.uint32)
        self.touched, self.changed = np.zeros(0, dtype=np.uint32), np.zeros(0, dtype=np.uint8)
        self.slot, self.surface = np.zeros(0, dtype=np.uint32), np.zeros((11, 0))
        self._store, self._history_first = np.zeros((law.history_width + max(law.history_width, self.out_rows), 1)), True
        self._lay_out()
        self._n_inner, self._fresh_at_walls, self.computed = 0, np.zeros((law.history_width, 0)), False
        self._ids = np.zeros(0, dtype=np.int64)
        self.wall_ranges, self._lists = [], memory.Store()
        self.search = PairSearch(self._lists)

    @property
    def n_pairs(self):
        """Number of pairs of grains."""
        return len(self.first)

    def detach(self, wanted, on_both):
        """Memory of the contacts as rows of their grains.

        Args:
            wanted: (owned,) bool, of which grains.
            on_both: let each grain of a pair have it, not the one with the smaller id alone.
        """
        if self.history_width == 0 or len(self.slot) == 0 or not wanted.any():
            return ContactRows.empty(len(wanted), self.history_width)
        self._order_incidence()
        counts = np.zeros(len(wanted), dtype=np.int64)
        history_kernels.count_rows(self.start, self.touched, self.incidence, wanted, on_both, counts)
        start = np.concatenate([[0], np.cumsum(counts)])
        keys, values = np.empty(start[-1], dtype=np.int64), np.empty((start[-1], self.history_width))
        parts = shares(len(wanted))
        room = np.empty((len(parts) - 1, AT_A_TIME), dtype=np.int64)
        contacts = (*self._partners(), self.start, self.touched, self.incidence, self._memory_columns(), self.history)
        history_kernels.detach_rows(parts, room, *contacts, on_both, start, keys, values)
        return ContactRows(start, keys, values)

    def count_remembered(self):
        """Contacts that this rank's grains remember, of a pair the one with the smaller id."""
        if self.history_width == 0:
            return 0
        own = self.first < len(self.touched)
        return int(np.count_nonzero(own & (self.slot[: self.n_pairs] != 0)) + np.count_nonzero(self.slot[self.n_pairs :]))

    def put_aside(self, leaving):
        """What has to be remembered of this list for ``carry_over``. It lies where the forces of the step before were, which are
        needed no more; the list itself is worth nothing afterwards.

        Args:
            leaving: (owned,) bool, grains that go to other ranks.
        """
        self.computed = False
        self._order_incidence()
        room = self.out.view(np.uint32)  # two numbers for each column
        rows, entries, moved = room[:3], room[3], room[4]
        contacts = (self.first, self.second, self.wall_grain, self.wall_key)
        n_pairs, count = history_kernels.list_remembered(*contacts, self.slot, BLOCK, rows)
        begin = np.zeros(len(self.touched) + 1, dtype=np.uint32)
        np.cumsum(self.touched, out=begin[1:])
        history_kernels.list_order(self.start, self.touched, self.incidence, self.slot, begin, entries)
        columns = 1 + self._wall_column + len(self.wall_grain)
        strangers = np.concatenate([np.flatnonzero(leaving), np.arange(len(leaving), len(self._ids))])
        ids, n_rows = self._ids[strangers], len(self._ids)
        return Remembered(n_pairs, count, rows, begin, entries, moved, columns, strangers, ids, n_rows)

    def find(self, grains, box, grids, start, reach, met):
        """Find all pairs whose surfaces are closer than ``reach`` [length]. Owned rows are in the order of the grids' cells, of
        which ``start`` tells where they begin. ``build`` has to follow.

        Args:
            box: the ``Box``.
            met: (ghosts,) bool, those that are needed anyway; becomes True of those that are in a pair, too. Rows of pairs are
                numbered as if there were no others.
        """
        found = self.search.find(grains, box, grids, start, reach)
        self.first, self.second, self._n_inner, self._offsets, self.seen = found
        border = slice(self._n_inner, self.n_pairs)
        if grains.n_ghost:
            room = np.empty(len(met), dtype=np.uint32)
            border_kernels.number_met(np.uint32(grains.n), self.first[border], self.second[border], met, room)

    def build(self, grains, walls, reach):
        """Find the walls that grains are closer to than ``reach`` [length], and list the contacts of each grain. Of ghosts, there
        are those that ``find`` told. ``carry_over`` has to follow."""
        self._build_wall_contacts(grains, walls, reach)
        self._ids = grains.view("id", ghosts=True)
        self.start, self.touched = np.empty(grains.n + 1, dtype=np.uint32), np.zeros(grains.n, dtype=np.uint32)
        incidence_kernels.count_incidence(grains.n, self.first, self.second, self.wall_grain, self.start)
        self.incidence = self._lists("incidence", np.uint32, self.start[-1])
        count = self.n_pairs + len(self.wall_grain)
        self.slot = self._lists("slot", np.uint32, count)
        self.slot[:], self.computed = 0, False

    def _build_wall_contacts(self, grains, walls, reach):
        found = [wall.candidates(grains, reach) for wall in walls]
        self._wall_begin = np.cumsum([0, *(len(rows) for rows in found)])
        self.wall_ranges = list(zip(self._wall_begin[:-1].tolist(), self._wall_begin[1:].tolist()))
        self.wall_grain = np.concatenate([np.zeros(0, dtype=np.uint32), *found]).astype(np.uint32)
        keys = (wall.keys(rows) for wall, rows in zip(walls, found))
        self.wall_key = np.concatenate([np.zeros(0, dtype=np.int64), *keys])
        self._wall_of_key = np.repeat(np.arange(len(walls), dtype=np.uint32), [wall.patches for wall in walls])
        self.wall_material = np.repeat(np.array([wall.material for wall in walls], dtype=np.uint32), np.diff(self._wall_begin))
        self.surface = np.empty((11, len(self.wall_grain)))
        self._fresh_at_walls = np.empty((self.history_width, len(self.wall_grain)))

    def carry_over(self, known, origin, rows):
        """Give the new contacts what is known of them.

        Args:
            known: what is ``Remembered`` of the old list, or ``NOTHING``.
            origin: (owned,) old row of each grain; ``NOWHERE`` of one that was not this rank's, or in no list.
            rows: ``ContactRows`` of the grains, as such a one brought them, and perhaps of their ghosts; of the others, none.
        """
        self._make_columns(known.columns - 1 + len(rows.keys))
        new_row, pairs = self._new_rows(known, origin), (self._offsets, self.first, self.second)
        history_kernels.find_pairs_again(known.n_pairs, known.rows, new_row, *pairs, self.slot, known.moved)
        at_walls = (self._wall_of_key, self._wall_begin, self.wall_grain, self.wall_key, self.n_pairs)
        history_kernels.find_walls_again(known.n_pairs, known.count, known.rows, new_row, *at_walls, self.slot, known.moved)
        self.changed = np.zeros(len(self._ids), dtype=np.uint8)
        lists = (self.start, self.touched, self.changed, self.incidence)
        history_kernels.carry_order(origin, known.moved, known.begin, known.entries, *lists)
        self._fill_incidence(len(origin))
        if len(rows.keys):
            begin = np.append(rows.start, np.full(len(self._ids) + 1 - len(rows.start), rows.start[-1]))
            lists = (self.start, self.incidence, begin, rows.keys, rows.values, known.columns)
            history_kernels.attach_rows(len(origin), self._n_inner, *self._partners(), *lists, self.slot, self.history)
        self._arrange_memory()
        self.out[:, 0], self._offsets = 0.0, None

    def _new_rows(self, known, origin):
        """The row of each old row now, ``NOWHERE`` if it has none."""
        rows = np.full(known.n_rows, NOWHERE)
        if len(known.strangers) or len(rows) != len(origin):
            others = np.concatenate([np.flatnonzero(origin == NOWHERE), np.arange(len(origin), len(self._ids))])
            others = others[np.argsort(self._ids[others])]
            place = np.searchsorted(self._ids[others], known.ids)
            there = place < len(others)
            there[there] = self._ids[others[place[there]]] == known.ids[there]
            rows[known.strangers[there]] = others[place[there]]
        history_kernels.follow_rows(origin, rows)
        return rows

    def _fill_incidence(self, n_owned):
        pairs = (self.first, self.second, self.wall_grain, self.slot)
        incidence_kernels.fill_incidence(n_owned, *pairs, self.touched, self.changed, self.start, self.incidence)

    def _partners(self):
        """What the key of a contact's partner is looked up in."""
        return self.first, self.second, self._ids, self.wall_key

    def _order_incidence(self):
        parts, room = self._order_rooms()
        lists = (self.slot, self.start, self.touched, self.incidence)
        incidence_kernels.order_incidence(parts, self.changed, *self._partners(), *lists, room)

    def _order_rooms(self):
        """Shares of the grains, and room for the keys of one of each thread."""
        parts = shares(len(self.touched))
        return parts, np.empty((len(parts) - 1, 2, AT_A_TIME), dtype=np.int64)

    @property
    def _wall_column(self):
        """The column before that of the first wall contact."""
        return whole_blocks(self.n_pairs)

    def _make_columns(self, least=0):
        """Room for a column of each contact, and for ``least``; what stands in the present ones stays there."""
        count = max(least, self._wall_column + len(self.wall_grain))
        if self.out.shape[1] > count:
            return
        store = memory.empty((self.history_width + max(self.history_width, self.out_rows), 1 + count + count // 8))
        store[: self.history_width, : self.history.shape[1]] = self.history
        self._store, self._history_first = store, True
        self._lay_out()

    def _lay_out(self):
        """Memory at one end of the store, forces at the other."""
        width, rows = self.history_width, len(self._store)
        self.history, self.out = self._store[:width], self._store[rows - self.out_rows :]
        if not self._history_first:
            self.history, self.out = self._store[rows - width :], self._store[: self.out_rows]

    def _arrange_memory(self):
        """Bring the memory from the columns that ``slot`` tells to where it belongs: to the other end of the store, where forces
        were, which are needed no more."""
        before, self._history_first = self.history, not self._history_first
        self._lay_out()
        parts = shares(whole_blocks(self.n_pairs) // BLOCK)
        room = np.empty((len(parts) - 1, BLOCK), dtype=np.uint32)
        history_kernels.bring_memory(parts, room, self.slot, self.n_pairs, before, self.history)

    def _memory_columns(self):
        """The column of each contact's memory, 0 if it has none."""
        columns = np.empty(len(self.slot), dtype=np.uint32)
        history_kernels.find_columns(self.slot, self.n_pairs, BLOCK, columns)
        return columns

    def memory(self):
        """What each contact remembers, (width, contacts); zeros if it does not touch."""
        return self.history[:, self._memory_columns()]

    @property
    def parts(self):
        """The pairs in two ranges: whole blocks of which both grains are owned, and all others."""
        middle = self.n_pairs if self._n_inner == self.n_pairs else self._n_inner // BLOCK * BLOCK
        return (0, middle), (middle, self.n_pairs)

    def compute_pairs(self, loops, grains, setting, some):
        """Forces of a range of pairs, one of ``parts``; memory advances by the time step, forces are kept by column.

        Args:
            loops: compiled ``Loops`` of the law.
            setting: a ``Setting``.

        Returns:
            (contacts that touch, above the allowed overlap, above the largest).
        """
        begin, end = some
        if begin == end:
            return 0, 0, 0
        parts, *rooms = block_rooms(end, self.history_width, begin)
        pairs = (parts, self.first, self.second, np.uint32(grains.n))
        frame = (setting.frame.length, setting.frame.half, setting.frame.tilt, setting.frame.rate)
        return loops.pair_forces(*pairs, *self._what_acts(grains, setting), *rooms, *frame, *_limits(setting))

    def memory_at_walls(self, begin):
        """Where the memory of contacts with walls is, from contact ``begin`` among them on: number of the first among all
        contacts, its column, and ``slot``, ``history`` and ``changed``."""
        return self.n_pairs + begin, self._wall_column + 1 + begin, self.slot, self.history, self.changed

    def compute_walls(self, loops, grains, setting):
        """Forces of contacts at walls, which come last; takes and returns what ``compute_pairs`` does."""
        counts = (0, 0, 0)
        if len(self.wall_grain):
            columns = (self._fresh_at_walls, np.uint64(self.n_pairs), np.uint64(self._wall_column))
            *state, stride, table, slot, history, out, changed = self._what_acts(grains, setting)
            law = (self.wall_material, stride, table, slot, history, out, changed)
            counts = loops.wall_forces(self.wall_grain, self.surface, *state, *law, *columns, *_limits(setting))
        self._order_incidence()
        self.computed = True
        return counts

    def _what_acts(self, grains, setting):
        """What the loops of a law read and write, besides the list: four blocks of the grains, and the law's."""
        state = (grains.block(name, ghosts=True) for name in ("place", "motion", "spin", "material"))
        law = (np.uint32(setting.n_materials), setting.table, self.slot, self.history, self.out, self.changed)
        return *state, *law

    def advance(self, loops, begin, bodies, walls, rules, wire, told):
        """Many steps at once.

        Args:
            loops: compiled ``Loops`` of the law.
            begin: largest number of steps, time, bound on the approach of surfaces since the rebuild.
            bodies, walls, rules: as ``kernels.steps`` has them, walls as (planes, meshes, where all were then); modified.
            wire: to the other ranks.
            told: becomes what ``kernels.steps.Progress`` reads, whatever interrupts this.
        """
        lists = Lists(
            *(self.first, self.second, self._ids, self.wall_key, self.slot, self.start, self.touched, self.incidence),
            *(self.changed, self.wall_grain, self.wall_material, self._wall_begin),
        )
        _, *rooms = block_rooms(self.n_pairs, self.history_width)
        pairs = np.array(self.parts[: min(1 + len(wire.rounds), 2)], dtype=np.uint64)
        rooms = Rooms(pairs, *rooms, *self._order_rooms(), self._fresh_at_walls)
        try:
            loops.advance(*begin, bodies, lists, self.history, self.out, *walls, rooms, rules, wire, told)
        finally:
            self.computed = self.computed or told[0] > 0

    def forces(self, some):
        """Forces on the first grains of ``some`` contacts, a slice, (3, k); 0 for those that do not touch."""
        return self.out[:3, self.slot[some]]

    def gather(self, grains, gravity):
        """Sum the contacts of each grain into ``force`` and ``torque``; returns how many are not finite, at
        least: 0 if all are."""
        contacts, torque = (self.start, self.touched, self.incidence, self.slot, self.out), grains.block("torque")
        state = (grains.block("place"), grains.block("mass"), np.array(gravity), grains.block("force"), torque)
        bad = gather_forces(*contacts, *state)
        return bad + add_couples(*contacts, torque) if self.couple else bad


def _limits(setting):
    """The last arguments of the loops of a law."""
    return setting.dt, setting.allowed_overlap, setting.max_overlap
