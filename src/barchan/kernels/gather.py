"""Sums the forces of a grain's contacts, always in the order of the partner's key, so that the sum has the same bits
wherever and whenever it is made. Indices are unsigned: signed ones cost a fifth more here (they may count from the end)."""

import numpy as np

from barchan.kernels.compiler import kernel, on_one_thread, prange


@kernel(parallel=True)
def gather_forces(start, touched, incidence, slot, out, place, mass, gravity, force, torque):
    """Equations (9) and (10). ``force`` and ``torque`` are modified.

    Args:
        start, touched, incidence: the contacts that touch grain i are ``touched[i]`` entries of ``incidence`` from
            ``start[i]`` on, as 2 * contact + side (side 1: it is the second grain, which feels the opposite force).
        slot: (contacts,) column of each contact in ``out``.
        out: (6 to 11, columns): force on the first, n x F_t, and arms of first and second; without arms they are the radii.
            Couples, in the last three rows of 9 or 11, are not for here: ``couples.add_couples``.

    Returns:
        Number of grains whose force is not finite.
    """
    bad = 0
    given = out.shape[0] == 8 or out.shape[0] == 11
    for i in prange(touched.shape[0]):
        fx = mass[i] * gravity[0]
        fy = mass[i] * gravity[1]
        fz = mass[i] * gravity[2]
        tx = 0.0
        ty = 0.0
        tz = 0.0
        for q in range(start[i], start[i] + touched[i]):
            entry = incidence[q]
            k = slot[np.uint32(entry >> 1)]
            side = np.uint32(entry & 1)
            sign = 1.0 - 2.0 * side
            arm = out[np.uint32(6 + side), k] if given else 1.0
            fx += sign * out[0, k]
            fy += sign * out[1, k]
            fz += sign * out[2, k]
            tx -= arm * out[3, k]
            ty -= arm * out[4, k]
            tz -= arm * out[5, k]
        arm = 1.0 if given else place[i, 3]
        tx *= arm
        ty *= arm
        tz *= arm
        force[i, 0] = fx
        force[i, 1] = fy
        force[i, 2] = fz
        torque[i, 0] = tx
        torque[i, 1] = ty
        torque[i, 2] = tz
        total = fx + fy + fz + tx + ty + tz
        bad += 0 if total - total == 0.0 else 1
    return bad


gather_forces_alone = on_one_thread(gather_forces)
