"""The examples run, and show what they say."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name):
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"]


def test_two_grains_part_with_the_restitution_of_their_material():
    assert example("two_grains_colliding")() == pytest.approx(0.8, rel=1e-3)


def test_settled_sand_rests_on_the_floor():
    assert example("sand_settling")() == pytest.approx(1.0, rel=0.01)


def test_grains_on_a_chute_move_faster_towards_the_surface():
    height, speed = example("steady_chute_flow")(layers=6, duration=4.0)
    lower, upper = speed[height < 2.5].mean(), speed[height > 4.0].mean()
    assert 0.0 < lower < upper
    assert np.isfinite(speed).all()
