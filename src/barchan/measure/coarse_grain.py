"""Fields of density, momentum and stress on a grid, from grains."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.spread import FINE, LARGEST, Lattice, Stencil, spread
from barchan.measure.base import flowing_rows, full_step, number
from barchan.measure.branches import branches
from barchan.measure.touching import check_contacts
from barchan.words import shown


class CoarseFields(NamedTuple):
    """Fields at the centres of the cells of a grid.

    ``x``, ``y``, ``z``: their coordinates, (nx,), (ny,), (nz,) [length]. ``density``: (nx, ny, nz) [mass/length^3].
    ``momentum``: density of momentum, (nx, ny, nz, 3) [mass/(length^2 time)]. ``contact_stress``, ``kinetic_stress``:
    (nx, ny, nz, 3, 3), signs and order as in ``Stress`` [force/length^2].
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    density: np.ndarray
    momentum: np.ndarray
    contact_stress: np.ndarray
    kinetic_stress: np.ndarray


def coarse_grain(sim, shape, width):
    """Coarse-grained fields of the grains that are not frozen, on a grid over the box.

    Mass and momentum of a grain are spread around its centre, the f_i l_j of a contact along its branch (``stress``), by Lucy's
    kernel (1 + 3 q) (1 - q)^3, q = distance / width, normalised over the grid points that it reaches: sums over the grid times
    the volume of a cell are the mass, the momentum, and volume times contact stress of the whole box, to rounding, with walls and
    periodic faces too. At each point the kinetic stress is that of the motion against momentum / density there. An axis
    with one cell is averaged over. In two dimensions there is one cell along z, and densities and stresses are those of areas.
    Source: Goldhirsch, Granular Matter 12, 239 (2010); Weinhart et al., Granular Matter 14, 289 (2012).

    Args:
        shape: number of cells along x, y and z.
        width: distance at which the kernel ends, at least the longest edge of a cell [length]; a grain diameter or
            more, or grains show one by one.

    Returns:
        ``CoarseFields``, the same bits for any number of ranks and threads.

    Raises:
        SceneError: the shape is not three whole numbers > 0, the width is too small or no number, or grains or walls were changed
            since the last run.
    """
    check_contacts(sim)
    lattice = _lattice(sim.box, shape)
    width = number("coarse_grain: width", width, positive=True)
    cell = lattice.cell * (lattice.count > 1)
    if width < cell.max():
        raise SceneError(
            f"coarse_grain: width = {width:g} [length] is below the longest edge of a cell, {cell.max():g}; use more cells, or a "
            f"larger width"
        )
    density, *flow = np.moveaxis(_grid_sums(sim, *_of_grains(sim), width, lattice), -1, 0)
    stress = _grid_sums(sim, *_of_contacts(sim), width, lattice)
    momentum, square = np.stack(flow[:3], axis=-1), np.stack(flow[3:], axis=-1)
    velocity = momentum / np.where(density > 0.0, density, 1.0)[..., None]
    mean = momentum[..., :, None] * velocity[..., None, :]
    grid = (*density.shape, 3, 3)
    x, y, z = (low + (np.arange(n) + 0.5) * edge for low, n, edge in zip(lattice.low, lattice.count, lattice.cell))
    return CoarseFields(x, y, z, density, momentum, stress.reshape(grid), square.reshape(grid) - mean)


def _lattice(box, shape):
    count = np.array(shape) if isinstance(shape, (tuple, list, np.ndarray)) else np.zeros(0)
    if count.shape != (3,) or count.dtype.kind not in "iu" or (count < 1).any():
        raise SceneError(f"coarse_grain: shape = {shown(shape)} must be three whole numbers > 0: cells along x, y and z")
    if box.dimension == 2 and count[2] != 1:
        raise SceneError(f"coarse_grain: shape = {shown(shape)} must have one cell along z: the box has two dimensions")
    return Lattice(box.low, box.span / count, count.astype(np.int64), np.array(box.periodic, dtype=np.uint8))


def _of_grains(sim):
    """Places, no branches, and mass, momentum (3) and m v_i v_j (9) of the grains, (k, 3), (k, 3), (k, 13)."""
    rows = flowing_rows(sim)
    mass, velocity = sim.grains.view("mass")[rows, None], full_step(sim, rows)[0]
    square = (velocity[:, :, None] * velocity[:, None, :]).reshape(-1, 9)
    place = np.ascontiguousarray(sim.grains.view("position")[rows])
    return place, np.zeros_like(place), np.concatenate([mass, mass * velocity, mass * square], axis=1)


def _of_contacts(sim):
    """Starts, branches and f_i l_j (9) of the contacts, (k, 3), (k, 3), (k, 9)."""
    start, branch, force = (np.ascontiguousarray(vectors.T) for vectors in branches(sim))
    return start, branch, (force[:, :, None] * branch[:, None, :]).reshape(-1, 9)


def _grid_sums(sim, start, branch, amounts, width, lattice):
    """Amounts spread over the grid, by volume, (nx, ny, nz, columns)."""
    largest = sim.comm.maximum(np.abs(amounts).max(axis=0, initial=0.0))
    # Powers of two, so that nothing is rounded; the largest amount of all ranks comes just below 2^LARGEST.
    scale = np.ldexp(1.0, LARGEST - np.maximum(np.frexp(largest)[1], -900))
    reach = np.where(lattice.count > 1, np.ceil(width / lattice.cell), 0).astype(np.int64)
    points = 2 * reach + 1
    stencil = Stencil(np.zeros((3, points.max()), dtype=np.int64), np.zeros((3, points.max())), np.zeros(points))
    sums = np.zeros((np.prod(lattice.count), amounts.shape[1], 2), dtype=np.int64)
    spread(start, branch, amounts * scale, width, lattice, stencil, sums)
    whole, fine = np.moveaxis(sim.comm.sum(sums), -1, 0)
    volume = np.prod(lattice.cell)
    return ((whole + fine * FINE) / scale / volume).reshape(*lattice.count, -1)
