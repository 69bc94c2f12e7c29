"""Size classes: which grains share a grid of cells.

A grid whose cells fit the largest grains has many small ones in each cell, and a search that looks at all of them. So grains are
cut into classes by radius, each with a grid of its own (Stratford et al. 2018). How many classes pay, and where the cuts are,
follows from what a search costs: of grains that look among their like, and of small ones that look for larger ones. The choice
changes no bit.
"""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.cells import DENSE, FEWEST, extents
from barchan.kernels.larger import TOGETHER
from barchan.kernels.sizes import count_sizes
from barchan.words import shown

#: Radii that a cut is chosen from, at equal ratios from the smallest grain to the largest.
BINS = 32

#: Ratio of the largest radius to the smallest up to which one class is best whatever the model says of it.
NARROW = 1.5

#: Cuts stay where they are until a search takes each grain so much longer by the model, or grains are twice as many, or half.
SLIGHT = 1.2

#: What a search costs [nanoseconds], fitted to 31 searches of 500,000 to 2.3 million grains, of ratios 10 to 100 in one to five
#: classes, on one core of an AMD EPYC (met within 8 % rms): of a grain by itself; of a line of cells that it looks at; of eight
#: grains there; of eight larger grains that were listed; of a list of larger grains, of a line of cells that it is made from, and
#: of a grain there; of a cell, empty or not; of a grain that finds its way in a sparse grid; of a class.
GRAIN, LINE, EIGHT, LISTED, LIST, LIST_LINE, LIST_GRAIN = 37.0, 2.0, 3.3, 3.7, 63.0, 58.0, 7.7
CELL, SPARSELY, CLASS = 1.6, 160.0, 4.2e4

#: Ways to search. "hierarchical": a grid for each class (Stratford et al. 2018, section 3). "multi": one grid of cells as small
#: as the smallest class wants, and larger stencils for larger grains (section 2.1). "single grid": cells that fit the largest.
STRATEGIES = ("hierarchical", "multi", "single grid")

#: Lines around a cell of which a grain looks at those that come later, in half the cases its own: in space, in a plane.
LINES = {3: 5.0, 2: 2.0}


class Survey(NamedTuple):
    """The radii of all grains on all ranks.

    ``largest``: (k,) largest radius in each bin that holds any, ascending [length]. ``count``: (k,) grains in it. ``volume``: of
    the box around all grains [length^3]. ``dimension``: 2 where all centres have one z; then the volume is an area [length^2].
    """

    largest: np.ndarray
    count: np.ndarray
    volume: float
    dimension: int = 3

    @property
    def widest(self):
        """The largest radius [length]."""
        return float(self.largest[-1]) if len(self.largest) else 0.0

    @property
    def typical(self):
        """Geometric mean of the radii [length]: small grains count as much as they are many."""
        if len(self.largest) < 2:
            return self.widest
        return float(np.exp((np.log(self.largest) * self.count).sum() / self.count.sum()))


def survey(comm, box, place, separators=()):
    """``Survey`` of all grains. All ranks must call this.

    Args:
        place: (n, 4) positions and radii of this rank's grains [length].
        separators: radii at which a bin shall end [length].
    """
    *edges, widest, _ = extents(place, -np.inf, np.inf)
    low, high = [*edges[::2], place[:, 3].min(initial=np.inf)], [*edges[1::2], widest if len(place) else -np.inf]
    low, high = np.split(comm.maximum([*np.negative(low), *high]), [4])
    if high[3] < 0.0:  # there are none
        return Survey(np.zeros(0), np.zeros(0, dtype=np.int64), 0.0)
    low, extent = -low, np.where(box.periodic, box.length, high[:3] + low[:3])
    dimension = 2 if extent[2] == 0.0 else 3
    volume = float(np.prod(np.maximum(extent, 2.0 * high[3])[:dimension]))
    if high[3] == low[3]:
        return Survey(high[3:], comm.sum([len(place)]), volume, dimension)
    edges = np.union1d(np.geomspace(low[3], high[3], BINS + 1)[1:-1], separators)
    largest, count = np.empty(len(edges) + 1), np.empty(len(edges) + 1, dtype=np.int64)
    count_sizes(place, edges, largest, count)
    largest, count = comm.maximum(largest), comm.sum(count)
    return Survey(largest[count > 0], count[count > 0], volume, dimension)


class Choice(NamedTuple):
    """Size classes.

    ``largest``: (classes,) radius of the largest grain of each, ascending [length]. ``cuts``: (classes - 1,) radii between one
    and the next. ``count``: (classes,) grains in each. ``per_cell``: (classes,) mean number of them in a cell. ``seconds``: what
    a search by one core is predicted to take, ``seconds_of_one``: with one class of all.
    """

    largest: np.ndarray
    cuts: np.ndarray
    count: np.ndarray
    per_cell: np.ndarray
    seconds: float
    seconds_of_one: float


