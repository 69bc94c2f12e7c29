"""When the list is rebuilt: never too late, whatever moves."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scenes import fingerprint, pile, simulation

import barchan as bc
from barchan.domain import Box
from barchan.kernels.integrate import kick_drift_wrap
from barchan.neighbors.staleness import Staleness

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

moves = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=2, max_size=6)


def summary(displacement):
    """What the step reports of its displacements."""
    d = np.array(displacement)
    extents = [value for axis in range(3) for value in (d[:, axis].max(), (-d[:, axis]).max())]
    return float((d**2).sum(axis=1).max()), extents


@given(moves, st.floats(0.01, 3.0), st.tuples(*[st.floats(-50.0, 50.0)] * 3))
@example([(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)], 0.99, (0.0, 0.0, 0.0))
@example([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], 1.4, (0.0, 0.0, 0.0))
@settings(max_examples=300)
def test_while_it_is_not_stale_no_two_grains_have_approached_by_the_skin(displacement, skin, drift):
    """Both bounds, with and without a drift that all share: the second is what counts along a chute."""
    moved = np.array(displacement) + drift
    farthest, extents = summary(moved)
    largest_approach = max(np.linalg.norm(a - b) for a, b in combinations(moved, 2))
    if not Staleness().is_stale(0, farthest, extents, skin):
        assert largest_approach <= skin * (1.0 + 1e-12)


def test_it_is_not_stale_without_need():
    """Neither bound is thrown away: twice the largest displacement, and the diagonal of all."""
    watch = Staleness()
    assert not watch.is_stale(0, *summary([(0.4, 0, 0), (-0.4, 0, 0)]), skin=0.81)
    assert watch.is_stale(0, *summary([(0.4, 0, 0), (-0.4, 0, 0)]), skin=0.79)
    together = [(30.0, 5.0, 0.0), (30.3, 5.0, 0.4)]
    assert not watch.is_stale(0, *summary(together), skin=0.51), "a flow that moves as a whole"
    assert watch.is_stale(0, *summary(together), skin=0.49)
    corners = [(0.3, 0.3, 0.3), (-0.3, -0.3, -0.3)]  # diagonal 1.04 = 2 x 0.52
    ball = [(0.52, 0, 0), (0, 0.52, 0), (0, 0, 0.52), (-0.52, 0, 0), (0, -0.52, 0), (0, 0, -0.52)]  # diagonal 1.80
    assert not watch.is_stale(0, *summary(corners), skin=1.05) and not watch.is_stale(0, *summary(ball), skin=1.05)


def test_more_rebuilds_may_be_asked_for():
    watch = Staleness()
    watch.also_when = lambda step: step == 3
    assert [watch.is_stale(step, 0.0, [0.0] * 6, 1.0) for step in range(5)] == [False, False, False, True, False]


def test_intervals_and_the_bound_of_equation_13_are_remembered():
    watch = Staleness()
    for step in (0, 7, 7, 10):  # a rebuild without a step in between is no interval
        watch.remember(step, np.zeros((1, 3)))
    assert (watch.rebuilds, watch.shortest, watch.total) == (2, 3, 10)
    watch.note_speed(2.0, skin=0.1, dt=0.01)
    watch.note_speed(1.0, skin=0.1, dt=0.01)
    watch.note_speed(0.0, skin=0.1, dt=0.01)
    assert watch.bound_13 == pytest.approx(2.5), "skin / (2 v dt) of the fastest"


@given(st.integers(0, 10**6), st.tuples(*[st.booleans()] * 3), st.floats(0.0, 2.0))
def test_the_step_reports_the_displacements_since_the_rebuild(seed, periodic, spread):
    """Measured over the nearest image, for grains that crossed a periodic face on the way."""
    rng = np.random.default_rng(seed)
    box, n, dt = Box((-1, 0, 2), (7, 6, 9), periodic), 12, 0.5
    start = box.low + rng.uniform(0.3, 0.7, (n, 3)) * box.length
    crossing = np.array(periodic) * (rng.random((n, 3)) < 0.3)
    start = np.where(crossing, box.low + 0.001, start)
    before, velocity, force = rng.normal(size=(2, n, 3)) * 0.1, rng.normal(size=(n, 3)) * spread, rng.normal(size=(n, 3))
    velocity = np.clip(velocity, -2.0, 2.0)
    reference, _ = box.wrap(start - before[0] * np.array(periodic))
    place = np.hstack([box.wrap(start)[0], np.ones((n, 1))])
    inverse = rng.random((n, 1)) * (rng.random((n, 1)) < 0.8)  # some are frozen
    motion, spin = np.hstack([velocity, inverse]), np.zeros((n, 4))
    expected = box.difference(box.wrap(place[:, :3] + dt * (velocity + dt * inverse * force))[0], reference)
    image = np.zeros((n, 3), dtype=np.int32)
    frame = box.frame
    farthest, *extents = kick_drift_wrap(
        place, motion, spin, image, force, force, np.hstack([reference, np.ones((n, 1))]), frame.low, frame.length, frame.half, dt
    )
    square, sides = summary(expected)
    assert farthest == pytest.approx(square, rel=1e-12, abs=1e-14)
    assert extents[:6] == pytest.approx(sides, rel=1e-12, abs=1e-14)
    assert place[:, :3] + image * box.length == pytest.approx(box.wrap(start)[0] + dt * motion[:, :3], abs=1e-12)


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
