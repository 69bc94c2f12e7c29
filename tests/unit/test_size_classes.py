"""Small grains among large ones, cut into size classes: the neighbour list against a look at every pair."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import SHORTEST, assert_its_lists_are_right, listed_pairs, make

import barchan as bc
from barchan.kernels import cells

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


@st.composite
def crowds(draw):
    """Many small grains around few large ones, cut into classes: pairs of all kinds, across periods and borders of ranks."""
    periodic = draw(st.tuples(st.booleans(), st.booleans(), st.booleans()))
    rng, ratio = np.random.default_rng(draw(st.integers(0, 10**6))), draw(st.sampled_from([3.0, 10.0, 100.0, 1000.0]))
    radius = np.concatenate([rng.uniform(0.6, 1.0, draw(st.integers(1, 4))), rng.uniform(0.5, 2.0, 150) / ratio])
    skin = 0.3 / ratio
    box = bc.Box((0, 0, 0), np.where(periodic, rng.uniform(SHORTEST, 4.0, 3), 3.0) * (2.0 * radius.max() + skin), periodic)
    position, on = box.low + rng.random((len(radius), 3)) * box.length, rng.integers(0, len(radius) - 150, 150)
    away = rng.normal(size=(150, 3))
    away *= ((radius[on] + radius[-150:] + rng.uniform(-0.2, 0.8, 150) / ratio) / np.linalg.norm(away, axis=1))[:, None]
    position[-150:] = position[on] + away  # at the surfaces of the large ones
    near, order = rng.integers(0, 75, 75), rng.permutation(len(radius))
    position[-75:] = position[near - 150] + rng.normal(size=(75, 3)) * 1.2 / ratio  # and near each other
    position = np.where(periodic, box.wrap(position)[0], np.clip(position, box.low, box.high))
    separators = [None, (), (0.55,), (1.2 / ratio, 0.55), (1.0 / ratio, 1.5 / ratio, 0.55, 0.8)]
    frozen = rng.random(len(radius)) < draw(st.sampled_from([0.0, 0.3]))
    return {
        "box": box,
        "skin": skin,
        "radius": radius[order],
        "position": position[order],
        "velocity": np.zeros((len(radius), 3)),
        "frozen": frozen,
        "separators": draw(st.sampled_from(separators)),
        "sparse": draw(st.booleans()),
        "shared anew": draw(st.sampled_from(["it pays", "never"])),
    }


@pytest.mark.parametrize("ranks", [1, 2, 3])
@given(scene=crowds())
@settings(max_examples=25)
def test_small_grains_find_large_ones(ranks, scene):
    assert_its_lists_are_right(ranks, scene)


@pytest.mark.validate
@pytest.mark.parametrize("ranks", [1, 2, 3, 5])
@given(scene=crowds())
@settings(max_examples=2000)
def test_small_grains_find_large_ones_in_thousands_of_trials(ranks, scene):
    assert_its_lists_are_right(ranks, scene)


@pytest.mark.parametrize("height", [0.95, 1.2])
def test_a_large_ghost_is_seen_from_both_sides_of_the_period(height):
    """The part of space of a rank is five eighths of the period. A large grain of another rank touches small ones at both of its
    ends, of which only one is on the side of the large one's nearest image."""
    rng = np.random.default_rng(1)
    radius, box = np.array([1.4, *[0.1] * 2500]), bc.Box((0, 0, 0), (6, 6, 6), (True,) * 3)
    position = np.concatenate([[[1.0, 1.0, height]], rng.random((2500, 3)) * 6.0])
    scene = {"box": box, "skin": 0.01, "radius": radius, "position": position, "separators": (0.2,), "sparse": False}
    scene |= {"velocity": np.zeros(position.shape), "frozen": radius < 0.0, "shared anew": "never"}
    assert_its_lists_are_right(3, scene)


@pytest.mark.parametrize("seed", range(3))
def test_no_larger_grain_is_found_twice_where_cells_share_places(seed):
    """Small grains fill all cells of their grid; of larger ones there are so few that theirs is sparse: of the cells that eight
    small cells in a line look at, two are kept in the same place."""
    rng, edges = np.random.default_rng(seed), np.array([5.2, 5.2, 2.6])
    sites = np.stack(np.meshgrid(np.arange(26), np.arange(26), np.arange(13), indexing="ij"), axis=-1).reshape(-1, 3)
    small = (sites + 0.5) * 0.2 + rng.uniform(-0.02, 0.02, sites.shape)
    large = rng.random((12, 3)) * edges
    radius = np.repeat([0.24, 0.1], [len(large), len(small)])
    scene = {"box": bc.Box((0, 0, 0), edges, (True,) * 3), "skin": 0.02, "radius": radius, "separators": (0.1,)}
    scene |= {"position": np.concatenate([large, small]), "velocity": np.zeros((len(radius), 3)), "frozen": radius < 0.0}
    with patch.multiple(cells, DENSE=3, FEWEST=7, SPARSE=8):
        sim = make(scene)
        sim.prepare()
    pairs, _ = listed_pairs(sim)
    away = np.linalg.norm(scene["box"].difference(scene["position"][None], large[:, None]), axis=2)
    near = {(i, j) for i, j in np.argwhere(away < radius + 0.24 + 0.02).tolist() if i < j}
    assert len(pairs) == len(set(pairs)) and {pair for pair in pairs if pair[0] < 12} == near
