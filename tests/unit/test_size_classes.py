"""Small grains among large ones, cut into size classes: the neighbour list against a look at every pair."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import SHORTEST, assert_its_lists_are_right, crowded, listed_pairs, make

import barchan as bc
from barchan.errors import SceneError
from barchan.kernels import cells, stencils
from barchan.neighbors import search
from barchan.neighbors.classes import STRATEGIES
from barchan.neighbors.grid import grids_around
from barchan.parallel import virtual_ranks

STILL = {"velocity": np.zeros((1, 3)), "frozen": np.zeros(1, dtype=bool), "separators": None, "sparse": False}

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


@st.composite
def crowds(draw):
    """Many small grains around few large ones, cut into classes: pairs of all kinds, across periods and borders of ranks."""
    periodic = draw(st.tuples(st.booleans(), st.booleans(), st.booleans()))
    rng, ratio = np.random.default_rng(draw(st.integers(0, 10**6))), draw(st.sampled_from([3.0, 10.0, 100.0, 1000.0]))
    radius = np.concatenate([rng.uniform(0.6, 1.0, draw(st.integers(1, 4))), rng.uniform(0.5, 2.0, 150) / ratio])
    skin = 0.3 / ratio
    box = bc.Box((0, 0, 0), np.where(periodic, rng.uniform(SHORTEST, 4.0, 3), 3.0) * (2.0 * radius.max() + skin), periodic)
    position, order = crowded(rng, box.low, box.length, radius, ratio), rng.permutation(len(radius))
    inside, back = np.clip(position, box.low, box.high), box.high - np.abs(box.length - np.abs(position - box.low))
    again = np.setdiff1d(np.arange(len(radius)), np.unique(inside, axis=0, return_index=True)[1])
    inside[again] = back[again]  # or corners would hold several, whose force has no direction
    position = np.where(periodic, box.wrap(position)[0], inside)
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
        "strategy": draw(st.sampled_from([STRATEGIES[0], *STRATEGIES])),
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


def test_a_grid_of_small_cells_is_never_sparse():
    """A wide stencil would meet places that cells share twice: in a corner of a large box cells are larger instead."""
    rng, radius = np.random.default_rng(4), np.repeat([1.0, 0.2], [100, 900])
    scene = {"box": bc.Box((0, 0, 0), (40, 40, 40), (True,) * 3), "skin": 0.05, "radius": radius, "strategy": "multi"}
    scene |= {"position": rng.random((1000, 3)) * 9.0, "velocity": np.zeros((1000, 3)), "frozen": radius < 0.0}
    assert_its_lists_are_right(1, scene | {"separators": (0.5,), "sparse": False})


@pytest.mark.parametrize("ranks", [1, 3])
def test_one_grid_of_small_cells_is_searched_with_larger_stencils(ranks):
    """Of 100 large grains and 900 small ones, whose cells are as small as these want; all in one grid."""
    rng = np.random.default_rng(2)
    radius = np.repeat([1.0, 0.2], [100, 900])
    scene = {"box": bc.Box((0, 0, 0), (9, 9, 9), (True,) * 3), "skin": 0.05, "radius": radius, "strategy": "multi"}
    scene |= {"position": rng.random((1000, 3)) * 9.0, "velocity": np.zeros((1000, 3)), "frozen": radius < 0.0}
    scene |= {"separators": (0.5,), "sparse": False}
    with patch.object(search.stencils, "find_pairs_widely", side_effect=stencils.find_pairs_widely) as wide:
        assert_its_lists_are_right(ranks, scene)
        assert wide.call_count >= ranks
        sim = make(scene)
        sim.prepare()

    def told():
        sim = make(scene)
        sim.prepare()
        return str(sim.size_classes)

    assert all(text.startswith("2 (as given; strategy multi)") for text in virtual_ranks(ranks, told))
    assert "strategy multi" in str(sim.size_classes)
    grid = grids_around(sim.grains, (sim.box.low, sim.box.high), sim.box, sim.size_classes, 0.05)
    assert grid.tables[:, cells.SHAPE].tolist() == [[20, 20, 20]]  # cells of 0.45; 8 for each grain


@pytest.mark.parametrize(("strategy", "cell", "wanted"), [("multi", 0.3, 0.3), ("hierarchical", 0.3, 0.45), ("multi", 1.0, 1.0)])
def test_cells_may_be_of_another_size(strategy, cell, wanted):
    rng = np.random.default_rng(3)
    radius = np.repeat([1.0, 0.2], [5, 4000])
    scene = {"box": bc.Box((0, 0, 0), (9, 9, 9), (True,) * 3), "skin": 0.05, "radius": radius, "strategy": strategy}
    scene |= {"position": rng.random((4005, 3)) * 9.0, "velocity": np.zeros((4005, 3)), "frozen": radius < 0.0}
    sim = make(scene | {"separators": (0.5,), "sparse": False})
    sim.size_classes.cell = cell
    sim.prepare()
    grid = grids_around(sim.grains, (sim.box.low, sim.box.high), sim.box, sim.size_classes, 0.05)
    assert 1.0 / grid.tables[0, cells.INVERSE] == pytest.approx(9.0 / np.floor(9.0 / wanted))
    for changed in ({"cell": 1.3}, {"strategy": "single grid"}):
        for name, value in changed.items():
            setattr(sim.size_classes, name, value)
        sim.size_classes.seconds = None
        sim.prepare()
        assert sim.size_classes.seconds is not None, f"{changed}: the list is made anew"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"strategy": "bin"}, r"size_classes\.strategy = 'bin' must be one of 'hierarchical', 'multi', 'single grid'"),
        ({"strategy": None}, r"size_classes\.strategy = None must be one of"),
        ({"cell": 0.0}, r"size_classes\.cell = 0\.0 \[length\] must be None, or a number > 0"),
        ({"cell": np.nan}, r"size_classes\.cell = nan"),
        ({"cell": "wide"}, r"size_classes\.cell = 'wide'"),
    ],
)
def test_a_way_to_search_that_is_none(wrong, message):
    sim = make({"box": bc.Box((0,) * 3, (9,) * 3), "skin": 0.1, "position": np.ones((1, 3)), "radius": np.ones(1)} | STILL)
    for name, value in wrong.items():
        setattr(sim.size_classes, name, value)
    with pytest.raises(SceneError, match=message):
        sim.prepare()


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
