"""Carries the memory of contacts over a rebuild: from the old list to the new one where a grain stays with its rank; with a grain
that leaves, as rows of its own, which are found again by key."""

import numpy as np

from barchan.kernels.compiler import helper, kernel, prange
from barchan.kernels.incidence import partner_key


@kernel(parallel=True)
def find_columns(slot, n_pairs, block, columns):
    """Write the column of each contact's memory into ``columns``, or 0 if it does not touch; see ``kernels/template.py``."""
    blocks = (n_pairs + block - 1) // block
    for number in prange(blocks):
        column = number * block
        for k in range(number * block, min((number + 1) * block, n_pairs)):
            touches = slot[k] != 0
            column += touches
            columns[k] = column * touches
    for k in range(n_pairs, slot.shape[0]):
        columns[k] = blocks * block + 1 + k - n_pairs if slot[k] != 0 else 0


@kernel(parallel=True)
def bring_memory(parts, room, slot, n_pairs, history, brought):
    """Bring the columns of ``history`` that ``slot`` tells to where they belong in ``brought``. Thread p does the blocks
    ``parts[p]`` to ``parts[p + 1]``, with ``room[p]``, (block,), for the columns of one: they are listed first, which takes no
    branch (measured where one of seven touches: half the time)."""
    block = room.shape[1]
    for p in prange(parts.shape[0] - 1):
        for number in range(np.int64(parts[p]), np.int64(parts[p + 1])):
            count, column = 0, number * block + 1
            for k in range(number * block, min((number + 1) * block, n_pairs)):
                room[p, count] = slot[k]
                count += slot[k] != 0
            for c in range(history.shape[0]):
                for q in range(count):
                    brought[c, column + q] = history[c, room[p, q]]
    first_at_wall = (n_pairs + block - 1) // block * block + 1
    for k in range(n_pairs, slot.shape[0]):
        for c in range(history.shape[0]):
            brought[c, first_at_wall + k - n_pairs] = history[c, slot[k]]
    for c in range(history.shape[0]):
        brought[c, 0] = 0.0


@kernel(parallel=True)
def count_rows(start, touched, incidence, wanted, on_both, counts):
    """Write into ``counts`` how many contacts each of the ``wanted`` grains remembers: those that touch, and of which it is the
    first grain unless they are asked for ``on_both``."""
    for i in prange(counts.shape[0]):
        count = 0
        for q in range(start[i], start[i] + wanted[i] * touched[i]):
            count += on_both | (incidence[q] & 1 == 0)
        counts[i] = count


@kernel(parallel=True)
def detach_rows(
    parts, room, first, second, ids, wall_key, start, touched, incidence, columns, history, on_both, row_start, keys, values
):
    """Write the remembered contacts of each grain that has rows to them: ``keys`` of the partners, ascending, and ``values``
    (rows, width), both modified. Thread p does the grains ``parts[p]`` to ``parts[p + 1]``.

    They are listed in ``room[p]`` first, which takes no branch: half of a grain's contacts are the other one's to remember,
    in no order that a processor could foresee (measured: half the time)."""
    for p in prange(parts.shape[0] - 1):
        for i in range(parts[p], parts[p + 1]):
            row = row_start[i]
            last = start[i] + touched[i] * (row < row_start[i + 1])
            for begin in range(start[i], last, room.shape[1]):
                count = 0
                for q in range(begin, min(begin + room.shape[1], last)):
                    entry = incidence[q]
                    room[p, count] = entry
                    count += on_both | (entry & 1 == 0)
                for c in range(count):
                    entry = room[p, c]
                    k = columns[entry >> 1]
                    keys[row] = partner_key(i, entry, first, second, ids, wall_key)
                    for w in range(history.shape[0]):
                        values[row, w] = history[w, k]
                    row += 1


@kernel(parallel=True)
def permute_rows(order, old_start, old_keys, old_values, new_start, keys, values):
    """Bring rows into a new order of grains; ``keys`` and ``values`` are modified."""
    for i in prange(order.shape[0]):
        source = old_start[order[i]]
        target = new_start[i]
        for r in range(new_start[i + 1] - target):
            keys[target + r] = old_keys[source + r]
            for c in range(values.shape[1]):
                values[target + r, c] = old_values[source + r, c]


@helper
def row_of(key, begin, end, keys):
    """The first of the ascending ``keys[begin:end]`` that is not smaller than ``key``, or ``end``."""
    while begin < end:
        middle = (begin + end) >> 1
        if keys[middle] < key:
            begin = middle + 1
        else:
            end = middle
    return begin


@helper
def take_row(k, key, begin, end, keys, values, column, slot, history):
    """Give contact ``k`` the row of ``key`` among ``begin`` to ``end``, if there is one."""
    row = row_of(key, begin, end, keys)
    if row < end and keys[row] == key:
        slot[k] = column + row
        for c in range(history.shape[0]):
            history[c, column + row] = values[row, c]


@kernel()
def attach_rows(n_owned, n_inner, first, second, ids, wall_key, start, incidence, row_start, keys, values, column, slot, history):
    """Give each contact the values that one of its grains, or both, has a row for: those of row r stand in ``column`` + r.
    ``slot`` and ``history`` are modified. The rows of a grain or a ghost are in ascending order of the partner's key; pairs from
    ``n_inner`` on have a ghost."""
    for i in range(n_owned):
        begin, end = row_start[i], row_start[i + 1]
        for q in range(start[i], start[i + 1] if end > begin else start[i]):
            key = partner_key(i, incidence[q], first, second, ids, wall_key)
            take_row(incidence[q] >> 1, key, begin, end, keys, values, column, slot, history)
    for k in range(n_inner, first.shape[0]):
        ghost, owned = (first[k], second[k]) if first[k] >= n_owned else (second[k], first[k])
        take_row(k, ids[owned], row_start[ghost], row_start[ghost + 1], keys, values, column, slot, history)


