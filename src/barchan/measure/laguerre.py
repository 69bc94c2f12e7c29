"""Which part of space belongs to each grain."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.measure.base import refuse_plane, sphere_volume
from barchan.measure.brick import Brick
from barchan.neighbors.tessellation import tessellate
from barchan.parallel.surroundings import surroundings


class LaguerreCells(NamedTuple):
    """Cells of this rank's grains, in the order of its rows.

    ``id``: (n,). ``volume``: (n,) [length^3]. ``solid_fraction``: (n,) volume of the grain over that of its cell; infinite where
    a larger neighbour leaves it none. ``start``: (n + 1,) where the faces of each cell begin. ``neighbour``: (faces,) id of the
    grain beyond, or -1 to -6 for the faces of the container at low x, high x, low y and so on. ``area``: (faces, 3) vector
    areas, outwards [length^2].
    """

    id: np.ndarray
    volume: np.ndarray
    solid_fraction: np.ndarray
    start: np.ndarray
    neighbour: np.ndarray
    area: np.ndarray


def laguerre_cells(sim, low=None, high=None):
    """The Laguerre (radical Voronoi) cells of all grains: what is nearer to a grain than to any other, by d^2 - R^2.

    Cells tile the container; of grains that do not overlap each holds its grain. Cells end at no periodic face.
    Source: Okabe et al., Spatial Tessellations (2000); Marketos, Granular LAMMPS (2013), ComputeLaguerreAtom.

    Args:
        low, high: corners of the container, a brick in the box that holds all centres [length]; default: those of the box.

    Returns:
        ``LaguerreCells``; each cell the same bits for any number of ranks and threads. All ranks must call this.

    Raises:
        SceneError: the container is no brick in the box, or part of a periodic direction, or a centre lies outside; or the box
            has two dimensions.
    """
    refuse_plane(sim, "laguerre_cells")
    brick = Brick(sim.box, low, high)
    place, ids = sim.grains.block("place"), sim.grains.view("id")
    _check(sim, brick, place)
    around = np.where(sim.box.periodic, sim.box.length, 0.0)  # an image of a grain closes its cell before that
    margin = _first_margin(sim, brick, place)
    while True:
        far, far_ids = surroundings(sim.box, sim.comm, place, ids, margin)
        whole, names = np.concatenate([place, far]), np.concatenate([ids, far_ids])
        cells = tessellate(whole, names, len(place), brick.low - around, brick.high + around)
        needed = float(sim.comm.maximum([_reach(cells.size, place[:, 3], whole[:, 3]).max(initial=0.0)])[0])
        if needed <= margin or (sim.comm.size == 1 and not around.any()):
            break
        margin = min(needed * (1.0 + 1e-9), 2.0 * margin)
    neighbour = np.where(cells.row < 0, cells.row, names[np.maximum(cells.row, 0)])
    with np.errstate(divide="ignore"):
        return LaguerreCells(
            ids.copy(), cells.volume, sphere_volume(place[:, 3]) / cells.volume, cells.start, neighbour, cells.area
        )


def _check(sim, brick, place):
    part = np.array(sim.box.periodic) & ~brick.endless
    if part.any():
        axis = int(np.argmax(part))
        raise SceneError(
            f"laguerre_cells: the container reaches from {brick.low[axis]:g} to {brick.high[axis]:g} [length] along "
            f"{'xyz'[axis]}, where the box is periodic; it must take all of it, {sim.box.low[axis]:g} to {sim.box.high[axis]:g}"
        )
    outside = ((place[:, :3] < brick.low) | (place[:, :3] > brick.high)).any(axis=1)
    if sim.comm.sum(np.array([outside.sum()]))[0]:
        raise SceneError(
            f"laguerre_cells: {int(sim.comm.sum(np.array([outside.sum()]))[0])} centre(s) lie outside the container, from "
            f"{brick.low.tolist()} to {brick.high.tolist()} [length]; make it larger, or remove these grains"
        )


def _first_margin(sim, brick, place):
    """How far around a rank grains are looked for at first [length]: cells mostly end two or three spacings away."""
    count = sim.comm.sum(np.array([len(place)]))[0]
    largest = sim.comm.maximum([place[:, 3].max(initial=0.0)])[0]
    return 4.0 * float(np.cbrt(np.prod(brick.high - brick.low) / max(count, 1))) + 2.0 * float(largest)


def _reach(size, radius, others):
    """How far away a grain as large as any of the ``others`` may be and cut a cell of this size."""
    largest = others.max(initial=0.0)
    return size + np.sqrt(np.maximum(size * size + largest * largest - radius * radius, 0.0))
