"""The text of the module that ``generate.py`` writes for a law: the loop over contacts, written once for all laws.

``barchan_contact`` takes and returns plain numbers only: a tuple inside the body of the parallel loop makes Numba suspect that
arrays alias, and then nothing is vectorised (measured: 1.5 ms against 4.3). Branches inside it become selects.

``pair_forces`` works on blocks of candidates that stay in the cache: one loop finds the distances and lists those that touch,
eight at a time, another, vectorised, computes these. A contact that touches gets a *column* of ``out``; ``slot`` says which. It
depends on how the candidates are shared among threads; what stands in it does not. Its memory stands in a column of ``history``:
that of the c-th contact that touches, from 1 on, of a block that begins with candidate b is b + c. So the memory of a step
takes the place of that of the step before, block by block. Grains whose contacts began or ended since the step before are
marked in ``changed``.
All indices are unsigned: a signed one may count from the end, and then the vectoriser gives up.

Rows of ``out``: force on the first grain, n x F_t, and for lens arms the arms of both grains: a grain's torque is minus
its arm times n x F_t (six rows instead of nine are a third less to write and read). Of a law with couples, three more: that on
the first grain.
"""

import numpy as np

from barchan.kernels.compiler import shares
from barchan.kernels.lanes import LANES

#: Overlap of a contact that rounding puts on the edge of touching: its square root and its square are ordinary numbers.
LEAST_OVERLAP = 1e-100
AT_LEAST = f"overlap = max(overlap, {LEAST_OVERLAP})"

#: Candidates that are looked at before those that touch are computed: 30 kB of memory in between (measured: 256 to 2048 alike).
#: A multiple of the lanes, so that a block's are never another thread's.
BLOCK = 64 * LANES

