"""When something is due."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from barchan import At, Every
from barchan.errors import SceneError

pytestmark = pytest.mark.nojit


@given(st.integers(1, 50), st.integers(0, 50), st.integers(0, 500))
def test_every_is_due_at_start_and_each_period_after_it(period, start, step):
    assert Every(period, start)(step) == (step in range(start, 1000, period))


@given(st.sets(st.integers(0, 20)), st.integers(0, 20))
def test_at_is_due_at_its_steps_only(steps, step):
    assert At(*steps)(step) == (step in steps)


@pytest.mark.parametrize("period", [0, -3])
def test_every_refuses_a_period_that_never_passes(period):
    with pytest.raises(SceneError, match=f"period = {period}"):
        Every(period)
