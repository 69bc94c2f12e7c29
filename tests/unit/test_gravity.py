"""Gravity: any direction, constant or a function of time."""

import pytest

from barchan.errors import SceneError
from barchan.forces import Gravity

pytestmark = pytest.mark.nojit


def test_constant_and_function_of_time():
    assert Gravity((1, 2, -3)).at(7.0) == (1.0, 2.0, -3.0)
    assert Gravity(lambda t: [t, 0, -t * t]).at(3.0) == (3.0, 0.0, -9.0)


@pytest.mark.parametrize("value", [(1, 2), 9.81, "down", (0, 0, float("nan")), None, (0, 0, "x")])
def test_what_is_no_acceleration_is_refused_before_the_start(value):
    with pytest.raises(SceneError, match=r"gravity at t = 0: .* must be three finite numbers \[length/time\^2\]"):
        Gravity(value)
    with pytest.raises(SceneError, match="gravity at t = 0"):
        Gravity(lambda t: value)


def test_a_function_that_fails_later_names_the_time():
    falling_apart = Gravity(lambda t: (0.0, 0.0, -1.0 if t < 1.0 else float("inf")))
    with pytest.raises(SceneError, match=r"gravity at t = 1.5: \(0.0, 0.0, inf\)"):
        falling_apart.at(1.5)
