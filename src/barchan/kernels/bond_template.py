"""The text of the module that ``generate.py`` writes for a bond law: the loop over bonds, written once for all of them.

As in ``template.py``: ``barchan_bond`` takes and returns plain numbers only, and what a bond remembers and does stands in arrays
with a line for each number, so that the loop is vectorised. Rows of ``out``: force on the first grain, torque on the first,
torque on the second. The ends of a bond meet where the distance is divided as the radii are: then a rigid rotation does not move
them along each other, and what the grains do to each other does not turn the pair as a whole.

A step of the leap-frog is a chord. What a bond remembers is turned about the normal by the spins along the middle branch, which
is shorter than the present one: so a rigid rotation by an angle, with spins of 2 tan(angle / 2) / dt, neither moves its ends
along each other nor turns what it remembers against the body.

A stretch is the difference of two distances, without the rounding of either: 2 dt v.x / (distance + distance before), with x in
the middle of the step.
"""

#: Rows of ``out``.
OUT_ROWS = 9

#: Numbers that are read of the two grains of a bond, row by row, before a block is computed (measured at 292,000 bonds: 7.8 ms,
#: and 9.7 if lanes gather them; in the cache the other way round, 0.43 ms and 0.40 at 24,000).
SEEN = 15

#: What stands for a mode where a bond cannot be gone on with: what it remembers is not finite, the mode is none of the law's, or
#: in this step it grew longer than half a period, from where on its nearest image is another.
NOT_FINITE, NO_MODE, TOO_LONG = 252, 253, 254

#: Bonds that are computed before what they remember is written back: in one array the loop would not be vectorised.
BLOCK = 128

