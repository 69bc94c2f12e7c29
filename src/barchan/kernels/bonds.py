"""Sums what bonds do to each grain, in the order of the partners' ids, so that the sum has the same bits wherever it is made."""

import numpy as np

from barchan.kernels.compiler import kernel, prange


@kernel(parallel=True)
def add_bond_forces(start, count, incidence, out, force, torque):
    """Add what bonds do to each owned grain. ``force`` and ``torque`` are modified.

    Args:
        start, count, incidence: bonds of grain i that hold are ``count[i]`` entries of ``incidence`` from ``start[i]`` on, as
            2 * bond + side (side 1: it is the second grain), in ascending order of the partner's id.
        out: (9, bonds) force on the first, torque on the first, torque on the second.

    Returns:
        Number of grains whose force or torque is not finite.
    """
    bad = 0
    for i in prange(count.shape[0]):
        fx, fy, fz = force[i, 0], force[i, 1], force[i, 2]
        tx, ty, tz = torque[i, 0], torque[i, 1], torque[i, 2]
        for q in range(start[i], start[i] + count[i]):
            entry = incidence[q]
            k = np.uint32(entry >> 1)
            side = np.uint32(entry & 1)
            sign = 1.0 - 2.0 * side
            row = np.uint32(3 + 3 * side)
            fx += sign * out[0, k]
            fy += sign * out[1, k]
            fz += sign * out[2, k]
            tx += out[row, k]
            ty += out[row + np.uint32(1), k]
            tz += out[row + np.uint32(2), k]
        force[i, 0], force[i, 1], force[i, 2] = fx, fy, fz
        torque[i, 0], torque[i, 1], torque[i, 2] = tx, ty, tz
        total = fx + fy + fz + tx + ty + tz
        bad += 0 if total - total == 0.0 else 1
    return bad


@kernel()
def take_off(broken, start, count, incidence):
    """Take bonds that are ``broken`` (bonds,), not 0, off the lists of their grains; ``count`` and ``incidence`` are modified.
    What does nothing must not be there: to add 0 makes 0 of -0, and a bond that was forgotten would not."""
    for i in range(count.shape[0]):
        last = start[i]
        for q in range(start[i], start[i] + count[i]):
            entry = incidence[q]
            incidence[last] = entry
            last += broken[entry >> 1] == 0
        count[i] = last - start[i]


@kernel()
def list_bonds(first, second, ids, start, incidence):
    """List the bonds of each owned grain in ascending order of the partner's id; ``start`` (owned + 1,) and ``incidence``
    (2 bonds,) are modified."""
    n_owned = start.shape[0] - 1
    start[:] = 0
    for k in range(first.shape[0]):
        for row in (first[k], second[k]):
            if row < n_owned:
                start[row + 1] += 1
    for i in range(n_owned):
        start[i + 1] += start[i]
    for k in range(first.shape[0]):
        for side in range(2):
            row = second[k] if side else first[k]
            if row < n_owned:
                incidence[start[row]] = 2 * k + side
                start[row] += 1
    for i in range(n_owned, 0, -1):
        start[i] = start[i - 1]
    start[0] = 0
    for i in range(n_owned):
        for q in range(start[i] + 1, start[i + 1]):
            entry = incidence[q]
            partner = ids[first[entry >> 1] ^ second[entry >> 1] ^ np.uint32(i)]
            p = q
            while p > start[i]:
                other = incidence[p - 1]
                if ids[first[other >> 1] ^ second[other >> 1] ^ np.uint32(i)] < partner:
                    break
                incidence[p] = other
                p -= 1
            incidence[p] = entry


@kernel()
def order_by_row(row, begin, order):
    """Write into ``order`` (k,) the numbers of things in ascending order of their ``row``, and as they come among equals.

    Args:
        begin: (rows + 1,) room for where those of each row begin."""
    begin[:] = 0
    for k in range(row.shape[0]):
        begin[row[k] + 1] += 1
    for i in range(begin.shape[0] - 1):
        begin[i + 1] += begin[i]
    for k in range(row.shape[0]):
        order[begin[row[k]]] = k
        begin[row[k]] += 1
