"""Which rank owns which part of space."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from barchan.domain import Box
from barchan.parallel.topology import Bricks, brick_counts

pytestmark = pytest.mark.nojit


@st.composite
def bricks(draw):
    length = np.array(draw(st.tuples(*[st.floats(0.5, 20.0)] * 3)))
    low = np.array(draw(st.tuples(*[st.floats(-5.0, 5.0)] * 3)))
    return Bricks(Box(low, low + length, draw(st.tuples(*[st.booleans()] * 3))), draw(st.integers(1, 8)))


@given(bricks(), st.integers(0, 10**6))
def test_every_point_has_one_owner_whose_brick_holds_it(topology, seed):
    points = topology.box.low + np.random.default_rng(seed).random((50, 3)) * topology.box.length
    owner = topology.owner(points)
    assert ((owner >= 0) & (owner < topology.size)).all()
    digits = 1e-12 * (1.0 + np.abs(points).max())
    for point, rank in zip(points, owner):
        low, high = topology.bounds(rank)
        assert (point >= low - digits).all() and (point <= high + digits).all()
        assert topology.distance(point[None, :], rank)[0] <= 10.0 * digits


@given(bricks())
def test_bricks_fill_the_box(topology):
    volume = sum(np.prod(high - low) for low, high in map(topology.bounds, range(topology.size)))
    assert volume == pytest.approx(np.prod(topology.box.length), rel=1e-12)
    assert topology.owner(np.array([topology.box.low, topology.box.high])).tolist() == [0, topology.size - 1]


@given(bricks(), st.integers(0, 10**6))
def test_distance_to_a_brick_is_the_shortest_over_periodic_images(topology, seed):
    """Too long would lose ghosts."""
    rng = np.random.default_rng(seed)
    box, rank = topology.box, int(rng.integers(topology.size))
    point = box.low + rng.random(3) * box.length
    low, high = topology.bounds(rank)
    shifts = [np.array(s) * box.length * box.periodic for s in np.ndindex(3, 3, 3)]
    images = [point + shift - box.length * box.periodic for shift in shifts]
    shortest = min(np.linalg.norm(np.maximum(np.maximum(low - image, image - high), 0.0)) for image in images)
    assert topology.distance(point[None, :], rank)[0] == pytest.approx(shortest, rel=1e-9, abs=1e-9)


@given(bricks(), st.floats(0.01, 5.0), st.integers(0, 10**6))
def test_no_rank_with_a_grain_within_reach_is_left_out(topology, reach, seed):
    points = topology.box.low + np.random.default_rng(seed).random((60, 3)) * topology.box.length
    owner = topology.owner(points)
    for rank in range(topology.size):
        near = set(owner[topology.distance(points, rank) <= reach].tolist()) - {rank}
        assert near <= set(topology.neighbours(rank, reach * (1.0 + 1e-9) + 1e-12))


@pytest.mark.parametrize(
    ("size", "length", "counts"),
    [
        (4, (4.0, 1.0, 1.0), (4, 1, 1)),
        (8, (1.0, 1.0, 1.0), (2, 2, 2)),
        (6, (3.0, 2.0, 1.0), (3, 2, 1)),
        (1, (9.0, 1.0, 1.0), (1, 1, 1)),
        (5, (1.0, 1.0, 7.0), (1, 1, 5)),
    ],
)
def test_bricks_have_little_surface(size, length, counts):
    assert brick_counts(size, np.array(length)) == counts