MODULE = '''"""Loops of the law '{law}', written by barchan. Do not edit: it is found by the hash of its text."""

{imports}
import numpy as barchan_np
from barchan.kernels.compiler import helper, kernel, on_one_thread, prange, widest_lanes
from barchan.kernels.damp import damp_alone as barchan_damp
from barchan.kernels.gather import gather_forces_alone as barchan_gather_forces
from barchan.kernels.integrate import kick_drift_wrap_alone as barchan_kick_drift_wrap
from barchan.kernels.integrate import approach_after as barchan_approach_after
from barchan.kernels.integrate import measure_travel as barchan_measure_travel
from barchan.kernels.integrate import nearest_image as barchan_nearest_image
from barchan.kernels.lanes import list_touching as barchan_list_touching
from barchan.kernels.lanes import list_touching_aside as barchan_list_touching_aside
from barchan.kernels.incidence import order_incidence_alone as barchan_order_incidence
from barchan.kernels.mesh_steps import measure_meshes as barchan_measure_meshes
from barchan.kernels.mesh_steps import move_meshes as barchan_move_meshes
from barchan.kernels.mesh_steps import travel_of_meshes as barchan_travel_of_meshes
from barchan.kernels.planes import measure_plane_alone as barchan_measure_plane
from barchan.kernels.wire import agree as barchan_agree
from barchan.kernels.wire import largest_of_all as barchan_largest_of_all
from barchan.kernels.wire import receive_ghosts as barchan_receive_ghosts
from barchan.kernels.wire import send_ghosts as barchan_send_ghosts
from barchan.kernels.wire import start_watch as barchan_start_watch

{functions}

{held}barchan_block = barchan_np.uint64({block})
barchan_lanes = barchan_np.uint64({lanes})
barchan_zero = barchan_np.uint64(0)
barchan_one = barchan_np.uint64(1)
barchan_none = barchan_zero, barchan_zero, barchan_zero


@helper
def barchan_separation(dx, dy, dz, vx, vy, vz, dt):
    """Distance, unit normal at the full step and unit normal at the half step."""
    distance = barchan_sqrt(dx * dx + dy * dy + dz * dz)
    inverse = 1.0 / distance
    hx, hy, hz = dx - 0.5 * dt * vx, dy - 0.5 * dt * vy, dz - 0.5 * dt * vz
    half = 1.0 / barchan_sqrt(hx * hx + hy * hy + hz * hz)
    return distance, dx * inverse, dy * inverse, dz * inverse, hx * half, hy * half, hz * half


@helper
def barchan_slip(vx, vy, vz, lx, ly, lz, nx, ny, nz):
    """Velocity of turning surfaces in the plane of n: v - (v.n) n - l x n, equation (3), l = arm_i omega_i + arm_j omega_j."""
    along = vx * nx + vy * ny + vz * nz
    return (vx - along * nx - (ly * nz - lz * ny),
            vy - along * ny - (lz * nx - lx * nz),
            vz - along * nz - (lx * ny - ly * nx))


@helper
def barchan_contact(overlap, distance, arm_first, arm_second, nx, ny, nz, hx, hy, hz, radius_first, radius_second, radius_eff,
                    mass_eff, vx, vy, vz, wix, wiy, wiz, wjx, wjy, wjz, dt, {flat_inputs}):
    """One contact: plain numbers to plain numbers."""
    {at_least}
    normal = (nx, ny, nz)
    normal_half = (hx, hy, hz)
    lx, ly, lz = arm_first * wix + arm_second * wjx, arm_first * wiy + arm_second * wjy, arm_first * wiz + arm_second * wjz
    normal_velocity = vx * nx + vy * ny + vz * nz
    tangential_velocity = barchan_slip(vx, vy, vz, lx, ly, lz, nx, ny, nz)
    slip_velocity_half = barchan_slip(vx, vy, vz, lx, ly, lz, hx, hy, hz)
    {outputs} = {function}({arguments})
    tx, ty, tz = tangential
    ax, ay, az = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    return (pressing * nx + tx, pressing * ny + ty, pressing * nz + tz, ax, ay, az{flat_history})


@kernel(parallel=True)
def pair_forces(parts, first, second, n_owned, place, motion, spin, material, stride, table, slot, history, out, changed, rows,
                branch, fresh, box_length, box_half, box_tilt, box_rate, dt, allowed_overlap, max_overlap):
    """Forces of all pairs of grains that touch. Thread p looks at the candidates ``parts[p]`` to ``parts[p + 1]``.

    ``slot`` (0 or not in, new column out), ``history``, ``out`` and ``changed`` are modified; ``rows``, ``branch`` and ``fresh``
    are room for a block of each thread. Returns (touching, above the allowed overlap, above the largest); a pair across two ranks
    is counted by the owner of its first grain."""
    lengths = box_length[0], box_length[1], box_length[2]
    halves = box_half[0], box_half[1], box_half[2]
    tilts = box_tilt[0], box_tilt[1], box_tilt[2]
    upright = tilts[0] == 0.0 and tilts[1] == 0.0 and tilts[2] == 0.0
    rates = box_rate[0], box_rate[1], box_rate[2], box_rate[3], box_rate[4], box_rate[5]
    {hoisted}
    touching = 0
    large = 0
    too_large = 0
    for p in prange(parts.shape[0] - 1):
        widest_lanes()
        last = parts[barchan_np.uint64(p + 1)]
        column = parts[p] + barchan_np.uint64(1)
        for begin in range(parts[p], last, barchan_block):
            length = min(barchan_block, last - begin)
            found = barchan_none
            for b in range(barchan_zero, length, barchan_lanes):
                {find}
            count, news = found[0], found[1]
            for e in range(news):
                b = rows[p, 2, e]
                changed[first[begin + b]] = 1
                changed[second[begin + b]] = 1
            for c in range(count):
                b = rows[p, 0, c]
                old = rows[p, 1, b]
                k = column + c
                i = first[begin + b]
                j = second[begin + b]
                dx = branch[p, 0, b]
                dy = branch[p, 1, b]
                dz = branch[p, 2, b]
                ri = place[i, 3]
                rj = place[j, 3]
                vx = motion[i, 0] - motion[j, 0] + rates[0] * dx + (rates[3] * dy + rates[4] * dz)
                vy = motion[i, 1] - motion[j, 1] + rates[1] * dy + rates[5] * dz
                vz = motion[i, 2] - motion[j, 2] + rates[2] * dz
                {gathered}
                distance, nx, ny, nz, hx, hy, hz = barchan_separation(dx, dy, dz, vx, vy, vz, dt)
                overlap = ri + rj - distance
                arm_i = {arm_first}
                arm_j = {arm_second}
                fx, fy, fz, ax, ay, az{history_names} = barchan_contact(
                    overlap, distance, arm_i, arm_j, nx, ny, nz, hx, hy, hz, ri, rj, ri * rj / (ri + rj),
                    1.0 / (motion[i, 3] + motion[j, 3]), vx, vy, vz,
                    spin[i, 0], spin[i, 1], spin[i, 2], spin[j, 0], spin[j, 1], spin[j, 2], dt, {flat_arguments})
                {keep}
                counted = overlap if i < n_owned else -1.0
                diameter = 2.0 * min(ri, rj)
                touching += 1 if i < n_owned else 0
                large += 1 if counted > allowed_overlap * diameter else 0
                too_large += 1 if counted > max_overlap * diameter else 0
            home = begin + barchan_np.uint64(1)
            {keep_fresh}
            column += count
    return touching, large, too_large


@kernel(parallel=True)
def wall_forces(grain, surface, place, motion, spin, material, wall_material, stride, table, slot, history, out, changed, fresh,
                number, offset, dt, allowed_overlap, max_overlap):
    """Forces of all contacts of grains with walls. Rows of ``surface``: distance, normal, half-step normal, velocity of
    the wall at the contact, curvature. Contact c is number ``number`` + c, its column is ``offset`` + c + 1. Modifies and returns
    what ``pair_forces`` does; ``fresh`` is room for the memory of all of them."""
    {hoisted}
    touching = 0
    large = 0
    too_large = 0
    for c in prange(grain.shape[0]):
        widest_lanes()
        i = grain[c]
        k = offset + c + barchan_np.uint64(1)
        was = slot[number + c] != 0
        old = k * was
        ri = place[i, 3]
        distance = surface[0, c]
        {wall_gathered}
        overlap = ri - distance
        fx, fy, fz, ax, ay, az{history_names} = barchan_contact(
            overlap, distance, {wall_arm}, ri, surface[1, c], surface[2, c], surface[3, c], surface[4, c], surface[5, c],
            surface[6, c], ri, ri, ri / (1.0 + surface[10, c] * ri), 1.0 / motion[i, 3],
            motion[i, 0] - surface[7, c], motion[i, 1] - surface[8, c], motion[i, 2] - surface[9, c],
            spin[i, 0], spin[i, 1], spin[i, 2], 0.0, 0.0, 0.0, dt, {flat_arguments})
        touches = {touches}
        slot[number + c] = k if touches else barchan_np.uint64(0)
        if touches != was:
            changed[i] = 1
        {keep_at_wall}
        touching += 1 if touches else 0
        large += 1 if overlap > allowed_overlap * 2.0 * ri else 0
        too_large += 1 if overlap > max_overlap * 2.0 * ri else 0
    home = offset + barchan_np.uint64(1)
    {keep_fresh_at_wall}
    return touching, large, too_large
'''


