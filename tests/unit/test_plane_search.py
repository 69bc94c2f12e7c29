"""Two dimensions: the neighbour list against a look at every pair, one layer of cells, and what the choice of classes counts."""

import warnings
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import SHORTEST, assert_its_lists_are_right, crowded, make
from scenes import NOTHING, simulation

import barchan as bc
from barchan.domain import Box
from barchan.kernels.cells import SHAPE
from barchan.neighbors import classes
from barchan.neighbors.classes import Survey, divide
from barchan.neighbors.grid import grids_around
from barchan.parallel import virtual_ranks

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


@st.composite
def crowds(draw):
    """Many small grains around few large ones, all in the plane: pairs of all kinds, across periods and borders of ranks."""
    periodic = draw(st.tuples(st.booleans(), st.booleans()))
    rng, ratio = np.random.default_rng(draw(st.integers(0, 10**6))), draw(st.sampled_from([3.0, 10.0, 100.0]))
    radius = np.concatenate([rng.uniform(0.6, 1.0, draw(st.integers(1, 4))), rng.uniform(0.5, 2.0, 150) / ratio])
    skin = 0.3 / ratio
    edges = np.where(periodic, rng.uniform(SHORTEST, 4.0, 2), 3.0) * (2.0 * radius.max() + skin)
    low = np.array([-1.0, 2.0])
    box = bc.Box(low, low + edges, periodic)
    position, order = crowded(rng, low, edges, radius, ratio), rng.permutation(len(radius))
    inside = low + edges - np.abs(edges - np.abs(position - low))  # thrown back by the faces
    position = np.column_stack([np.where(periodic, position, inside), np.zeros(len(radius))])
    position = box.wrap(position)[0]
    return {
        "box": box,
        "skin": skin,
        "radius": radius[order],
        "position": position[order],
        "velocity": np.zeros((len(radius), 3)),
        "frozen": rng.random(len(radius)) < draw(st.sampled_from([0.0, 0.3])),
        "separators": draw(st.sampled_from([None, (), (0.55,), (1.0 / ratio, 1.5 / ratio, 0.55, 0.8)])),
        "sparse": draw(st.booleans()),
        "shared anew": draw(st.sampled_from(["it pays", "never"])),
    }


@pytest.mark.parametrize("ranks", [1, 2, 3])
@given(scene=crowds())
@settings(max_examples=25)
def test_all_neighbours_are_found(ranks, scene):
    assert_its_lists_are_right(ranks, scene)


@pytest.mark.validate
@pytest.mark.parametrize("ranks", [1, 2, 3, 5])
@given(scene=crowds())
@settings(max_examples=2000)
def test_all_neighbours_are_found_in_thousands_of_trials(ranks, scene):
    assert_its_lists_are_right(ranks, scene)


def two_sizes(**options):
    """Four thousand small grains and five large ones, on 40 by 40."""
    sim = simulation(bc.Box((0, 0), (40, 40), (True, True)), properties=NOTHING, **options)
    sim.max_overlap, sim.check_dt = 1e9, False
    radius = np.repeat([0.1, 4.0], [4000, 5])
    place = np.random.default_rng(1).uniform(0, 40, (len(radius), 3)) * (1, 1, 0)
    sim.add_grains(place, radius)
    return sim


def grids_of(sim):
    sim.prepare()
    bounds, scope = sim.topology.bounds(sim.comm.rank), sim._scope
    return grids_around(sim.grains, bounds, sim.box, sim.size_classes, scope.reach)


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_grids_have_one_layer_of_cells(ranks):
    def program():
        shape = grids_of(two_sizes()).tables[:, SHAPE]
        return len(shape), shape[:, 2].tolist(), shape[:, :2].min(), grids_of(two_sizes()).tables[0, SHAPE, :2].max()

    for count, layers, least, most in virtual_ranks(ranks, program):
        assert count == 2 and layers == [1.0, 1.0] and least >= 2 and most > 40


@pytest.mark.parametrize("ranks", [2, 3, 7])
def test_every_rank_has_its_share(ranks):
    """Space is cut along x and y only, however high a layer as thick as 1 would be."""

    def program(edge):
        sim = simulation(bc.Box((0, 0), (edge, edge), (True, False)), properties=NOTHING)
        sim.add_grains((np.random.default_rng(2).random((600, 3)) * edge) * (1, 1, 0), 1e-3 * edge)
        at_first, (low, high) = sim.grains.n, sim.space
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.max_overlap, sim.check_dt = 1e9, False
            sim.prepare()
        return at_first, sim.grains.n, sim.topology.shape[2], (low[2], high[2])

    for edge in (1e-3, 1e3):
        for at_first, later, layers, across in virtual_ranks(ranks, program, edge):
            assert layers == 1 and across == (0.0, 0.0)
            assert abs(later * ranks / 600 - 1.0) < 0.1 and at_first * ranks > 300


