"""Random places for new grains where they overlap nobody: the same on any number of ranks."""

import numpy as np

from barchan.kernels import cells
from barchan.kernels.room import find_blocked, first_come

#: Places that are tried for a grain at a look. Spheres dropped at random fill at most 0.38 of space, and near that nearly every
#: trial fails (Widom 1966, J. Chem. Phys. 44, 3888): more trials would hardly find more.
TRIALS = 50


def find_room(sim, brick, radius, random):
    """Try random places in a brick. All ranks must call this, with the same arguments.

    Args:
        brick: (2, 3) low and high corner of where centres may be [length].
        radius: (k,) of the new grains [length].
        random: a generator, in the same state on all ranks.

    Returns:
        (places (k, 3) [length], folded into the box; whether one was found, (k,)).
    """
    occupied, frame = _Occupied(sim, brick, radius.max()), sim.box.frame
    placed, found = np.column_stack([np.zeros((len(radius), 3)), radius]), np.zeros(len(radius), dtype=bool)
    for _ in range(TRIALS):
        seeking = np.flatnonzero(~found)
        if not len(seeking):
            break
        points = brick[0] + (brick[1] - brick[0]) * random.random((len(seeking), 3))
        trial = np.column_stack([sim.box.wrap(points)[0], radius[seeking]])
        free = ~occupied.blocks(trial)
        first_come(trial, placed[found], frame.length, frame.half, free)
        placed[seeking[free]] = trial[free]
        found[seeking[free]] = True
    return placed[:, :3], found


class _Occupied:
    """What is in the way in a brick: grains of all ranks, walls. Each rank looks at its own grains, a sum tells all."""

    def __init__(self, sim, brick, widest):
        self.sim, place = sim, sim.grains.block("place")
        reach = widest + (place[:, 3].max() if len(place) else 0.0)
        away = np.abs(sim.box.difference(place[:, :3], brick.mean(axis=0)))
        near = (away <= 0.5 * (brick[1] - brick[0]) + reach * (1.0 + 1e-9)).all(axis=1)
        self.place = np.ascontiguousarray(place[near])
        grid = cells.make_grid(brick[0] - reach, brick[1] + reach, reach, len(self.place), sim.box.frame)
        self.cells = (*cells.sorted_cells(self.place, 0, len(self.place), cells.Grids.of([grid], [np.inf])), grid.table)

    def blocks(self, trial):
        """Whether something is in the way of each trial grain, (k,): the same on all ranks.

        Args:
            trial: (k, 4) positions and radii [length].
        """
        frame, blocked = self.sim.box.frame, np.zeros(len(trial), dtype=np.int64)
        find_blocked(trial, self.place, *self.cells, frame.length, frame.half, blocked)
        for wall in self.sim.walls:
            blocked += wall.distance(trial[:, :3]) < trial[:, 3]
        return self.sim.comm.sum(blocked) > 0
