"""How many grains there are of which size."""

from barchan.kernels.compiler import kernel
from barchan.kernels.history import row_of


@kernel()
def count_sizes(place, edges, largest, count):
    """Count grains in bins of radii: bin k takes those above ``edges[k - 1]`` up to ``edges[k]``.

    Args:
        place: (n, 4) positions and radii.
        edges: (bins - 1,) ascending.
        largest, count: (bins,) become the largest radius in each, 0 where there is none, and how many there are.
    """
    largest[:], count[:] = 0.0, 0
    for i in range(place.shape[0]):
        k = row_of(place[i, 3], 0, edges.shape[0], edges)
        largest[k] = max(largest[k], place[i, 3])
        count[k] += 1