def test_bricks_that_grains_will_fill_share_the_plane():
    def program():
        sim = simulation(bc.Box((0, 0), (8, 8)), properties=NOTHING)
        sim.share_space([((0, 0, 0), (8, 2, 0))])
        sim.add_grains((np.random.default_rng(2).random((600, 3)) * (8, 2, 0)), 0.01)
        return sim.grains.n

    assert min(virtual_ranks(3, program)) > 150


def test_the_model_counts_grains_by_area():
    """In a cell on average: as many as grains by the cells that the grid has."""
    sim = two_sizes()
    cells = grids_of(sim).tables[:, SHAPE].prod(axis=1)
    per_cell, reach = sim.size_classes.choice.per_cell, sim._scope.reach
    assert per_cell == pytest.approx([4000 * (0.2 + reach) ** 2 / 1600, 5 * (8.0 + reach) ** 2 / 1600])
    assert per_cell[0] == pytest.approx(4000 / cells[0], rel=0.02)


def test_as_many_discs_by_area_are_searched_as_dear_as_they_are():
    """The same grains in a larger area cost less to search, up to where a cell holds one; a flat volume is none."""
    dense, loose = (Survey(np.array([1.0]), np.array([10**6]), area, 2) for area in (1e5, 1e6))
    deep = Survey(np.array([1.0]), np.array([10**6]), 1e5 * 2.0)
    assert divide(dense, 0.1, ()).seconds > divide(loose, 0.1, ()).seconds
    assert divide(dense, 0.1, ()).per_cell == pytest.approx([44.1]) and divide(deep, 0.1, ()).per_cell == pytest.approx([46.305])
    assert divide(deep, 0.1, ()).seconds > 1.5 * divide(dense, 0.1, ()).seconds, "two lines of cells are looked at, not five"


def only(**prices):
    """The cost model with all prices 0 but some."""
    names = ("GRAIN", "LINE", "EIGHT", "LISTED", "LIST", "LIST_LINE", "LIST_GRAIN", "CELL", "SPARSELY", "CLASS")
    return patch.multiple(classes, **(dict.fromkeys(names, 0.0) | prices))


def test_the_model_knows_how_many_larger_grains_are_near():
    """Of discs thrown at random, few of them, against a count; and how many lines of their cells a disc looks at."""
    rng, edge, reach = np.random.default_rng(4), 100.0, 0.1
    sizes = Survey(np.array([0.5, 4.0]), np.array([100, 20]), edge**2, 2)
    away = Box((0, 0), (edge, edge), (True, True)).difference(rng.random((4000, 1, 3)) * edge, rng.random((1, 200, 3)) * edge)
    near = np.count_nonzero((away[..., :2] ** 2).sum(axis=-1) < (4.5 + reach) ** 2) / 4000 / 10  # for 20 of the 200
    with only(LISTED=8.0):
        assert 1e9 * divide(sizes, reach, (0.5,)).seconds / 100 / 9.0 == pytest.approx(near, rel=0.05)
    with only(LIST_LINE=1.0):
        lines = 1.0 + 2.0 * (4.5 + reach) / (8.0 + reach)  # that an interval meets at random
        assert 1e9 * divide(sizes, reach, (0.5,)).seconds / 100 == pytest.approx(lines)


def test_a_layer_of_grains_in_three_dimensions_is_a_plane_too():
    sim = simulation(bc.Box((0, 0, 0), (40, 40, 40)), properties=NOTHING)
    sim.max_overlap = 1e9
    sim.add_grains(np.random.default_rng(1).uniform(0, 40, (100, 3)) * (1, 1, 0) + (0, 0, 7), 0.5)
    sim.prepare()
    assert sim._scope.sizes.dimension == 2 and sim._scope.sizes.volume == pytest.approx(1600, rel=0.1)


def test_pairs_are_found_once_whatever_the_classes():
    """Of all small grains around a large one, across a period."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    around = np.column_stack([0.1 + 1.005 * np.cos(angle), 0.1 + 1.005 * np.sin(angle), 0.0 * angle])
    box = bc.Box((0, 0), (5, 5), (True, True))
    position = np.concatenate([[[0.1, 0.1, 0.0]], box.wrap(around)[0]])
    scene = {"box": box, "skin": 1e-3, "radius": np.repeat([1.0, 0.005], [1, 200]), "position": position, "separators": (0.5,)}
    scene |= {"velocity": np.zeros(position.shape), "frozen": np.zeros(201, dtype=bool), "sparse": False}
    sim = make(scene)
    sim.prepare()
    assert np.count_nonzero(sim.grains.view("id")[sim.contacts.first] == 0) == 200
