"""Scenes for tests of the neighbour list, and a look at every pair to compare it with."""

from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
from scenes import NOTHING, simulation

from barchan.kernels import cells
from barchan.neighbors.classes import STRATEGIES
from barchan.parallel import virtual_ranks

#: Edge of the box in cut-offs: the shortest period that is allowed holds two cells; without a period, fewer will do.
SHORTEST = 2.0 + 1e-9


@contextmanager
def grids_of(scene):
    """Grids with a place for every cell, or sparse ones, with few places for all of them (that of small cells never is)."""
    limits = {"DENSE": 0, "FEWEST": 7, "SPARSE": 1} if scene["sparse"] and scene.get("strategy") != "multi" else {}
    with patch.multiple(cells, **limits) if limits else patch.object(cells, "DENSE", cells.DENSE):
        yield


def crowded(rng, low, edges, radius, ratio):
    """Places in a box: of the last 150 grains, which are small, half at the surfaces of the others, and half near these."""
    position, on = low + rng.random((len(radius), len(low))) * edges, rng.integers(0, len(radius) - 150, 150)
    away = rng.normal(size=(150, len(low)))
    away *= ((radius[on] + radius[-150:] + rng.uniform(-0.2, 0.8, 150) / ratio) / np.linalg.norm(away, axis=1))[:, None]
    position[-150:] = position[on] + away
    position[-75:] = position[rng.integers(0, 75, 75) - 150] + rng.normal(size=(75, len(low))) * 1.2 / ratio
    return position


def make(scene):
    sim = simulation(scene["box"], dt=1e-2, properties=NOTHING)
    sim.skin, sim.max_overlap, sim.check_dt = scene["skin"], 1e9, False
    sim.size_classes.separators, sim.balance.when = scene["separators"], scene.get("shared anew", "it pays")
    sim.size_classes.strategy = scene.get("strategy", STRATEGIES[0])
    sim.add_grains(
        scene["position"], scene["radius"], velocity=scene["velocity"] * ~scene["frozen"][:, None], frozen=scene["frozen"]
    )
    return sim


def surface_distances(box, position, radius):
    """Gap between the surfaces of all pairs, over the nearest image; matrix by row."""
    branch = box.difference(position[:, None, :], position[None, :, :])
    return np.sqrt((branch**2).sum(axis=2)) - radius[:, None] - radius[None, :]


def listed_pairs(sim):
    """Pairs of ids in this rank's list, as a list of tuples, and the ids that it owns."""
    ids = sim.grains.view("id", ghosts=True)
    pairs = np.stack([ids[sim.contacts.first], ids[sim.contacts.second]], axis=1)
    return [tuple(pair) for pair in pairs.tolist()], set(sim.grains.view("id").tolist())


def assert_lists_are_right(parts, gap, frozen, skin):
    """Every rank lists each pair that concerns one of its grains once, and each that is nearer than the skin is listed."""
    owners = [grain for _, own in parts for grain in own]
    assert sorted(owners) == list(range(len(frozen))), "every grain has one owner"
    matters = ~(frozen[:, None] & frozen[None, :])
    near = {(i, j) for i, j in np.argwhere(matters & (gap < skin * (1.0 - 1e-9))).tolist() if i < j}
    perhaps = {(i, j) for i, j in np.argwhere(matters & (gap < skin * (1.0 + 1e-9))).tolist() if i < j}
    for pairs, own in parts:
        assert all(i < j for i, j in pairs), "the smaller id comes first"
        assert len(set(pairs)) == len(pairs), "none is listed twice"
        concerned = {(i, j) for i, j in near if i in own or j in own}
        assert concerned <= set(pairs), f"missed: {concerned - set(pairs)}"
        assert set(pairs) <= perhaps, f"too far, or both immobile: {set(pairs) - perhaps}"


def assert_its_lists_are_right(ranks, scene):
    """The same of a scene, on a number of ranks."""

    def program():
        sim = make(scene)
        sim.prepare()
        return listed_pairs(sim)

    gap = surface_distances(scene["box"], scene["position"], scene["radius"])
    with grids_of(scene):
        parts = virtual_ranks(ranks, program)
    assert_lists_are_right(parts, gap, scene["frozen"], scene["skin"])
