"""How much of a brick grains fill."""

import math

import numpy as np

from barchan.measure.base import filled_volume
from barchan.measure.brick import Brick
from barchan.measure.disc_cuts import rectangle_area
from barchan.measure.sphere_cuts import brick_volume
from barchan.measure.sums import exact_sums


def solid_fraction(sim, low=None, high=None, volume=None):
    """Volume of the grains in a brick over its volume; in two dimensions area over area, pi r^2 for discs and spheres alike.

    Grains are cut by its faces in closed form: no error but rounding. All grains count, frozen ones too; where two overlap, their
    overlap counts twice.

    Args:
        low, high: corners of the brick [length]; default: those of the box.
        volume: of a room that holds all grains, instead of a brick: ``barchan.walls.Room(sim).volume`` [length^3].

    Raises:
        SceneError: the brick is no brick in the box, or the volume none.
    """
    brick = Brick(sim.box, low, high, volume)
    return _solid_volume(sim, brick) / brick.volume


def void_ratio(sim, low=None, high=None, volume=None):
    """Volume of the voids in a brick over that of the grains, e = (1 - phi) / phi; infinite without grains.

    Takes and raises what ``solid_fraction`` does, which is phi.
    """
    phi = solid_fraction(sim, low, high, volume)
    return (1.0 - phi) / phi if phi else math.inf


def _solid_volume(sim, brick):
    """Volume of all grains in the brick [length^3], or in two dimensions their area [length^2]."""
    place, dimension = sim.grains.block("place"), sim.box.dimension
    cut_volume = brick_volume if dimension == 3 else rectangle_area
    volumes = [np.zeros(0)]
    for shift in brick.shifts:
        radius = place[:, 3]
        low, high = (((face - shift - place[:, :3]) / radius[:, None]).T for face in (brick.low, brick.high))
        low[brick.endless], high[brick.endless] = -np.inf, np.inf
        low, high = low[:dimension], high[:dimension]
        whole = ((low <= -1.0) & (high >= 1.0)).all(axis=0)
        cut = ((low < 1.0) & (high > -1.0)).all(axis=0) & ~whole
        volumes.append(filled_volume(radius[whole], dimension))
        volumes.append(cut_volume(low[:, cut], high[:, cut]) * np.prod([radius[cut]] * dimension, axis=0))
    return float(exact_sums((np.concatenate(volumes),), sim.comm)[0, 0])
