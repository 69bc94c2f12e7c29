"""What piles up, and shoots up, at a wall across the flow."""

import numpy as np

from barchan.measure.base import Result, flowing_rows, full_step, number, refuse_plane, sphere_volume
from barchan.measure.sums import Bins, exact_sums, quantile


class Jet:
    """The grains that are not frozen and whose centres lie near x = ``wall``, on either side of it; z is up.

    Args:
        wall: x of the wall [length].
        cell: height of the bins in which ``height`` is found [length].
        reach: how far from the wall a grain may be [length]; default: five mean diameters of the grains that flow.

    All results are 0.0 when no grain is there.

    Raises:
        SceneError: an argument is not finite, or not positive where it must be.
    """

    height = Result("z below which 95 % of the mass near the wall lies; error below a cell [length]")
    highest = Result("z of the centre of the highest grain near the wall [length]")
    mass = Result("mass near the wall [mass]")
    solid_volume = Result("volume of the grains near the wall [length^3]")
    rising_mass = Result("mass of the grains near the wall that move up [mass]")
    rising_velocity = Result("mean velocity along z of these, by mass [length/time]")

    def __init__(self, wall, cell, reach=None):
        self.wall, self.cell = number("Jet: wall", wall), number("Jet: cell", cell, positive=True)
        self.reach = None if reach is None else number("Jet: reach", reach, positive=True)

    def compute(self, sim):
        """Measure; returns self.

        Raises:
            SceneError: the cell is too small to count the bins, or the box has two dimensions.
        """
        refuse_plane(sim, "Jet")
        grains, rows = sim.grains, flowing_rows(sim)
        reach = 5.0 * mean_diameter(sim, rows) if self.reach is None else self.reach
        rows = rows[np.abs(grains.view("position")[rows, 0] - self.wall) <= reach]
        z, mass = grains.view("position")[rows, 2], grains.view("mass")[rows]
        velocity = full_step(sim, rows)[0][:, 2]
        top, bottom = sim.comm.maximum([z.max(initial=-np.inf), (-z).max(initial=-np.inf)])
        self.height = self.highest = self.mass = self.solid_volume = self.rising_mass = self.rising_velocity = 0.0
        if top < -bottom:
            return self
        rising = mass * (velocity > 0.0)
        columns = (mass, sphere_volume(grains.view("radius")[rows]), rising, rising * velocity)
        bins = Bins.over(-bottom, top, self.cell)
        by_height = exact_sums(columns, sim.comm, bins.index(z), bins.count)
        self.height, self.highest = quantile(bins, by_height[0], 0.95), float(top)
        self.mass, self.solid_volume, self.rising_mass, momentum = by_height.sum(axis=1).tolist()
        if self.rising_mass:
            self.rising_velocity = momentum / self.rising_mass
        return self


def mean_diameter(sim, rows):
    """Mean diameter of the grains in ``rows`` of all ranks [length]; 0.0 without any."""
    radius = sim.grains.view("radius")[rows]
    total, count = exact_sums((2.0 * radius, np.ones(len(rows))), sim.comm)[:, 0]
    return float(total / count) if count else 0.0
