"""Adds the couples of a grain's contacts to its torque, for laws that have some: in the order of ``gather.py``."""

import numpy as np

from barchan.kernels.compiler import kernel, on_one_thread, prange


@kernel(parallel=True)
def add_couples(start, touched, incidence, slot, out, torque):
    """Add what contacts turn each grain by. ``torque`` is modified.

    Args:
        start, touched, incidence, slot: as for ``gather.gather_forces``.
        out: (9 or 11, columns): the last three rows are the couple on the first grain; the second feels the opposite.

    Returns:
        Number of grains whose torque is not finite.
    """
    bad = 0
    row = out.shape[0] - 3
    for i in prange(touched.shape[0]):
        tx = torque[i, 0]
        ty = torque[i, 1]
        tz = torque[i, 2]
        for q in range(start[i], start[i] + touched[i]):
            entry = incidence[q]
            k = slot[np.uint32(entry >> 1)]
            sign = 1.0 - 2.0 * np.uint32(entry & 1)
            tx += sign * out[np.uint32(row), k]
            ty += sign * out[np.uint32(row + 1), k]
            tz += sign * out[np.uint32(row + 2), k]
        torque[i, 0] = tx
        torque[i, 1] = ty
        torque[i, 2] = tz
        total = tx + ty + tz
        bad += 0 if total - total == 0.0 else 1
    return bad


add_couples_alone = on_one_thread(add_couples)
