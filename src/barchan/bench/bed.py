"""Beds of any size for scaling studies: the settled dense flow side by side, of which each rank makes only what is near it."""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from barchan.bench import cases
from barchan.bench.case import Grains
from barchan.domain import Box
from barchan.laws import hertz_standard
from barchan.materials import Material
from barchan.simulation import Simulation
from barchan.walls import Plane

#: Tiles that are added together: a million grains, of which a rank holds its own part only.
TILES = 32


class Bed(NamedTuple):
    """A bed of ``columns`` x ``rows`` tiles of ``grains``, ``side`` wide each."""

    grains: Grains
    side: float
    columns: int
    rows: int

    @property
    def count(self):
        """How many grains there are."""
        return len(self.grains.radius) * self.columns * self.rows


def bed(count, journal):
    """A ``Bed`` of ``count`` grains, up to one for each tile: the lowest ones of each.

    Args:
        journal: tells of the settled state, if it has to be made first.
    """
    grains, side = cases.dense_flow()
    settled = cases.settled_flow(journal)
    tiles = ceil(count / len(grains.radius))
    columns = ceil(sqrt(tiles))
    rows = ceil(tiles / columns)
    lowest = np.argsort(settled[:, 2], kind="stable")[: round(count / (columns * rows))]
    return Bed(grains._replace(position=settled).take(np.sort(lowest)), side, columns, rows)


def simulation(made, threads, comm):
    """The simulation of a ``Bed`` on the ranks of ``comm``, moving as the flow did."""
    sim = without_grains(made, threads, comm)
    top = made.grains.position[:, 2].max()
    sim.share_space([((0.0, 0.0, 0.0), (made.columns * made.side, made.rows * made.side, top))])
    for begin in range(0, made.columns * made.rows, TILES):
        _add_tiles(sim, made, np.arange(begin, min(begin + TILES, made.columns * made.rows)))
    return sim


def without_grains(made, threads, comm):
    """The same, to be filled from a checkpoint."""
    material = Material("grain", **cases.SOFT._asdict())
    high, gravity = (made.columns * made.side, made.rows * made.side, 60.0), cases.downhill(1.0, 24.0)
    sim = Simulation(Box((0, 0, -1), high, (True, True, False)), hertz_standard, material, 5e-4, gravity, threads, comm)
    sim.max_overlap, sim.check_dt = 0.9, False
    sim.add_wall(Plane((0, 0, 0), (0, 0, 1)))
    return sim


def _add_tiles(sim, made, tiles):
    """Add the grains of some tiles, of which this rank makes those that are near it."""
    grains, size = made.grains, len(made.grains.radius)
    corner = made.side * np.stack([tiles // made.rows, tiles % made.rows, np.zeros(len(tiles))], axis=1)
    low, high = sim.space
    own = np.flatnonzero(((corner[:, :2] < high[:2]) & (corner[:, :2] + made.side >= low[:2])).all(axis=1))
    sim.add_part(
        (own[:, None] * size + np.arange(size)).ravel(),
        len(tiles) * size,
        (corner[own, None] + grains.position).reshape(-1, 3),
        np.tile(grains.radius, len(own)),
        mass=np.tile(4.0 / 3.0 * np.pi * grains.radius**3 * grains.density, len(own)),
        velocity=np.tile(grains.velocity, (len(own), 1)),
        omega=np.tile(grains.omega, (len(own), 1)),
    )
