"""Carries the memory of contacts over a rebuild: from contacts to rows of their grains, and back by key."""

from barchan.kernels.compiler import kernel, prange


@kernel(parallel=True)
def count_rows(start, incidence, slot, on_both, counts):
    """Write into ``counts`` how many contacts each grain remembers: those that have a column, and of which it is the first
    grain unless they are wanted ``on_both``."""
    for i in prange(counts.shape[0]):
        count = 0
        for q in range(start[i], start[i + 1]):
            entry = incidence[q]
            count += (on_both | (entry & 1 == 0)) & (slot[entry >> 1] != 0)
        counts[i] = count


@kernel(parallel=True)
def detach_rows(parts, room, start, incidence, slot, history, on_both, partner_keys, row_start, keys, values):
    """Write the remembered contacts of each owned grain to its rows: ``keys`` of the partners, ascending, and ``values``
    (rows, width), both modified. Thread p does the grains ``parts[p]`` to ``parts[p + 1]``.

    They are listed in ``room[p]`` first, which takes no branch: half of a grain's contacts are the other one's to remember,
    in no order that a processor could foresee (measured: half the time)."""
    for p in prange(parts.shape[0] - 1):
        for i in range(parts[p], parts[p + 1]):
            row = row_start[i]
            for begin in range(start[i], start[i + 1], room.shape[1]):
                count = 0
                for q in range(begin, min(begin + room.shape[1], start[i + 1])):
                    entry = incidence[q]
                    room[p, count] = q
                    count += (on_both | (entry & 1 == 0)) & (slot[entry >> 1] != 0)
                for c in range(count):
                    q = room[p, c]
                    k = slot[incidence[q] >> 1]
                    keys[row] = partner_keys[q]
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


@kernel(parallel=True)
def attach_rows(n_owned, first, start, incidence, contact_keys, row_start, keys, values, slot, history):
    """Give each contact the column and the values that its first owned grain remembers of it. ``slot``, all zero before, and
    ``history`` are modified. Rows and contacts of a grain are both in ascending order of the partner's key."""
    for i in prange(n_owned):
        q, end = start[i], start[i + 1]
        for row in range(row_start[i], row_start[i + 1]):
            while q < end and contact_keys[q] < keys[row]:
                q += 1
            if q < end and contact_keys[q] == keys[row]:
                k = incidence[q] >> 1
                if incidence[q] & 1 == 0 or first[k] >= n_owned:
                    slot[k] = k + 1
                    for c in range(history.shape[0]):
                        history[c, k + 1] = values[row, c]