def divide(sizes, reach, separators):
    """The ``Choice`` of somebody else: radii at which a class ends and at which ``survey`` ended a bin."""
    cuts = np.unique(np.searchsorted(sizes.largest, separators, side="right"))
    return _Model(sizes, reach).choice([int(cut) for cut in cuts if 0 < cut < len(sizes.largest)])


def choose(sizes, reach):
    """The classes that cost least, as a ``Choice``: cuts are added, moved and taken away again while that pays."""
    model, cuts = _Model(sizes, reach), ()
    while True:
        best = min([cuts, *_tries(cuts, len(sizes.largest))], key=model.cost)
        if best == cuts:
            return model.choice(cuts)
        cuts = best


def _tries(cuts, bins):
    """Other cuts to try: one more anywhere, one less, one a little further up or down."""
    free = set(range(1, bins)) - set(cuts)
    tries = {tuple(sorted({*cuts, cut})) for cut in free}
    for cut in cuts:
        rest = set(cuts) - {cut}
        tries |= {tuple(sorted(rest))} | {tuple(sorted({*rest, cut + step})) for step in (-2, -1, 1, 2) if cut + step in free}
    return sorted(tries)


class SizeClasses:
    """The size classes of a simulation.

    Attributes to set at any time between runs:
        separators: radii [length]: grains up to the first are a class, those above it up to the second another, and so on; ()
            makes one class of all. None: those that cost least are chosen from the radii, anew when they have become too dear.
        strategy: one of ``STRATEGIES``; all but the first are there to be compared with it.
        cell: edge of the cells of the smallest class [length]; smaller than what two of its grains span only with "multi". None:
            what they span.

    Attributes to read:
        choice: the ``Choice`` of now; None before the first.
        ghosts: (classes,) ghosts in each on this rank: grains of other ranks; periodic images are none.
        seconds: what the last search took here, on all threads.

    As text, they tell all of this.
    """

    __slots__ = ("_chosen", "_way", "cell", "choice", "ghosts", "seconds", "separators", "strategy")

    def __init__(self):
        self.separators, self.choice, self.ghosts, self.seconds, self._chosen = None, None, None, None, None
        self.strategy, self.cell, self._way = STRATEGIES[0], None, ""

    def __str__(self):
        if self.choice is None:
            return "not chosen yet"
        parts = [
            f"up to radius {largest:.4g}: {count:,} grains, {per_cell:.2g} a cell"
            for largest, count, per_cell in zip(self.choice.largest, self.choice.count.tolist(), self.choice.per_cell)
        ]
        if self.ghosts is not None and self.ghosts.any():
            parts = [f"{part}, {ghosts:,} ghosts" for part, ghosts in zip(parts, self.ghosts.tolist())]
        predicted = f"a search takes one core {self.choice.seconds:.2g} s by the cost model"
        if len(parts) > 1:
            predicted += f", {self.choice.seconds_of_one:.2g} s with one class"
        measured = "" if self.seconds is None else f"; it took {self.seconds:.2g} s here"
        return f"{len(parts)} ({self._way}): {'; '.join(parts)}; {predicted}{measured}"

    def suit(self, sizes, reach):
        """Choose for the ``Survey`` that there are now, where surfaces up to ``reach`` apart are neighbours [length]."""
        separators = self.checked()
        self._way = "chosen" if separators is None else "as given"
        self._way += "" if self.strategy == STRATEGIES[0] else f"; strategy {self.strategy}"
        if separators is not None:
            self.choice, self._chosen = divide(sizes, reach, separators), None
            return
        if self._chosen is not None:  # grains that grow take the cuts along
            kept = divide(sizes, reach, self.choice.cuts * (sizes.widest / self.largest[-1]))
            if self._is_still_good(kept):
                self.choice = kept
                return
        alike = not len(sizes.largest) or sizes.widest <= NARROW * sizes.largest[0]
        self.choice = divide(sizes, reach, ()) if alike else choose(sizes, reach)
        self._chosen = self.choice if sizes.widest > 0.0 else None

    def _is_still_good(self, kept):
        """Whether cuts that were chosen once would do for the grains of now."""
        now, then = kept.count.sum(), self._chosen.count.sum()
        return 0.5 * then <= now <= 2.0 * then and kept.seconds * then <= SLIGHT * self._chosen.seconds * now

    def note(self, seconds, ghost_radius):
        """Note what a search took, and the radii of the ghosts that it saw (k,) [length]."""
        numbers = np.searchsorted(self.choice.largest[:-1], ghost_radius)
        self.seconds, self.ghosts = seconds, np.bincount(numbers, minlength=len(self.choice.largest))

    def checked(self):
        """``separators`` as an array, or None.

        Raises:
            SceneError: they cannot be used, or ``strategy`` or ``cell`` cannot.
        """
        if self.strategy not in STRATEGIES:
            raise SceneError(f"size_classes.strategy = {shown(self.strategy)} must be one of {', '.join(map(repr, STRATEGIES))}")
        number = isinstance(self.cell, (int, float, np.integer, np.floating)) and not isinstance(self.cell, bool)
        if self.cell is not None and not (number and 0.0 < self.cell < np.inf):
            raise SceneError(f"size_classes.cell = {shown(self.cell)} [length] must be None, or a number > 0")
        if self.separators is None:
            return None
        try:
            radii = np.array(self.separators, dtype=np.float64)
            sound = radii.ndim == 1 and bool((np.isfinite(radii) & (radii > 0.0)).all() and (np.diff(radii) > 0.0).all())
        except (TypeError, ValueError):
            sound = False
        if not sound:
            raise SceneError(
                f"size_classes.separators = {shown(self.separators)} must be None, or ascending positive radii; () is one class"
            )
        return radii

    @property
    def largest(self):
        """Radius of the largest grain in each grid, ascending (grids,) [length]."""
        return self.choice.largest if self.strategy == STRATEGIES[0] else self.choice.largest[-1:]

    def edges(self, reach):
        """Edge of the cells of each grid (grids,) [length], where surfaces up to ``reach`` apart are neighbours [length]."""
        edges = 2.0 * (self.choice.largest[:1] if self.strategy == "multi" else self.largest) + reach
        if self.cell is not None:
            edges[0] = self.cell if self.strategy == "multi" else max(self.cell, edges[0])
        return edges


