"""Which rank owns which part of space, and who has to see which grain."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from barchan.domain import Box
from barchan.parallel.partition.bisection import bisection
from barchan.parallel.partition.labels import matched
from barchan.parallel.topology import Topology, even, shape_of

pytestmark = pytest.mark.nojit


@st.composite
def topologies(draw):
    """Any owners at all: far more ragged than those that a partition makes."""
    length = np.array(draw(st.tuples(*[st.floats(0.5, 20.0)] * 3)))
    low = np.array(draw(st.tuples(*[st.floats(-5.0, 5.0)] * 3)))
    box = Box(low, low + length, draw(st.tuples(*[st.booleans()] * 3)))
    shape, size = draw(st.tuples(*[st.integers(1, 5)] * 3)), draw(st.integers(1, 6))
    owners = np.random.default_rng(draw(st.integers(0, 10**6))).integers(0, size, np.prod(shape))
    return Topology(box, shape, owners, size)


def points_in(box, count, seed):
    return box.low + np.random.default_rng(seed).random((count, 3)) * box.length


def distance(topology, point, rank):
    """Shortest distance of a point to a rank's sub-domains, over all images: by trying each of them."""
    cells = np.stack(np.unravel_index(np.flatnonzero(topology.owners == rank), topology.shape), axis=1)
    low = topology.box.low + cells * topology.edge
    periods = topology.box.length * topology.box.periodic
    shortest = np.inf
    for shift in np.ndindex(3, 3, 3):
        image = point + (np.array(shift) - 1) * periods
        away = np.maximum(np.maximum(low - image, image - low - topology.edge), 0.0)
        shortest = min(shortest, np.sqrt((away**2).sum(axis=1)).min(initial=np.inf))
    return shortest


@given(topologies(), st.integers(0, 10**6))
def test_every_point_has_one_owner_whose_part_holds_it(topology, seed):
    points = points_in(topology.box, 40, seed)
    owner = topology.owner(points)
    assert ((owner >= 0) & (owner < topology.size)).all()
    digits = 1e-12 * (1.0 + np.abs(points).max())
    for point, rank in zip(points, owner):
        low, high = topology.bounds(rank)
        assert (point >= low - digits).all() and (point <= high + digits).all()
        assert distance(topology, point, rank) <= 10.0 * digits


@given(topologies(), st.floats(0.0, 4.0), st.floats(0.0, 2.0), st.integers(0, 10**6))
def test_grains_are_sent_to_exactly_the_ranks_within_reach(topology, reach, widest, seed):
    """One too few would lose contacts; more than those on the very edge would cost time."""
    position = points_in(topology.box, 30, seed)
    radius = widest * np.random.default_rng(seed + 1).random(30)
    owner = topology.owner(position)
    rank = int(owner[0])
    own = np.flatnonzero(owner == rank)
    place = np.concatenate([position, radius[:, None]], axis=1)[own]
    largest = np.array([0.3 * widest, widest])
    beyond = np.where(place[:, 3] <= largest[0], *largest) + reach
    sends = topology.sends(rank, place, largest, reach)
    assert set(sends) <= set(topology.neighbours(rank, 2.0 * widest + reach)) and rank not in sends
    for other in set(range(topology.size)) - {rank}:
        away = np.array([distance(topology, point, other) for point in place[:, :3]])
        sent = np.zeros(len(own), dtype=bool)
        sent[sends.get(other, [])] = True
        assert sent[away <= place[:, 3] + beyond - 1e-9].all()
        assert not sent[away > (place[:, 3] + beyond) * (1.0 + 1e-8) + 1e-9].any()
        assert (np.diff(sends.get(other, [])) > 0).all()


@given(topologies(), st.floats(0.0, 6.0))
def test_neighbours_know_each_other(topology, reach):
    """A rank that listens to one that does not send would wait for ever."""
    near = [set(topology.neighbours(rank, reach)) for rank in range(topology.size)]
    assert all((a in near[b]) == (b in near[a]) for a in range(topology.size) for b in range(topology.size))


@given(st.tuples(*[st.integers(1, 9)] * 3), st.integers(1, 7), st.integers(0, 10**6))
def test_one_cut_gives_each_half_its_share_to_half_a_subdomain(shape, most, seed):
    """With any costs, any two speeds and any shape: the promise for a rank declared half as fast among it."""
    rng = np.random.default_rng(seed)
    cost, speeds = rng.integers(0, most, np.prod(shape)), rng.random(2) + 0.1
    load = np.bincount(bisection(cost, shape, np.ones(3), speeds), weights=cost, minlength=2)
    assert abs(load[0] - speeds[0] / speeds.sum() * cost.sum()) <= 0.5 * cost.max()


@pytest.mark.parametrize("speeds", [[1.0, 0.5], [1.0, 0.5, 1.0, 1.0], [1.0] * 7, [3.0, 1.0, 1.0, 2.0, 1.0]])
def test_ranks_get_what_their_speed_allows(speeds):
    """Within one sub-domain, also after several cuts; here every sub-domain costs something."""
    speeds = np.array(speeds)
    cost = np.random.default_rng(3).integers(50, 100, 20 * 16 * 10)
    load = np.bincount(bisection(cost, (20, 16, 10), np.array([1.0, 0.7, 1.2]), speeds), weights=cost, minlength=len(speeds))
    assert np.abs(load - speeds / speeds.sum() * cost.sum()).max() <= cost.max()


def test_parts_are_near_to_bricks():
    """Eight ranks on a cube: hardly more surface between them than three planes."""
    owners = bisection(np.ones(16**3, dtype=np.int64), (16, 16, 16), np.ones(3), np.ones(8)).reshape(16, 16, 16)
    surface = sum(int((np.diff(owners, axis=axis) != 0).sum()) for axis in range(3))
    assert surface == 3 * 16**2


def test_empty_space_is_left_to_whoever_is_near():
    """All grains in one corner: every rank still gets its share of them."""
    cost = np.zeros((12, 12, 12), dtype=np.int64)
    cost[:4, :3, :2] = 10
    load = np.bincount(bisection(cost.ravel(), (12, 12, 12), np.ones(3), np.ones(6)), weights=cost.ravel(), minlength=6)
    assert load.tolist() == [40.0] * 6


def test_labels_stay_with_those_who_hold_most():
    assert matched([{0: 1, 2: 7}, {0: 5}, {1: 4}], np.ones(3)).tolist() == [1, 2, 0]
    assert matched([{1: 9}, {0: 9}], np.array([1.0, 0.5])).tolist() == [0, 1], "parts were cut for the speeds"
    assert sorted(matched([{}, {3: 1}, {}, {}], np.ones(4)).tolist()) == [0, 1, 2, 3]


@given(st.tuples(*[st.floats(0.1, 50.0)] * 3), st.integers(1, 3000), st.floats(0.0, 5.0))
def test_subdomains_are_as_many_and_as_wide_as_wanted(length, count, least):
    shape = shape_of(Box((0, 0, 0), length), count, least)
    edge = np.array(length) / shape
    assert ((shape == 1) | (edge >= least * (1.0 - 1e-12))).all()
    assert np.prod(shape) <= 4 * count
    if least == 0.0:
        assert np.prod(shape) >= count / 4


@given(st.integers(1, 40))
def test_the_first_topology_gives_every_rank_a_part(size):
    topology = even(Box((0, 0, 0), (7.0, 1.0, 3.0)), size)
    share = np.bincount(topology.owners, minlength=size) / len(topology.owners) * size
    assert share.min() > 0.9 and share.max() < 1.1
