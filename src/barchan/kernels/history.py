"""Carries the memory of contacts over a rebuild: from contacts to rows of their grains, and back by key."""

from barchan.kernels.compiler import helper, kernel, prange


@helper
def _remembers(history, k):
    for c in range(history.shape[0]):
        if history[c, k] != 0.0:
            return True
    return False


@kernel(parallel=True)
def count_rows(start, incidence, history, on_both, counts):
    """Write into ``counts`` how many contacts each grain remembers: those whose history is not all zero, and of which it is
    the first grain unless they are wanted ``on_both``."""
    for i in prange(counts.shape[0]):
        count = 0
        for q in range(start[i], start[i + 1]):
            entry = incidence[q]
            if (on_both or entry & 1 == 0) and _remembers(history, entry >> 1):
                count += 1
        counts[i] = count


@kernel(parallel=True)
def detach_rows(start, incidence, history, on_both, partner_keys, row_start, keys, values):
    """Write the remembered contacts of each owned grain to its rows: ``keys`` of the partners, ascending, and ``values``
    (rows, width), both modified."""
    for i in prange(row_start.shape[0] - 1):
        row = row_start[i]
        for q in range(start[i], start[i + 1]):
            entry = incidence[q]
            k = entry >> 1
            if (on_both or entry & 1 == 0) and _remembers(history, k):
                keys[row] = partner_keys[q]
                for c in range(history.shape[0]):
                    values[row, c] = history[c, k]
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
def attach_rows(n_owned, first, second, ids, wall_grain, wall_key, row_start, keys, values, history):
    """Give each contact the values that its owned grain remembers of its partner; others start at zero. ``history`` is
    modified."""
    n_pairs = first.shape[0]
    for k in prange(history.shape[1]):
        if k < n_pairs:
            owner = first[k]
            key = ids[second[k]]
            if owner >= n_owned:
                owner = second[k]
                key = ids[first[k]]
        else:
            owner = wall_grain[k - n_pairs]
            key = wall_key[k - n_pairs]
        for c in range(history.shape[0]):
            history[c, k] = 0.0
        for row in range(row_start[owner], row_start[owner + 1]):
            if keys[row] == key:
                for c in range(history.shape[0]):
                    history[c, k] = values[row, c]
