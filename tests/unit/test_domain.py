"""The box: the shortest way between two points, and folding into the period."""

from itertools import product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from barchan.domain import Box
from barchan.errors import SceneError
from barchan.kernels.integrate import fold, nearest

pytestmark = pytest.mark.nojit

corners = st.tuples(*[st.floats(-10.0, 10.0)] * 3)
edges = st.tuples(*[st.floats(0.5, 20.0)] * 3)
flags = st.tuples(*[st.booleans()] * 3)


@st.composite
def boxes(draw):
    low = np.array(draw(corners))
    return Box(low, low + np.array(draw(edges)), draw(flags))


def points_in(box, seed, count):
    return box.low + np.random.default_rng(seed).random((count, 3)) * box.length


@given(boxes(), st.integers(0, 10**6))
def test_difference_is_the_shortest_over_all_images(box, seed):
    a, b = points_in(box, seed, 2)
    shifts = [np.array(s) * box.length for s in product(*[(-1, 0, 1) if p else (0,) for p in box.periodic])]
    shortest = min(np.linalg.norm(a - b + s) for s in shifts)
    assert np.linalg.norm(box.difference(a, b)) == pytest.approx(shortest, rel=1e-12, abs=1e-12)
    assert (box.difference(a, b) == -box.difference(b, a)).all(), "both sides of a contact see the same branch"
    whole_turns = (box.difference(a, b) - (a - b)) / box.length
    assert np.abs(whole_turns - np.round(whole_turns)).max() < 1e-12


@given(boxes(), st.integers(0, 10**6))
def test_kernels_and_box_take_the_same_bits_for_the_difference(box, seed):
    a, b = points_in(box, seed, 2)
    frame = box.frame
    by_kernel = [nearest(a[c] - b[c], frame.length[c], frame.half[c]) for c in range(3)]
    assert by_kernel == box.difference(a, b).tolist()


@given(boxes(), st.integers(0, 10**6), st.floats(0.0, 30.0))
def test_wrap_folds_into_the_box_and_counts_images(box, seed, spread):
    position = box.low + (np.random.default_rng(seed).normal(size=(5, 3)) * spread + 0.5) * box.length
    folded, image = box.wrap(position)
    for axis in range(3):
        if box.periodic[axis]:
            assert (folded[:, axis] >= box.low[axis]).all() and (folded[:, axis] < box.high[axis]).all()
        else:
            assert (folded[:, axis] == position[:, axis]).all() and not image[:, axis].any()
    assert np.abs(folded + image * box.length - position).max() <= 1e-13 * (1.0 + np.abs(position).max())
    again, none = box.wrap(folded)
    assert (again == folded).all() and not none.any()


@given(st.floats(-10.0, 10.0), st.floats(0.5, 20.0), st.integers(-3, 3), st.integers(-2, 2))
@example(0.1, 0.8, -1, 0)
def test_wrap_at_the_very_faces(low, edge, ulps, turns):
    """A few last digits beside a face are where folding goes wrong by rounding."""
    box = Box((low, 0, 0), (low + edge, 1, 1), (True, False, False))
    x = (low if ulps < 0 else low + edge) + turns * edge
    for _ in range(abs(ulps)):
        x = np.nextafter(x, np.inf if ulps > 0 else -np.inf)
    folded, image = box.wrap(np.array([[x, 0.5, 0.5]]))
    digits = 4.0 * np.finfo(float).eps * (abs(low) + edge)
    assert box.low[0] <= folded[0, 0] < box.high[0]
    assert folded[0, 0] + image[0, 0] * edge == pytest.approx(x, abs=4.0 * digits)


@given(st.floats(-10.0, 10.0), st.floats(0.5, 20.0), st.floats(-0.9, 1.9))
def test_fold_of_a_step_returns_to_the_period_and_counts_it(low, edge, place):
    """The kernel folds once, which is enough for a step shorter than the period."""
    frame = Box((low, 0, 0), (low + edge, 1, 1), (True, False, False)).frame
    x = low + place * edge
    folded, turns = fold(x, frame.low[0], frame.length[0], frame.half[0])
    assert frame.low[0] <= folded < frame.low[0] + frame.length[0]
    assert folded + turns * frame.length[0] == pytest.approx(x, rel=1e-13, abs=1e-13)
    assert fold(x, low, edge, np.inf) == (x, 0), "a direction without period never folds"


def test_outside_means_beyond_a_face_that_is_not_periodic():
    box = Box((0, 0, 0), (1, 1, 1), periodic=(True, False, False))
    points = np.array(
        [[0.5, 0.5, 0.5], [3.0, 0.5, 0.5], [0.5, 1.01, 0.5], [0.5, 0.5, -0.01], [np.nan, 0.5, 0.5], [0.5, 1.0, 0.0]]
    )
    assert box.outside(points).tolist() == [False, False, True, True, True, False]


@pytest.mark.parametrize(
    ("low", "high", "periodic"),
    [
        ((0, 0, 0), (1, 1, 0), (False,) * 3),
        ((0, 0, 0), (1, -1, 1), (False,) * 3),
        ((0, 0, 0), (1, np.nan, 1), (False,) * 3),
        ((0, 0, -np.inf), (1, 1, 1), (False,) * 3),
        ((0, 0), (1, 1), (False,) * 3),
        ((0, 0, 0), (1, 1, 1), (True, True)),
    ],
)
def test_impossible_boxes_are_refused(low, high, periodic):
    with pytest.raises(SceneError, match="box: "):
        Box(low, high, periodic)
