"""When something is due."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from barchan import At, Every
from barchan.errors import SceneError
from barchan.triggers import trigger

pytestmark = pytest.mark.nojit


@given(st.integers(1, 50), st.integers(0, 50), st.integers(0, 500))
def test_every_is_due_at_start_and_each_period_after_it(period, start, step):
    assert Every(period, start)(step) == (step in range(start, 1000, period))


@given(st.sets(st.integers(0, 20)), st.integers(0, 20))
def test_at_is_due_at_its_steps_only(steps, step):
    assert At(*steps)(step) == (step in steps)


@given(
    st.one_of(st.builds(Every, st.integers(1, 9), st.integers(0, 30)), st.builds(lambda s: At(*s), st.sets(st.integers(0, 60))))
)
def test_after_is_the_next_step_at_which_it_is_due(due):
    for step in range(60):
        assert due.after(step) == next((later for later in range(step + 1, 100) if due(later)), inf)


@pytest.mark.parametrize("period", [0, -3])
def test_every_refuses_a_period_that_never_passes(period):
    with pytest.raises(SceneError, match=f"period = {period}"):
        Every(period)


@pytest.mark.parametrize(
    "make", [lambda: Every(2.7), lambda: Every(float("nan")), lambda: Every(True), lambda: Every(3, -1), lambda: At(1.5)]
)
def test_steps_are_whole_numbers(make):
    with pytest.raises(SceneError, match="whole number"):
        make()


def test_what_cannot_be_asked_is_no_trigger():
    with pytest.raises(SceneError, match=r"table a.csv: due = 5 must be a trigger, such as barchan.Every"):
        trigger(5, "table a.csv")
    assert trigger(Every(3), "x")(3)
