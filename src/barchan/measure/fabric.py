"""Which way contacts point."""

from typing import NamedTuple

import numpy as np

from barchan.measure.stress import deviatoric
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts, touching_pairs


class Fabric(NamedTuple):
    """``tensor``: (3, 3), in two dimensions (2, 2), mean of n_i n_j over contacts, of trace 1; zeros without contacts."""

    tensor: np.ndarray

    @property
    def deviator(self):
        """The tensor less the mean of its diagonal: zeros for contacts that point all ways alike."""
        dimension = len(self.tensor)
        return self.tensor - np.trace(self.tensor) / dimension * np.eye(dimension)

    @property
    def anisotropy(self):
        """sqrt(3/2 F':F') with the deviator F': the difference of the axial and the radial value where the fabric has an axis; in
        two dimensions sqrt(2 F':F'), that of the principal values."""
        return deviatoric(self.tensor)


def fabric(sim):
    """Fabric tensor of the contacts of grains with grains, n the unit vector between centres; walls do not count.

    Source: Satake 1982, the tensor of the second rank.

    Returns:
        ``Fabric``, the same bits for any number of ranks and threads.

    Raises:
        SceneError: grains or walls were changed since the last run.
    """
    check_contacts(sim)
    found = [pairs.branch / np.sqrt((pairs.branch * pairs.branch).sum(axis=0)) for pairs in touching_pairs(sim)]
    normal = np.concatenate([np.zeros((3, 0)), *found], axis=1)
    axes = range(sim.box.dimension)
    products = [normal[i] * normal[j] for i in axes for j in axes]
    *sums, count = exact_sums([*products, np.ones(normal.shape[1])], sim.comm)[:, 0]
    return Fabric(np.reshape(sums, (len(axes), -1)) / max(count, 1.0))
