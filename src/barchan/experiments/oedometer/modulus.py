"""The tangent modulus of one-dimensional compression, as a secant over windows of stress."""

from typing import NamedTuple

import numpy as np

#: Windows of equal stress between the lowest stress that both branches have and the largest.
WINDOWS = 8


class Moduli(NamedTuple):
    """M = change of vertical stress over change of vertical strain, in windows of stress.

    ``stress``: middle of each window, (n,) [Pa]. ``loading``, ``unloading``: (n,) [Pa], not a number where a branch has not been
    yet.
    """

    stress: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray

    @classmethod
    def of(cls, scene, load):
        """Those of a run, from its series."""
        _, seated, loaded, held, unloaded, _ = scene.ends
        edges = np.linspace(max(scene.initial_stress, scene.end_stress), scene.max_stress, WINDOWS + 1)
        return cls(0.5 * (edges[1:] + edges[:-1]), _secants(load, seated, loaded, edges), _secants(load, held, unloaded, edges))


def _secants(load, begin, end, edges):
    """Secant modulus between the rows, from one step to another, whose targets are first at or above each edge."""
    rows = np.flatnonzero((load["step"] >= begin) & (load["step"] <= end))
    if not rows.size:
        return np.full(len(edges) - 1, np.nan)
    target = load["target stress [Pa]"]
    rows = rows[np.argsort(target[rows], kind="stable")]  # when unloaded, the last is the lowest
    rows = rows[np.minimum(np.searchsorted(target[rows], edges), len(rows) - 1)]
    stress, strain = (np.diff(load[name][rows]) for name in ("stress top [Pa]", "volumetric strain [1]"))
    return np.divide(stress, strain, out=np.full(len(strain), np.nan), where=strain != 0.0)