#: Number of a contact, or of a grain's row, that there is not before the rebuild or after it.
NOWHERE = np.uint32(0xFFFFFFFF)


@kernel(parallel=True)
def follow_rows(origin, new_row):
    """Write the row of each grain now into ``new_row``, at the row that it was, ``origin``, unless that is ``NOWHERE``."""
    for i in prange(origin.shape[0]):
        if origin[i] != NOWHERE:
            new_row[origin[i]] = i


@kernel()
def list_remembered(first, second, wall_grain, wall_key, slot, block, rows):
    """Write the contacts that touch into ``rows`` (3, ...): both rows of a pair, or the row and -1 - the key of the wall, and
    the column of its memory. ``slot`` becomes the number of each among them.

    Returns:
        (pairs, all)."""
    n_pairs = first.shape[0]
    blocks = (n_pairs + block - 1) // block
    count = 0
    for number in range(blocks):
        column = number * block
        for k in range(number * block, min((number + 1) * block, n_pairs)):
            touches = slot[k] != 0
            column += touches
            rows[0, count] = first[k]
            rows[1, count] = second[k]
            rows[2, count] = column
            slot[k] = count
            count += touches
    pairs = count
    for c in range(wall_grain.shape[0]):
        touches = slot[n_pairs + c] != 0
        rows[0, count] = wall_grain[c]
        rows[1, count] = -1 - wall_key[c]
        rows[2, count] = blocks * block + 1 + c
        slot[n_pairs + c] = count
        count += touches
    return pairs, count


@kernel(parallel=True)
def list_order(start, touched, incidence, number, begin, entries):
    """Write the contacts that touch grain i, as 2 * number + side and in the order of its sum, to ``entries`` from ``begin[i]``
    on."""
    for i in prange(touched.shape[0]):
        for q in range(touched[i]):
            entry = incidence[start[i] + q]
            entries[begin[i] + q] = 2 * number[entry >> 1] + (entry & 1)


@kernel(parallel=True)
def find_pairs_again(n_pairs, rows, new_row, offsets, first, second, slot, moved):
    """Give pairs that touched their columns in the new list; ``slot``, all zero before, is modified.

    Args:
        n_pairs, rows: as ``list_remembered`` left them.
        new_row: new row of each old one, or ``NOWHERE``.
        offsets: (1 to 3, owned + 1) pairs that grain i found are ``offsets[0, i]`` to ``offsets[0, i + 1]``, with ghosts those
            by the other lines; it is the lower row of the two.
        moved: becomes the new number of each, or ``NOWHERE``.
    """
    n_owned = offsets.shape[1] - 1
    for t in prange(n_pairs):
        one, other = new_row[rows[0, t]], new_row[rows[1, t]]
        lower = min(one, other)
        found = NOWHERE
        if lower < n_owned:
            kinds = (1, offsets.shape[0]) if max(one, other) >= n_owned else (0, 1)
            for kind in range(kinds[0], kinds[1]):
                for new in range(offsets[kind, lower], offsets[kind, lower + 1]):
                    found = new if (first[new] == one) & (second[new] == other) else found
        if found != NOWHERE:
            slot[found] = rows[2, t]
        moved[t] = found


@kernel()
def find_walls_again(begin, end, rows, new_row, wall_of_key, wall_begin, wall_grain, wall_key, n_pairs, slot, moved):
    """The same for contacts at walls, ``begin`` to ``end`` of the old ones; new ones are numbered from ``n_pairs`` on, those of
    wall w are ``wall_begin[w]`` to ``wall_begin[w + 1]``, with ascending rows, and of a row with descending keys.
    ``wall_of_key``: the wall that has key -1 - k."""
    for t in range(begin, end):
        row, key = new_row[rows[0, t]], -1 - np.int64(rows[1, t])
        wall = wall_of_key[rows[1, t]]
        new, last = row_of(row, wall_begin[wall], wall_begin[wall + 1], wall_grain), wall_begin[wall + 1]
        while new < last and wall_grain[new] == row and wall_key[new] != key:
            new += 1
        moved[t] = NOWHERE
        if new < last and wall_grain[new] == row:
            slot[n_pairs + new] = rows[2, t]
            moved[t] = n_pairs + new


@kernel(parallel=True)
def carry_order(origin, moved, begin, entries, start, touched, changed, incidence):
    """Begin the new list of each grain with the contacts that touched, in the order in which they were: that of the partners'
    keys. ``origin`` is the old row of each; of one that had none, all contacts are still to be listed, and it has ``changed``.
    ``touched``, ``changed`` and ``incidence`` are modified."""
    for i in prange(origin.shape[0]):
        old = origin[i]
        last = start[i]
        changed[i] = old == NOWHERE
        if old != NOWHERE:
            for q in range(begin[old], begin[old + 1]):
                entry = entries[q]
                new = moved[entry >> 1]
                if new != NOWHERE:
                    incidence[last] = 2 * new + (entry & 1)
                    last += 1
        touched[i] = last - start[i]
