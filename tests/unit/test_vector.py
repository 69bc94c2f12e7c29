"""The vocabulary of laws, against NumPy."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from barchan.laws.vector import add, cross, dot, norm, project, scale, sub, turn

pytestmark = pytest.mark.nojit

vectors = st.tuples(*[st.floats(-1e3, 1e3, allow_subnormal=False)] * 3)


@st.composite
def unit_vectors(draw):
    v = np.array(draw(vectors))
    assume(np.linalg.norm(v) > 1e-3)
    return tuple((v / np.linalg.norm(v)).tolist())


@given(vectors, vectors, st.floats(-1e3, 1e3))
def test_arithmetic_is_that_of_numpy(a, b, s):
    assert add(a, b) == tuple(np.add(a, b))
    assert sub(a, b) == tuple(np.subtract(a, b))
    assert scale(s, a) == tuple(s * np.array(a))
    assert cross(a, b) == pytest.approx(np.cross(a, b), rel=1e-12, abs=1e-9)
    assert dot(a, b) == pytest.approx(np.dot(a, b), rel=1e-12, abs=1e-9)
    assert norm(a) == pytest.approx(np.linalg.norm(a), rel=1e-14)


@given(vectors, unit_vectors())
def test_project_removes_the_normal_part_and_nothing_else(a, normal):
    flat = project(a, normal)
    assert abs(dot(flat, normal)) <= 1e-14 * (1.0 + norm(a))
    assert norm(cross(sub(a, flat), normal)) <= 1e-14 * (1.0 + norm(a)), "what was removed lies along the normal"


@given(vectors, unit_vectors())
def test_turn_lays_a_vector_into_the_plane_and_keeps_its_length(a, normal):
    assume(norm(project(a, normal)) > 1e-3 * norm(a))
    turned = turn(a, normal)
    assert norm(turned) == pytest.approx(norm(a), rel=1e-12)
    assert abs(dot(turned, normal)) <= 1e-11 * norm(a)
    assert dot(turned, project(a, normal)) > 0.0, "it keeps its direction in the plane"


@pytest.mark.parametrize("a", [(0.0, 0.0, 0.0), (0.0, 0.0, 2.5)])
def test_turn_of_a_vector_with_no_direction_in_the_plane_is_zero(a):
    assert turn(a, (0.0, 0.0, 1.0)) == (0.0, 0.0, 0.0)
