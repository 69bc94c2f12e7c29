"""A cuboid cell of six flat walls, in which a laboratory loads a sample."""

from typing import NamedTuple

import numpy as np

from barchan.walls import Plane, between

#: Names of the walls, in the order in which they are added: -x, +x, -y, +y, -z, +z.
WALLS = ("left", "right", "front", "back", "floor", "top")


class Cell(NamedTuple):
    """The walls of a cell in a simulation, by the names of ``WALLS``."""

    left: Plane
    right: Plane
    front: Plane
    back: Plane
    floor: Plane
    top: Plane

    @classmethod
    def add(cls, sim, size, material):
        """Add the walls of a cell from the origin to ``size``, three numbers [length]."""
        walls = []
        for axis, length in enumerate(size):
            normal = np.eye(3)[axis]
            walls += [Plane(0.0 * normal, normal, material), Plane(length * normal, -normal, material)]
        return cls(*(sim.add_wall(wall) for wall in walls))

    @classmethod
    def of(cls, sim):
        """The cell of a simulation that has one."""
        return cls(*sim.walls[:6])

    def pairs(self):
        """The walls that face each other along x, y and z."""
        return (self.left, self.right), (self.front, self.back), (self.floor, self.top)

    def area(self, axis):
        """Function of the simulation: area of the walls across ``axis``, between the others [length^2]."""
        (first, second), (third, fourth) = (pair for number, pair in enumerate(self.pairs()) if number != axis)
        return between(first, second, third, fourth)

    def corners(self):
        """Low and high corner of the room between the walls, (3,) each [length]."""
        low, high = zip(*((one.point[axis], other.point[axis]) for axis, (one, other) in enumerate(self.pairs())))
        return np.array(low), np.array(high)

    def closing_rates(self):
        """Rates of strain along x, y and z, (3,), positive where walls come closer [1/time]."""
        low, high = self.corners()
        return np.array([[wall.velocity @ wall.normal for wall in pair] for pair in self.pairs()]).sum(axis=1) / (high - low)

    def stresses(self, sim):
        """Stress on each wall, (6,): pressing force over the area between the others [force/length^2]."""
        return np.array([wall.pressing / self.area(axis)(sim) for axis, pair in enumerate(self.pairs()) for wall in pair])