class _Model:
    """What a search costs with given cuts, in nanoseconds."""

    def __init__(self, sizes, reach):
        self.sizes, self.reach = sizes, reach
        self._below = np.concatenate([[0], np.cumsum(sizes.count)])
        self._like = {}

    def cost(self, cuts):
        """Of classes that begin with the bins ``cuts``, and of course the first."""
        classes = self._classes(cuts)
        total = sum(self._of_like(one) for one in classes)
        for k, one in enumerate(classes[:-1]):
            total += self._of_larger(one, classes[k + 1 :])
        return total

    def choice(self, cuts):
        """These classes as a ``Choice``."""
        classes = self._classes(cuts)
        largest = np.array([self._widest(one) for one in classes])
        count = np.array([self._count(*one) for one in classes])
        per_cell = np.array([self._per_cell(*one)[1] for one in classes])
        between = np.array([np.sqrt(self.sizes.largest[cut - 1] * self.sizes.largest[cut]) for cut in cuts])
        return Choice(largest, between, count, per_cell, 1e-9 * self.cost(cuts), 1e-9 * self.cost(()))

    def _classes(self, cuts):
        return list(zip([0, *cuts], [*cuts, max(len(self.sizes.largest), 1)]))

    def _count(self, begin, over):
        return int(self._below[min(over, len(self.sizes.largest))] - self._below[begin])

    def _widest(self, one):
        return float(self.sizes.largest[one[1] - 1]) if len(self.sizes.largest) else 0.0

    def _per_cell(self, begin, over):
        """Edge of a cell of a class, and the grains in it on average."""
        edge = 2.0 * self._widest((begin, over)) + self.reach or 1.0
        cell = edge**self.sizes.dimension
        return edge, self._count(begin, over) * cell / max(self.sizes.volume, cell)

    def _of_like(self, one):
        """Grains of a class among themselves."""
        if one not in self._like:
            count, per_cell = self._count(*one), self._per_cell(*one)[1]
            line = LINE + EIGHT * (3.0 * per_cell / 8.0 + min(3.0 * per_cell, 1.0))  # of three cells
            looks = LINES[self.sizes.dimension] * line
            empty = CELL / max(per_cell, 1.0 / FEWEST) if per_cell * DENSE > 1.0 or count < FEWEST / DENSE else SPARSELY
            self._like[one] = CLASS + count * (GRAIN + looks + empty)
        return self._like[one]

    def _of_larger(self, one, others):
        """Grains of a class that look for those of larger classes."""
        count, (edge, per_cell) = self._count(*one), self._per_cell(*one)
        lists = count / max(TOGETHER * per_cell, 1.0)
        length, found, total = TOGETHER * edge if per_cell * TOGETHER > 1.0 else 0.0, 0.0, LIST * lists
        across, dimension = edge if per_cell > 0.5 else 0.0, self.sizes.dimension
        for other in others:
            far = self._widest(one) + self._widest(other) + self.reach
            cell, there = self._per_cell(*other)
            wide, narrow = (length + 2.0 * far) / cell + 1.0, (across + 2.0 * far) / cell + 1.0
            lines = narrow ** (dimension - 1)
            total += lists * (LIST_LINE * lines + LIST_GRAIN * there * wide * lines)
            near = 4.2 * far**3 + 3.1 * far**2 * (length + 2.0 * across)
            if dimension == 2:
                near = 3.1 * far**2 + 2.0 * far * (length + across)
            found += there / cell**dimension * near
        return total + count * LISTED * (found / 8.0 + min(found, 1.0))
