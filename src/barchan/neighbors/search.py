"""The search for pairs: class by class, in rooms that grow until all pairs fit."""

from time import perf_counter
from typing import NamedTuple

import numpy as np

from barchan.kernels import border, cells, stencils
from barchan.kernels import pairs as kernels
from barchan.kernels.compiler import shares
from barchan.kernels.lanes import LANES
from barchan.kernels.larger import ROUNDING, Search


class Pairs(NamedTuple):
    """Pairs that may touch.

    ``first``, ``second``: rows, the first has the smaller id. ``n_inner``: how many are of two owned grains; these come first.
    ``offsets``: (kinds, owned + 1) where those begin that each grain found: of two owned grains; with ghosts, where there are
    any; with ghosts of smaller classes, where there are several classes. ``seen``: (4, ...) coordinates and radii of the grains
    now.
    """

    first: np.ndarray
    second: np.ndarray
    n_inner: int
    offsets: np.ndarray
    seen: np.ndarray


class PairSearch:
    """Finds pairs, and remembers how much room they took.

    Args:
        store: gives arrays that are kept from rebuild to rebuild.

    Attributes:
        seconds: what the last search took.
    """

    def __init__(self, store):
        self._store, self._pairs_per_grain, self._listed, self.seconds = store, 4.0, 64, 0.0

    def find(self, grains, box, grids, start, reach):
        """The pairs whose surfaces are closer than ``reach`` [length], as ``Pairs``.

        Args:
            box: the ``Box``; it is the ``Upright`` one that is looked through.
            grids: ``Grids``; owned rows are in the order of their cells, of which ``start`` tells where they begin.
        """
        began, place, frozen = perf_counter(), grains.block("place", ghosts=True), grains.block("frozen", ghosts=True)
        upright = box.upright
        there = upright.places(place)
        ghosts = cells.sorted_cells(there, grains.n, grains.n_ghost, grids)
        seen = grains.working_room(4 * (len(place) + LANES)).reshape(4, -1)
        kernels.see_places(there, ghosts[1], seen)
        search = Search(start, *ghosts, seen, frozen, grains.view("id", ghosts=True), *grids, reach)
        counts, found = np.empty(grains.n, dtype=np.uint32), None
        while found is None:
            found = self._all_classes(search, counts)
        first, second = found
        if upright.leans:
            near = kernels.keep_near(first, second, counts, place, reach * (1.0 + ROUNDING), *box.frame[1:4])
            first, second = first[:near], second[:near]
        offsets = np.zeros((1 + (grains.n_ghost > 0) * min(2, len(grids.largest)), grains.n + 1), dtype=np.uint32)
        np.cumsum(counts, out=offsets[0, 1:])
        n_inner = len(first)
        if grains.n_ghost:
            n_inner = int(kernels.inner_first(first, second, offsets, *np.empty((2, len(first)), np.uint32)))
        if len(offsets) == 3:
            first, second = self._with_smaller_ghosts(search, first, second, offsets[2])
        if upright.leans:
            kernels.see_places(place, ghosts[1], seen)
        self.seconds = perf_counter() - began
        return Pairs(first, second, n_inner, offsets, seen)

    def _all_classes(self, search, counts):
        """Pairs that the grains of each class found, one grain after another; None if there was too little room, and then there
        is more for the next look."""
        threads, n, end = len(shares(0)) - 1, len(counts), 0
        room = int(self._pairs_per_grain * n) + 2 * kernels.FOUND * threads
        first, second = (self._store(name, np.uint32, room) for name in ("first", "second"))
        rooms, ends, needed = kernels.Rooms.of(threads, self._listed), *np.empty((2, threads), dtype=np.uint64)
        for number in range(len(search.largest)):
            bounds = shares(room - end) + np.uint64(end)
            find, parts = _way(search, number)
            find(number, parts, bounds, search, rooms, first, second, counts, ends, needed)
            if needed.max() > self._listed:
                self._listed = 2 * int(needed.max())
                return None
            if (ends + np.uint64(kernels.FOUND) > bounds[1:]).any():  # rows have to exist beside the last, for the lanes
                wanted = end + float((ends - bounds[:-1]).max()) * threads
                self._pairs_per_grain = max(1.05 * wanted / n, self._pairs_per_grain)
                return None
            for begin, over in zip(bounds[:-1].tolist(), ends.tolist()):
                for rows in (first, second):
                    rows[end : end + over - begin] = rows[begin:over]
                end += over - begin
        return first[:end], second[:end]

    def _with_smaller_ghosts(self, search, first, second, offsets):
        """The pairs, and after them those of ghosts with owned grains of larger classes, one owned grain after another;
        ``offsets`` becomes where they begin."""
        found = [self._of_ghosts(search, number) for number in range(len(search.largest) - 1)]
        owned, ghost = np.concatenate(found, axis=1)
        matters = (search.frozen[owned] & search.frozen[ghost]) == 0
        owned, ghost = owned[matters], ghost[matters]
        order = np.argsort(owned, kind="stable")
        owned, ghost = owned[order], ghost[order]
        offsets[0], offsets[1:] = len(first), len(first) + np.cumsum(np.bincount(owned, minlength=len(offsets) - 1))
        in_order, count = search.ids[owned] < search.ids[ghost], len(first) + len(owned)
        one, other = (self._store(name, np.uint32, count, keep=True) for name in ("first", "second"))
        one[len(first) : count] = np.where(in_order, owned, ghost)
        other[len(first) : count] = np.where(in_order, ghost, owned)
        return one[:count], other[:count]

    def _of_ghosts(self, search, number):
        """Rows of owned grains of larger classes and of ghosts of class ``number``, (2, pairs)."""
        room = len(search.ghost_rows) + 64
        while True:
            rows = np.empty((2, room), dtype=np.uint32)
            count, listed = border.find_pairs_of_ghosts(number, search, kernels.Rooms.of(1, self._listed), *rows)
            if listed <= self._listed and count <= room:
                return rows[:, :count]
            self._listed, room = max(self._listed, int(listed)), max(room, int(count))


def _way(search, number):
    """How a class is searched, and what each thread does: where its cells begin, counted from the first of the class, or in a
    sparse grid its rows."""
    begin, over = search.first[number], search.first[number + 1]
    rows = search.start[begin] + shares(search.start[over] - search.start[begin])
    shape, inverse = search.tables[number, cells.SHAPE], search.tables[number, cells.INVERSE]
    if ((shape > 1.0) & (inverse * (2.0 * search.largest[number] + search.reach) > 1.0 + ROUNDING)).any():
        return stencils.find_pairs_widely, rows
    if np.prod(search.tables[number, cells.SHAPE]) > over - begin:
        return kernels.find_pairs_sparsely, rows
    parts = np.searchsorted(search.start[begin : over + 1], rows).astype(np.uint64)
    parts[0], parts[-1] = 0, over - begin
    return kernels.find_pairs, parts
