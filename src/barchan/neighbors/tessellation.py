"""Space shared among grains: sorts them for the kernel of Laguerre cells, and gives it the room that it needs."""

from typing import NamedTuple

import numpy as np

from barchan.kernels.cells import sort_by_cell
from barchan.kernels.laguerre import (
    TOO_FEW_CORNERS,
    TOO_FEW_FACES,
    TOO_FEW_NEAR,
    Faces,
    Sites,
    Work,
    find_laguerre_cells,
    find_site_cells,
)

#: Grains of one grid have radii within this factor.
ONE_GRID = 3.0

#: Parts into which the grains are cut for the threads: many, since cells at a surface take longer.
CHUNKS = 32


class Tessellation(NamedTuple):
    """Cells of the first grains. ``volume``: (n,) [length^3]. ``size``: (n,) distance of the furthest corner [length]. ``start``:
    (n + 1,) where the faces of each begin. ``row``: (faces,) row of the grain beyond, negative at the container. ``area``:
    (faces, 3) outwards [length^2]."""

    volume: np.ndarray
    size: np.ndarray
    start: np.ndarray
    row: np.ndarray
    area: np.ndarray


def tessellate(place, ids, n, low, high):
    """The ``Tessellation`` of a container among grains: cells of the first ``n``.

    Args:
        place: (k, 4) positions and radii of all that may share a face with them [length].
        ids: (k,) theirs, which put equally near ones in order.
        low, high: corners of the container, (3,) each; it holds the first ``n`` centres [length].
    """
    if not n:
        return Tessellation(np.zeros(0), np.zeros(0), np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros((0, 3)))
    sites = _sorted(place, ids)
    spacing = float(np.cbrt(np.prod(np.ptp(place[:, :3], axis=0)) / len(place)))
    guess = max(spacing, float(place[:n, 3].mean()))
    corners, faces, near, room = 512, 64, 256, 24 * (n // CHUNKS + 1)
    while True:
        work = Work(
            np.empty((CHUNKS, 2, corners, 4)),
            np.empty((CHUNKS, 2, faces, 2), dtype=np.int64),
            np.empty((CHUNKS, 2 * faces, 4)),
            np.empty((CHUNKS, near)),
            np.empty((CHUNKS, near), dtype=np.int64),
        )
        cells, found = _rooms(n, room), np.empty(CHUNKS, dtype=np.int64)
        find_laguerre_cells(sites, low, high, guess, n, work, cells, found)
        if (found >= 0).all() and found.max() <= room:
            return _joined(cells, found)
        corners, faces, near = (
            have * (2 if (found == short).any() else 1)
            for have, short in ((corners, TOO_FEW_CORNERS), (faces, TOO_FEW_FACES), (near, TOO_FEW_NEAR))
        )
        room = max(room, int(found.max()))


def _rooms(n, room):
    whole = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    return Faces(*whole, np.empty((CHUNKS, room), dtype=np.int64), np.empty((CHUNKS, room, 3)))


def _joined(cells, found):
    """The chunks, one after the other."""
    row, area = (np.concatenate([part[:k] for part, k in zip(parts, found)]) for parts in (cells.row, cells.area))
    return Tessellation(cells.volume, cells.size, np.append(0, np.cumsum(cells.count)), row, area)


def _sorted(place, ids):
    """The ``Sites``, with a grid for each size class."""
    radius = place[:, 3]
    number = np.floor(np.log(radius.max() / radius) / np.log(ONE_GRID)).astype(np.int64)
    grids = []
    for number_of_class in np.unique(number)[::-1]:
        x = place[number == number_of_class]
        low, extent = x[:, :3].min(axis=0), np.ptp(x[:, :3], axis=0)
        edge = max(float(np.cbrt(np.prod(extent) / len(x))), 2.0 * float(x[:, 3].max()))
        shape = np.maximum(np.floor(extent / edge), 1.0)
        grids.append((x[:, 3].max(), low, shape / np.where(extent > 0.0, extent, 1.0), shape))
    largest, low, inverse, shape = (np.array(column) for column in zip(*grids))
    first = np.append(0, np.cumsum(np.prod(shape, axis=1))).astype(np.int64)
    start, rows = np.empty(first[-1] + 1, dtype=np.uint32), np.empty(len(place), dtype=np.uint32)
    sites = Sites(np.ascontiguousarray(place), ids, largest, low, inverse, shape.astype(np.int64), first[:-1], start, rows)
    cell = np.empty(len(place), dtype=np.uint32)
    find_site_cells(sites.place, sites, cell)
    sort_by_cell(cell, 0, start, rows)
    return sites
