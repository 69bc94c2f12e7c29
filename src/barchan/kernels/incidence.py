"""Which contacts each grain takes part in, and those that touch in the order in which it sums them."""

import numpy as np

from barchan.kernels.compiler import helper, kernel, on_one_thread, prange


@kernel()
def count_incidence(n_owned, first, second, wall_grain, start):
    """Write into ``start`` (n_owned + 1,) where the contacts of each owned grain begin."""
    start[:] = 0
    for k in range(wall_grain.shape[0]):
        start[wall_grain[k] + 1] += 1
    for k in range(first.shape[0]):
        if first[k] < n_owned:
            start[first[k] + 1] += 1
        if second[k] < n_owned:
            start[second[k] + 1] += 1
    for i in range(n_owned):
        start[i + 1] += start[i]


@kernel()
def fill_incidence(n_owned, first, second, wall_grain, slot, touched, changed, start, incidence):
    """Write each contact, as 2 * contact + side, to its owned grains, after the ``touched[i]`` that are there already: those with
    a column, unless the grain has ``changed``. Wall contacts are numbered after the pairs. ``incidence`` is modified; ``start``
    is left as it was."""
    n_pairs = first.shape[0]
    for i in range(n_owned):
        start[i] += touched[i]
    for k in range(wall_grain.shape[0]):
        i = wall_grain[k]
        if slot[n_pairs + k] == 0 or changed[i] != 0:
            incidence[start[i]] = 2 * (n_pairs + k)
            start[i] += 1
    for k in range(n_pairs):
        i, j, is_new = first[k], second[k], slot[k] == 0
        if is_new or changed[i] != 0 or changed[j] != 0:
            if i < n_owned and (is_new or changed[i] != 0):
                incidence[start[i]] = 2 * k
                start[i] += 1
            if j < n_owned and (is_new or changed[j] != 0):
                incidence[start[j]] = 2 * k + 1
                start[j] += 1
    for i in range(n_owned, 0, -1):
        start[i] = start[i - 1]
    start[0] = 0


@helper
def partner_key(i, entry, first, second, ids, wall_key):
    """Key of the partner of row ``i`` in a contact: the id of a grain, or the negative key of a wall."""
    k = entry >> 1
    if k >= first.shape[0]:
        return wall_key[k - first.shape[0]]
    return ids[first[k] ^ second[k] ^ np.uint32(i)]  # the other of the two, whichever it is, without a branch


@helper
def touching_first(begin, end, incidence, slot):
    """Bring the entries of contacts that have a column before the others, in place; returns where the others begin."""
    last = begin
    for q in range(begin, end):
        entry = incidence[q]
        if slot[entry >> 1] != 0:
            incidence[q] = incidence[last]
            incidence[last] = entry
            last += 1
    return last


@helper
def sort_by_insertion(i, begin, end, incidence, first, second, ids, wall_key):
    """Bring the entries of row ``i`` into ascending order of the partner's key, in place."""
    for q in range(begin, end):
        entry = incidence[q]
        key = partner_key(i, entry, first, second, ids, wall_key)
        p = q
        while p > begin and partner_key(i, incidence[p - 1], first, second, ids, wall_key) > key:
            incidence[p] = incidence[p - 1]
            p -= 1
        incidence[p] = entry


@helper
def sort_by_rank(i, begin, end, incidence, first, second, ids, wall_key, room):
    """The same: an entry goes to the place that is the number of smaller keys. More comparisons than an insertion makes, but
    none that a processor has to foresee (measured on 8 entries a grain: a third of the time)."""
    count = end - begin
    for a in range(count):
        entry = incidence[begin + a]
        room[0, a] = partner_key(i, entry, first, second, ids, wall_key)
        room[1, a] = entry
    for a in range(count):
        place = begin
        for b in range(count):
            place += room[0, b] < room[0, a]
        incidence[place] = room[1, a]


@kernel(parallel=True)
def order_incidence(parts, changed, first, second, ids, wall_key, slot, start, touched, incidence, room):
    """For grains whose contacts began or ended: those that touch, first and in ascending order of the partner's key.

    Thread p does the grains ``parts[p]`` to ``parts[p + 1]`` with ``room[p]``, (2, entries that are sorted by rank).
    ``incidence``, ``touched`` and ``changed``, which is cleared, are modified."""
    for p in prange(parts.shape[0] - 1):
        for i in range(parts[p], parts[p + 1]):
            if changed[i] != 0:
                begin = start[i]
                end = touching_first(begin, start[i + 1], incidence, slot)
                count = end - begin
                if 1 < count <= room.shape[2]:
                    sort_by_rank(i, begin, end, incidence, first, second, ids, wall_key, room[p])
                elif count > 1:
                    sort_by_insertion(i, begin, end, incidence, first, second, ids, wall_key)
                touched[i] = count
                changed[i] = 0


order_incidence_alone = on_one_thread(order_incidence)
