"""Finds which sub-domains grains are in, and the grains that other ranks have to see."""

from barchan.kernels.cells import class_of
from barchan.kernels.compiler import helper, kernel


@helper
def subdomain_at(x, y, z, low, inverse, shape):
    """Place of the sub-domain of a point along each axis; ``inverse`` is that of its edges."""
    cx = min(max(int((x - low[0]) * inverse[0]), 0), shape[0] - 1)
    cy = min(max(int((y - low[1]) * inverse[1]), 0), shape[1] - 1)
    cz = min(max(int((z - low[2]) * inverse[2]), 0), shape[2] - 1)
    return cx, cy, cz


@kernel()
def find_subdomains(position, low, inverse, shape, numbers):
    """Write the number of the sub-domain of each point, counted along z fastest, into ``numbers``."""
    for i in range(position.shape[0]):
        cx, cy, cz = subdomain_at(position[i, 0], position[i, 1], position[i, 2], low, inverse, shape)
        numbers[i] = (cx * shape[1] + cy) * shape[2] + cz


@helper
def gap(x, low, edge, c, step):
    """Distance along one axis from ``x``, in sub-domain ``c``, to the sub-domain that is ``step`` further."""
    if step > 0:
        return max(low + (c + step) * edge - x, 0.0)
    if step < 0:
        return max(x - low - (c + step + 1) * edge, 0.0)
    return 0.0


@helper
def beside(c, step, n, periodic):
    """Number of the sub-domain ``step`` further along an axis of ``n``, or -1 if there is none."""
    c += step
    if 0 <= c < n:
        return c
    return c % n if periodic else -1


@helper
def deep_inside(x, low, edge, c, far):
    """Whether all that is within ``far`` of ``x`` along one axis is in its sub-domain."""
    return gap(x, low, edge, c, -1) > far and gap(x, low, edge, c, 1) > far


@kernel()
def find_sends(place, low, edge, inverse, shape, periodic, span, owners, border, own, largest, reach, rounding, rows, ranks):
    """Write grains and the ranks that must see them into ``rows`` and ``ranks``, in ascending order of rows, each once.

    Args:
        place: (n, 4) positions and radii of the grains of rank ``own``.
        low, edge, inverse, shape, periodic: of the grid of sub-domains, (3,) each, the inverse that of the edge; ``owners`` and
            ``border``, whether others are near, of each sub-domain.
        span: (3,) how many sub-domains away to look.
        largest: (classes,) radius of the largest grain of each size class. reach: how far beyond its own radius and that of its
            class a grain is seen; ``rounding`` more, relatively.

    Returns:
        How many were found, even if there was no room for all.
    """
    count = 0
    for i in range(place.shape[0]):
        x, y, z = place[i, 0], place[i, 1], place[i, 2]
        cx, cy, cz = subdomain_at(x, y, z, low, inverse, shape)
        if border[(cx * shape[1] + cy) * shape[2] + cz] == 0:
            continue
        first = count
        far = (place[i, 3] + largest[class_of(place[i, 3], largest)] + reach) * (1.0 + rounding)
        if deep_inside(x, low[0], edge[0], cx, far) and deep_inside(y, low[1], edge[1], cy, far):
            if deep_inside(z, low[2], edge[2], cz, far):  # as most small grains are
                continue
        for sx in range(-span[0], span[0] + 1):
            nx, gx = beside(cx, sx, shape[0], periodic[0]), gap(x, low[0], edge[0], cx, sx)
            if nx < 0 or gx > far:
                continue
            for sy in range(-span[1], span[1] + 1):
                ny, gy = beside(cy, sy, shape[1], periodic[1]), gap(y, low[1], edge[1], cy, sy)
                if ny < 0 or gx * gx + gy * gy > far * far:
                    continue
                for sz in range(-span[2], span[2] + 1):
                    nz, gz = beside(cz, sz, shape[2], periodic[2]), gap(z, low[2], edge[2], cz, sz)
                    if nz < 0 or gx * gx + gy * gy + gz * gz > far * far:
                        continue
                    rank = owners[(nx * shape[1] + ny) * shape[2] + nz]
                    if rank == own:
                        continue
                    known = False
                    for q in range(first, min(count, rows.shape[0])):
                        known |= ranks[q] == rank
                    if not known:
                        if count < rows.shape[0]:
                            rows[count], ranks[count] = i, rank
                        count += 1
    return count
