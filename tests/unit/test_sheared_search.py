"""In a box that tilts every pair is found that touches over any of its images: of one size and of several, on several ranks."""

import warnings
from itertools import product

import numpy as np
import pytest

import barchan as bc
from barchan.domain import SHEARS
from barchan.measure import contact_table
from barchan.parallel import virtual_ranks

SOFT = bc.Material("soft", density=1.0, kn=1.0, kt=1.0, friction=0.0)


def scene(seed):
    """Grains at random in a box that tilts at random, of one size or of two classes."""
    random = np.random.default_rng(seed)
    low, edges = random.uniform(-5.0, 5.0, 3), random.uniform(3.0, 6.0, 3)
    sim = bc.Simulation(bc.Box(low, low + edges, (True,) * 3), bc.laws.linear, SOFT, 1e-6, threads=1)
    sim.max_overlap, sim.skin = np.inf, 0.05
    radius = random.uniform(0.1, 0.2, 400)
    if seed % 2:
        radius[:12], sim.size_classes.separators = 0.55, (0.2,)
    sheared = seed % 3
    sim.box.tilt[sheared] = random.uniform(-0.5, 0.5) * edges[SHEARS[sheared][0]]
    sim.add_grains(low + edges * random.random((400, 3)), radius)
    return sim


def touching_over_all_images(sim):
    """Pairs of ids, found among 27 images and those beside them."""
    place, radius = sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("radius")
    lattice = np.diag(sim.box.length)
    for (flow, along), tilt in zip(SHEARS, sim.box.tilt):
        lattice[flow, along] = tilt
    apart, least = place[:, None] - place, np.full((len(place),) * 2, np.inf)
    for image in product((-2, -1, 0, 1, 2), (-1, 0, 1), (-1, 0, 1)):
        least = np.minimum(least, np.linalg.norm(apart + lattice @ image, axis=2))
    return {(int(i), int(j)) for i, j in np.argwhere(np.triu(least < radius[:, None] + radius, 1))}


@pytest.mark.parametrize("seed", range(6))
def test_all_that_touch_are_found(seed):
    def found():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = scene(seed)
            sim.prepare()
            table = contact_table(sim)
        pairs = table["second"] >= 0
        return {tuple(sorted(map(int, ids))) for ids in zip(table["first"][pairs], table["second"][pairs])}

    expected = touching_over_all_images(scene(seed))
    assert len(expected) > 100
    for ranks in (1, 3):
        assert set().union(*virtual_ranks(ranks, found)) == expected