BOND_MODULE = '''"""Loops of the bond law '{law}', written by barchan. Do not edit: it is found by the hash of its text."""

{imports}
import numpy as barchan_np
from barchan.kernels.compiler import helper, kernel, prange, widest_lanes
from barchan.kernels.integrate import nearest_image as barchan_nearest_image
from barchan.kernels.turning import carried, spun

{functions}

barchan_law = {function}
barchan_block = barchan_np.uint64({block})
barchan_zero = barchan_np.uint64(0)


@helper
def barchan_bond(dx, dy, dz, vx, vy, vz, wix, wiy, wiz, wjx, wjy, wjz, radius_first, radius_second, mass_eff, strength, dt,
                 {flat_inputs}):
    """One bond: plain numbers to plain numbers."""
    distance = barchan_sqrt(dx * dx + dy * dy + dz * dz)
    per_distance = 1.0 / distance
    normal = dx * per_distance, dy * per_distance, dz * per_distance
    px, py, pz = dx - dt * vx, dy - dt * vy, dz - dt * vz
    barchan_before = barchan_sqrt(px * px + py * py + pz * pz)
    inverse = 1.0 / barchan_before
    barchan_then = px * inverse, py * inverse, pz * inverse
    hx, hy, hz = dx - 0.5 * dt * vx, dy - 0.5 * dt * vy, dz - 0.5 * dt * vz
    length = barchan_sqrt(hx * hx + hy * hy + hz * hz)
    stretch = 2.0 * dt * (vx * hx + vy * hy + vz * hz) / (distance + barchan_before)
    inverse = 1.0 / length
    hx, hy, hz = hx * inverse, hy * inverse, hz * inverse
    share = radius_first / (radius_first + radius_second)
    first, second = share * length, (1.0 - share) * length
    lx, ly, lz = first * wix + second * wjx, first * wiy + second * wjy, first * wiz + second * wjz
    along = vx * hx + vy * hy + vz * hz
    sx, sy, sz = (vx - along * hx - (ly * hz - lz * hy), vy - along * hy - (lz * hx - lx * hz),
                  vz - along * hz - (lx * hy - ly * hx))
    rx, ry, rz = wix - wjx, wiy - wjy, wiz - wjz
    turning = rx * hx + ry * hy + rz * hz
    twist = dt * turning
    half = (hx, hy, hz)
    slip = carried((dt * sx, dt * sy, dt * sz), half, normal)
    bend = carried((dt * (rx - turning * hx), dt * (ry - turning * hy), dt * (rz - turning * hz)), half, normal)
    spin = 0.5 * dt * length * per_distance * ((wix + wjx) * hx + (wiy + wjy) * hy + (wiz + wjz) * hz)
    {turned}
    {outputs} = barchan_law({arguments})
    first, second = share * distance, (1.0 - share) * distance
    nx, ny, nz = normal
    tx, ty, tz = tangential
    cx, cy, cz = couple
    ax, ay, az = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    return (pressing * nx + tx, pressing * ny + ty, pressing * nz + tz, cx - first * ax, cy - first * ay, cz - first * az,
            -cx - second * ax, -cy - second * ay, -cz - second * az, mode{flat_history})


@kernel(parallel=True)
def bond_forces(parts, first, second, kind, strength, place, motion, spin, table, history, broken, out, seen, fresh, modes,
                box_length, box_half, box_tilt, box_rate, dt):
    """Forces and torques of all bonds. Thread p does the bonds ``parts[p]`` to ``parts[p + 1]``, with ``seen[p]``, ``fresh[p]``
    and ``modes[p]`` as room for what a block of them reads of its grains, remembers, and how they break. ``history``, ``out``
    and ``broken``, the number of the mode of each bond that broke, are modified; one that is broken keeps what it remembered as
    it broke.

    Returns:
        How many broke."""
    lengths = box_length[0], box_length[1], box_length[2]
    halves = box_half[0], box_half[1], box_half[2]
    tilts = box_tilt[0], box_tilt[1], box_tilt[2]
    rates = box_rate[0], box_rate[1], box_rate[2], box_rate[3], box_rate[4], box_rate[5]
    {hoisted}
    news = 0
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        last = parts[barchan_np.uint64(p + 1)]
        for begin in range(parts[p], last, barchan_block):
            length = min(barchan_block, last - begin)
            for c in range(length):
                i = first[begin + c]
                j = second[begin + c]
                for axis in range(3):
                    seen[p, axis, c] = place[i, axis] - place[j, axis]
                    seen[p, 3 + axis, c] = motion[i, axis] - motion[j, axis]
                    seen[p, 6 + axis, c] = spin[i, axis]
                    seen[p, 9 + axis, c] = spin[j, axis]
                seen[p, 12, c] = place[i, 3]
                seen[p, 13, c] = place[j, 3]
                seen[p, 14, c] = motion[i, 3] + motion[j, 3]
            for c in range(length):
                k = begin + c
                dx, dy, dz = barchan_nearest_image(seen[p, 0, c], seen[p, 1, c], seen[p, 2, c], lengths, halves, tilts)
                {gathered}
                fx, fy, fz, ux, uy, uz, wx, wy, wz, barchan_mode{history_names} = barchan_bond(
                    dx, dy, dz, seen[p, 3, c] + rates[0] * dx + (rates[3] * dy + rates[4] * dz),
                    seen[p, 4, c] + rates[1] * dy + rates[5] * dz, seen[p, 5, c] + rates[2] * dz,
                    seen[p, 6, c], seen[p, 7, c], seen[p, 8, c], seen[p, 9, c], seen[p, 10, c], seen[p, 11, c], seen[p, 12, c],
                    seen[p, 13, c], 1.0 / seen[p, 14, c], strength[k], dt, {flat_arguments})
                {keep}
                mode = 1.0 * barchan_mode
                is_one = mode >= 0.0 and mode <= {n_modes}.0 and mode == barchan_np.floor(mode)
                mode = mode if is_one else {no_mode}.0
                ax, ay, az = (abs(dx - dt * seen[p, 3, c]) - halves[0], abs(dy - dt * seen[p, 4, c]) - halves[1],
                              abs(dz - dt * seen[p, 5, c]) - halves[2])
                mode = {too_long}.0 if max(ax, max(ay, az)) > 0.0 else mode
                barchan_total = {total}
                modes[p, c] = mode if barchan_total - barchan_total == 0.0 else {not_finite}.0
            for c in range(length if dt > 0.0 else barchan_zero):
                k = begin + c
                holds = broken[k] == 0
                {keep_fresh}
                broken[k] = barchan_np.uint8(modes[p, c]) if holds else broken[k]
                news += 1 if holds and modes[p, c] != 0 else 0
    return news
'''

#: What stands in it for bond laws that tell what they store.
BOND_ENERGIES = '''

@kernel(parallel=True)
def barchan_energies(radius_first, radius_second, kind, table, memory, energies):
    """What each bond stores: written into ``energies`` (k,)."""
    for c in prange(kind.shape[0]):
        energies[c] = {call}
'''
