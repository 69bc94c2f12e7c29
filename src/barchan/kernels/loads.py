"""What grains do to walls, summed exactly over their contacts."""

import math

from barchan.kernels.compiler import helper, kernel, prange
from barchan.kernels.exact_sum import add, carry, value_of

#: Sums for each wall: force and torque on it, normal forces, and how many contacts there are.
SUMS = 8


@helper
def _add(rows, row, value):
    if value - value == 0.0:
        add(rows[row], value)
    else:
        rows[row, -1] += 1


@kernel(parallel=True)
def sum_loads(begin, number, slot, out, surface, grain, place, points, limbs):
    """Add the contacts of all walls to ``limbs`` (walls, SUMS, LIMBS + 1), which is modified; the last of a row counts values
    that are not finite.

    Args:
        begin: (walls + 1,) where the contacts of each wall begin.
        number: of the first contact with a wall among all contacts.
        points: (walls, 3) about which torque is taken.
    """
    for w in prange(points.shape[0]):
        for c in range(begin[w], begin[w + 1]):
            k = slot[number + c]
            if k != 0:
                i = grain[c]
                fx, fy, fz = -out[0, k], -out[1, k], -out[2, k]
                distance, nx, ny, nz = surface[0, c], surface[1, c], surface[2, c], surface[3, c]
                rx = place[i, 0] - distance * nx - points[w, 0]
                ry = place[i, 1] - distance * ny - points[w, 1]
                rz = place[i, 2] - distance * nz - points[w, 2]
                _add(limbs[w], 0, fx)
                _add(limbs[w], 1, fy)
                _add(limbs[w], 2, fz)
                _add(limbs[w], 3, ry * fz - rz * fy)
                _add(limbs[w], 4, rz * fx - rx * fz)
                _add(limbs[w], 5, rx * fy - ry * fx)
                if out.shape[0] > 8:  # a law with couples: in the last three rows
                    for row in range(3):
                        _add(limbs[w], 3 + row, -out[out.shape[0] - 3 + row, k])
                _add(limbs[w], 6, -(fx * nx + fy * ny + fz * nz))
                _add(limbs[w], 7, 1.0)
        for row in range(SUMS):
            carry(limbs[w, row, :-1])


@kernel()
def sum_by_wall(begin, values, limbs):
    """Add ``values`` (rows, contacts with walls) to ``limbs`` (walls, rows, LIMBS + 1) as ``sum_loads`` does."""
    for w in range(limbs.shape[0]):
        for row in range(values.shape[0]):
            for c in range(begin[w], begin[w + 1]):
                _add(limbs[w], row, values[row, c])
            carry(limbs[w, row, :-1])


@kernel()
def values_of(limbs, sums):
    """Write the sums in ``limbs`` of all ranks together into ``sums`` (walls, rows): NaN where a value was not finite. Both are
    modified: ``limbs`` is worth nothing afterwards."""
    for w in range(limbs.shape[0]):
        for row in range(limbs.shape[1]):
            sums[w, row] = value_of(limbs[w, row, :-1]) if limbs[w, row, -1] == 0 else math.nan
