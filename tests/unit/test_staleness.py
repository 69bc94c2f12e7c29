"""When the list is rebuilt: never too late, whatever moves."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scenes import NOTHING, fingerprint, pile, simulation

import barchan as bc
from barchan.neighbors.staleness import Staleness
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

moves = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=2, max_size=6)
EDGE, DT = 200.0, 1e-3


def is_rebuilt(displacement, skin, low=0.0, ranks=1):
    """Whether one step in which lonely grains move by ``displacement`` makes the list anew; in a periodic box, of which the
    low corner stands anywhere, so that some grains cross a face on the way."""
    displacement = np.array(displacement)

    def program():
        sim = simulation(bc.Box((low,) * 3, (low + EDGE,) * 3, (True,) * 3), dt=DT, properties=NOTHING)
        start = np.arange(len(displacement))[:, None] * (29.0, 13.0, 17.0) + 3.0
        sim.add_grains(start, 0.5, velocity=displacement / DT)
        sim.skin = skin
        sim.run(1)
        unfolded = sim.grains.position + sim.grains.image * EDGE
        ids = sim.grains.id
        assert unfolded == pytest.approx(start[ids] + displacement[ids], abs=1e-9), "it has moved as this test means it to"
        return sim.staleness.last_step == 1

    decisions = set(virtual_ranks(ranks, program))
    assert len(decisions) == 1, "all ranks decide alike"
    return decisions.pop()


@pytest.mark.parametrize("ranks", [1, 2])
@given(moves, st.floats(0.01, 3.0), st.tuples(*[st.floats(-50.0, 50.0)] * 3), st.floats(-150.0, 0.0))
@example([(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)], 0.99, (0.0, 0.0, 0.0), 0.0)
@example([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], 1.4, (0.0, 0.0, 0.0), 0.0)
@settings(max_examples=150)
def test_without_a_rebuild_no_two_grains_have_approached_by_the_skin(ranks, displacement, skin, drift, low):
    """Both bounds, with and without a drift that all share: the second is what counts along a chute."""
    moved = np.array(displacement) + drift
    if not is_rebuilt(moved, skin, low, ranks):
        assert max(np.linalg.norm(a - b) for a, b in combinations(moved, 2)) <= skin * (1.0 + 1e-9)


def test_there_is_no_rebuild_without_need():
    """Neither bound is thrown away: twice the largest displacement, and the diagonal of the box of all displacements."""
    apart = [(0.4, 0, 0), (-0.4, 0, 0)]
    assert not is_rebuilt(apart, skin=0.81) and is_rebuilt(apart, skin=0.79)
    together = [(30.0, 5.0, 0.0), (30.3, 5.0, 0.4)]
    assert not is_rebuilt(together, skin=0.51), "a flow that moves as a whole"
    assert is_rebuilt(together, skin=0.49)
    ball = [(0.52, 0, 0), (0, 0.52, 0), (0, 0, 0.52), (-0.52, 0, 0), (0, -0.52, 0), (0, 0, -0.52)]  # diagonal 1.80
    assert not is_rebuilt(ball, skin=1.05), "twice the largest displacement is the better bound"
    assert is_rebuilt(ball, skin=1.03)


def test_a_grain_of_another_rank_makes_the_list_stale_too():
    assert is_rebuilt([(0.0, 0, 0), (0.0, 0, 0), (0.0, 0, 0), (0.0, 0, 0), (0.0, 0, 0), (0.6, 0, 0)], skin=0.5, ranks=3)


def test_intervals_and_the_bound_of_equation_13_are_remembered():
    watch = Staleness()
    for step in (0, 7, 7, 10):  # a rebuild without a step in between is no interval
        watch.remember(step)
    assert (watch.rebuilds, watch.shortest, watch.total) == (2, 3, 10)
    watch.advance(2.0, skin=0.1, dt=0.01)
    watch.advance(1.0, skin=0.1, dt=0.01)
    watch.advance(0.0, skin=0.1, dt=0.01)
    assert watch.bound_13 == pytest.approx(2.5), "skin / (2 v dt) of the fastest"
    assert watch.approach == pytest.approx(0.06), "twice the ways of the fastest"
    watch.remember(11)
    assert watch.approach == 0.0, "a new list begins a new count"


def test_more_rebuilds_may_be_asked_for():
    sim = pile(count=5)
    asked, done = [], []
    sim.staleness.also_when = lambda step: bool(asked.append(step)) or step % 3 == 0
    sim.skin = 1.5  # not one is needed
    for _ in range(8):
        sim.run(1)
        done.append(sim.staleness.last_step)
    assert asked == [1, 2, 3, 4, 5, 6, 7, 8] and done == [0, 0, 3, 3, 3, 6, 6, 6]


@pytest.mark.parametrize("speed", [(0.0, 0.0, 3.0), (20.0, 0.0, 3.0)])
def test_a_wall_that_comes_near_makes_the_list_stale(speed):
    """Grains at rest and a floor that rises: nothing else moves, and it must not arrive unseen."""

    def final(also_when):
        sim = simulation(dt=5e-4)
        sim.staleness.also_when = also_when
        sim.add_wall(bc.Plane((0, 0, 1.0), (0, 0, 1), velocity=speed))
        sim.add_grains([[5.0, 5.0, 1.9], [8.0, 8.0, 2.1]], 0.5)
        sim.skin = 0.1
        sim.run(800)
        return sim

    watched = final(None)
    assert (watched.grains.velocity[:, 2] > 1.0).all(), "both were hit"
    assert watched.staleness.rebuilds < 700
    assert fingerprint(watched) == fingerprint(final(lambda step: True))


@pytest.mark.parametrize("skin", [0.02, 0.4])
def test_the_moment_of_rebuilds_changes_no_bit(skin):
    every, seldom = pile(), pile()
    every.staleness.also_when = lambda step: True
    seldom.skin = skin
    for sim in (every, seldom):
        sim.run(60)
    assert fingerprint(every) == fingerprint(seldom)
    assert seldom.staleness.rebuilds < every.staleness.rebuilds == 60
