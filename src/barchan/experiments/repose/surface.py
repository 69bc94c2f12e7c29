"""The surface of a pile, as a scanner above it sees it."""

from math import ceil
from typing import NamedTuple

import numpy as np

from barchan.measure.base import flowing_rows

#: Lines of sight to a mean diameter.
LINES = 4

#: Sectors of a round pile, or strips of a heap at a wall, whose profiles are taken apart.
PARTS = 8


class Profile(NamedTuple):
    """Height of a surface over the distance from the axis, or from the back wall, in bins a mean diameter wide.

    ``distance`` (bins,): mean of the lines of sight in a bin [length]. ``height``, ``points`` (parts, bins): mean height
    [length] and number of lines in each sector or strip.
    """

    distance: np.ndarray
    height: np.ndarray
    points: np.ndarray

    @property
    def mean(self):
        """Height over all parts, (bins,) [length]."""
        return (self.height * self.points).sum(axis=0) / self.points.sum(axis=0)


def scan(sim, low, high, spacing):
    """Height of the highest surface of a grain that is not frozen on vertical lines, 0 where there is none, (nx, ny) [length].

    The largest of all ranks is the same for any number of them, to the bit.

    Args:
        low, high: corners of the part of the floor that is looked at, x and y [length].
        spacing: of the lines [length].

    Returns:
        (x of the lines (nx,), y (ny,), heights).
    """
    x, y = (a + spacing * (np.arange(max(round((b - a) / spacing), 1)) + 0.5) for a, b in zip(low, high))
    rows = flowing_rows(sim)
    position, radius = sim.grains.view("position")[rows], sim.grains.view("radius")[rows]
    nearest = np.floor((position[:, :2] - low) / spacing).astype(np.int64)
    seen = np.zeros((len(x), len(y)))
    reach = ceil(radius.max(initial=0.0) / spacing)
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            line = nearest + np.array((i, j))
            there = np.flatnonzero(((line >= 0) & (line < seen.shape)).all(axis=1))
            at_x, at_y = line[there].T
            across = (x[at_x] - position[there, 0]) ** 2 + (y[at_y] - position[there, 1]) ** 2
            upward = radius[there] ** 2 - across
            hit = upward > 0.0
            np.maximum.at(seen, (at_x[hit], at_y[hit]), position[there[hit], 2] + np.sqrt(upward[hit]))
    return x, y, sim.comm.maximum(seen.ravel()).reshape(seen.shape)


def profile(sim, scene):
    """The ``Profile`` of the pile of a ``Repose``."""
    half = 0.5 * scene.width
    low, high = ((-scene.floor,) * 2, (scene.floor,) * 2) if scene.method == "cylinder" else ((0.0, -half), (scene.floor, half))
    x, y, height = scan(sim, low, high, scene.diameter / LINES)
    x, y = (axis.ravel() for axis in np.meshgrid(x, y, indexing="ij"))
    if scene.method == "cylinder":
        distance, turn = np.hypot(x, y), np.arctan2(y, x) / (2.0 * np.pi) + 0.5
    else:
        distance, turn = x, y / scene.width + 0.5
    return binned(distance, turn, height.ravel(), scene.diameter, int(scene.floor / scene.diameter))


def binned(distance, turn, height, cell, bins):
    """The ``Profile`` of a scan.

    Args:
        distance, height: (k,) of the lines of sight [length].
        turn: (k,) place across, from 0 to 1: it says in which part a line is.
        cell: width of a bin [length].
        bins: how many; lines beyond are left out.
    """
    column = (distance / cell).astype(np.int64)
    place = np.minimum((turn * PARTS).astype(np.int64), PARTS - 1) * bins + column
    kept = column < bins

    def sums(values):
        return np.bincount(place[kept], values[kept], PARTS * bins).reshape(PARTS, bins)

    points = sums(np.ones(len(distance)))
    return Profile(sums(distance).sum(axis=0) / points.sum(axis=0), sums(height) / np.maximum(points, 1.0), points)
