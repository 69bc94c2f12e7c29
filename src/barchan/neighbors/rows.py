"""What grains remember of their contacts while the neighbour list is rebuilt."""

from typing import NamedTuple

import numpy as np

from barchan.kernels import history as kernels


class ContactRows(NamedTuple):
    """Contacts as rows of grains: grain i remembers rows ``start[i]:start[i + 1]``, ascending by key.

    ``keys``: partner's id, or the negative key of a wall. ``values``: (rows, width), as seen from the smaller id.
    """

    start: np.ndarray
    keys: np.ndarray
    values: np.ndarray

    @classmethod
    def empty(cls, n, width):
        """No contacts for ``n`` grains."""
        return cls(np.broadcast_to(np.int64(0), n + 1), np.zeros(0, dtype=np.int64), np.zeros((0, width)))

    @classmethod
    def join(cls, parts):
        """Rows of several groups of grains one after another."""
        counts = np.concatenate([np.diff(part.start) for part in parts])
        return cls(
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            np.concatenate([part.keys for part in parts]),
            np.concatenate([part.values for part in parts]),
        )

    def of(self, some):
        """The rows of some grains, ascending, if the others have none."""
        return ContactRows(np.append(self.start[some], self.start[-1]), self.keys, self.values)

    def take(self, order):
        """Rows of the chosen grains, in that order."""
        if not len(self.keys):
            return ContactRows.empty(len(order), self.values.shape[1])
        start = np.concatenate([[0], np.cumsum(np.diff(self.start)[order])]).astype(np.int64)
        keys, values = np.empty(start[-1], dtype=np.int64), np.empty((start[-1], self.values.shape[1]))
        kernels.permute_rows(np.asarray(order, dtype=np.int64), self.start, self.keys, self.values, start, keys, values)
        return ContactRows(start, keys, values)
