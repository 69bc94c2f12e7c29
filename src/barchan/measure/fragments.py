"""Fragments: what is still bonded together."""

from typing import NamedTuple

import numpy as np


class Fragments(NamedTuple):
    """Connected parts of the bonded grains, the heaviest first; a grain without bonds is one of its own.

    ``of``: (grains,) number of each grain's fragment, by ascending id (``ids``). ``grains``, ``mass``: (fragments,) how many
    grains each has, and its mass [mass].
    """

    ids: np.ndarray
    of: np.ndarray
    grains: np.ndarray
    mass: np.ndarray


def fragments(sim):
    """The ``Fragments`` of all ranks, on every rank, which all must call; the same for any number of them."""
    own = (sim.grains.view("id"), sim.grains.view("mass"), sim.bonds.ids[sim.bonds.holding])
    ids, mass, pairs = (np.concatenate(parts) for parts in zip(*sim.comm.all_gather(own)))
    order = np.argsort(ids)
    ids, mass = ids[order], mass[order]
    label = _connected(len(ids), *np.searchsorted(ids, pairs).T)
    _, first, of = np.unique(label, return_index=True, return_inverse=True)
    count = np.bincount(of, minlength=len(first))
    weight = np.bincount(of, weights=mass, minlength=len(first))
    heaviest = np.lexsort((first, -weight))
    rank = np.empty(len(first), dtype=np.int64)
    rank[heaviest] = np.arange(len(first))
    return Fragments(ids, rank[of], count[heaviest], weight[heaviest])


def _connected(count, one, other):
    """The smallest node that each of ``count`` nodes is connected to: labels go along edges, and jump to those of labels."""
    label = np.arange(count)
    while True:
        least = np.minimum(label[one], label[other])
        new = label.copy()
        for end in (one, other):
            np.minimum.at(new, label[end], least)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new
