"""The stress that grains carry, by contacts and by motion."""

from typing import NamedTuple

import numpy as np

from barchan.measure.base import flowing_rows, full_step
from barchan.measure.branches import branches
from barchan.measure.brick import Brick
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts


class Stress(NamedTuple):
    """Mean stress of a part of space, compression positive; [i, j]: force along i through a face across j.

    ``contact``: (3, 3) of Love and Weber [force/length^2]. ``kinetic``: (3, 3) of the fluctuating motion [force/length^2].
    In two dimensions both are (2, 2), of x and y, and forces by length [force/length].
    """

    contact: np.ndarray
    kinetic: np.ndarray

    @property
    def total(self):
        """Sum of both [force/length^2]."""
        return self.contact + self.kinetic

    @property
    def mean_stress(self):
        """p, a third of the trace of the total stress, in two dimensions half of it [force/length^2]."""
        return float(np.trace(self.total)) / len(self.total)

    @property
    def deviatoric_stress(self):
        """q = sqrt(3/2 s:s) with the symmetric deviator s; the difference of axial and radial stress in a triaxial test; in two
        dimensions sqrt(2 s:s), that of the principal stresses [force/length^2]."""
        return deviatoric(self.total)


def stress(sim, low=None, high=None, volume=None):
    """Stress in a brick: 1/V (sum of f_i l_j over contacts + sum of m v'_i v'_j over grains).

    f is the force on a grain and l the branch to its centre: from the centre of the other grain, or, at walls and frozen
    grains, which are the boundary of the sample, from the contact point. A contact counts with the part of its branch that lies
    in the brick, a grain when its centre does. v' is the velocity at the full step less the mean velocity, by mass, of the
    grains in the brick; frozen grains do not move. Gravity and acceleration make the contact stress vary over the brick; this
    is its mean. Source: Love 1927, Weber 1966; the part of the branch: Lutsko, J. Appl. Phys. 64, 1152 (1988).

    Args:
        low, high: corners of the brick [length]; default: those of the box. The volume is that of the brick, so leave out what
            is empty or behind a wall.
        volume: of a room that holds all grains, instead of a brick: ``barchan.walls.Room(sim).volume`` [length^3].

    Returns:
        ``Stress``, the same bits for any number of ranks and threads.

    Raises:
        SceneError: the brick is no brick in the box, the volume none, or grains or walls were changed since the last run.
    """
    check_contacts(sim)
    brick = Brick(sim.box, low, high, volume)
    contact = _contact_sum(sim, brick) / brick.volume
    return Stress(contact, _kinetic_sum(sim, brick) / brick.volume)


def deviatoric(tensor):
    """sqrt(3/2 s:s) with the symmetric deviator s of a (3, 3) tensor, sqrt(2 s:s) of a (2, 2) one: the difference of two
    eigenvalues where the others are alike."""
    dimension = len(tensor)
    s = 0.5 * (tensor + tensor.T) - np.trace(tensor) / dimension * np.eye(dimension)
    return float(np.sqrt(dimension / (dimension - 1) * (s * s).sum()))


def _contact_sum(sim, brick):
    """Sum of f_i l_j of the branches, cut at the faces of the brick, a tensor [force length]."""
    start, branch, force = branches(sim)
    inside = brick.part_of(start, branch) * branch
    axes = range(sim.box.dimension)
    return exact_sums([force[i] * inside[j] for i in axes for j in axes], sim.comm).reshape(len(axes), -1)


def _kinetic_sum(sim, brick):
    """Sum of m v'_i v'_j of the grains in the brick, a tensor [force length]."""
    axes = range(sim.box.dimension)
    rows = flowing_rows(sim)
    rows = rows[brick.holds(sim.grains.view("position")[rows])]
    mass, velocity = sim.grains.view("mass")[rows], full_step(sim, rows)[0].T
    total, *momentum = exact_sums([mass, *(mass * velocity)], sim.comm)[:, 0]
    if total == 0.0:
        return np.zeros((len(axes), len(axes)))
    fluctuation = velocity - (np.array(momentum) / total)[:, None]
    products = [mass * fluctuation[i] * fluctuation[j] for i in axes for j in axes]
    return exact_sums(products, sim.comm).reshape(len(axes), -1)