#: How it finds what touches; a step is 10 % shorter where tilts are known to be 0.
FIND = """if upright:
                    found = barchan_list_touching(first, second, place, begin + b, last, lengths, halves, tilts, slot, column, b,
                                                  rows[p], branch[p], found)
                else:
                    found = barchan_list_touching_aside(first, second, place, begin + b, last, lengths, halves, tilts, slot,
                                                        column, b, rows[p], branch[p], found)"""

#: The same for laws that reach beyond touching: one pair after another.
FIND_HELD = """found = barchan_list_held(first, second, place, begin + b, last, lengths, halves, tilts, slot, column, b, rows[p],
                                          branch[p], found, material, stride, table)"""
HELD = '''
@helper
def barchan_list_held(first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found, material,
                      stride, table):
    """List the pairs that touch, and those that did and are still within the law's reach."""
    count, news, before = found
    for c in range(min(barchan_lanes, over - begin)):
        k = begin + c
        i, j, was = first[k], second[k], slot[k] != 0
        dx, dy, dz = place[i, 0] - place[j, 0], place[i, 1] - place[j, 1], place[i, 2] - place[j, 2]
        dx, dy, dz = barchan_nearest_image(dx, dy, dz, lengths, halves, tilts)
        branch[0, b + c], branch[1, b + c], branch[2, b + c] = dx, dy, dz
        square = dx * dx + dy * dy + dz * dz
        ri, rj = place[i, 3], place[j, 3]
        touch = square < (ri + rj) * (ri + rj)
        if was and not touch:
            {parameters}
            apart = ri + rj + {reach}
            touch = square < apart * apart
        rows[1, b + c] = 0
        if was:
            before += barchan_one
            rows[1, b + c] = begin - b + before
        if was != touch:
            rows[2, news] = b + c
            news += barchan_one
        slot[k] = 0
        if touch:
            rows[0, count] = b + c
            slot[k] = column + count
            count += barchan_one
    return count, news, before


'''


def whole_blocks(n_pairs):
    """Candidates of as many whole blocks as ``n_pairs`` fill or begin."""
    return -(-n_pairs // BLOCK) * BLOCK


def block_rooms(n_pairs, history_width, begin=0):
    """What ``pair_forces`` needs for each thread: where its candidates begin, (threads + 1,), which is where a block begins, and
    room for a block of them.

    Args:
        n_pairs: where the candidates end.
        begin: the first of them, where a block begins.

    Returns:
        (parts, rows (threads, 3, BLOCK), branch vectors (threads, 3, BLOCK), new memory (threads, history_width, BLOCK)).
    """
    blocks = shares(whole_blocks(n_pairs - begin) // BLOCK)
    parts = np.minimum(np.uint64(begin) + blocks * np.uint64(BLOCK), np.uint64(n_pairs))
    rows, *rooms = ((len(parts) - 1, count, BLOCK) for count in (3, 3, history_width))
    return parts, np.empty(rows, np.uint32), *(np.empty(room) for room in rooms)


#: Torque arms: name -> (arm of the first, arm of the second, arm of a grain at a wall).
ARMS = {
    "radius": ("ri", "rj", "ri"),
    "lens": ("ri - 0.5 * overlap * (2.0 * rj - overlap) / distance", "distance - arm_i", "distance"),
}
