"""The examples run, and show what they say."""

import runpy
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from barchan.compare import last_state

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


def test_grains_in_a_hopper_of_triangles_resist_the_blade_that_stirs_them(tmp_path):
    carried, torque = example("stirred_hopper")(duration=0.2, picture=tmp_path / "hopper.png")
    assert carried == pytest.approx(1.0, abs=0.3) and torque < 0.0
    picture = matplotlib.image.imread(tmp_path / "hopper.png")
    grains, hopper = (np.ptp(picture[..., :3], axis=2) > 0.2).mean(), (np.ptp(picture[..., :3], axis=2) < 0.02).mean()
    assert 0.05 < grains < 0.5 and hopper > 0.3, "both are seen"


def test_sand_in_a_triaxial_cell_has_a_friction_angle():
    assert 18.0 < example("triaxial")(across=5) < 45.0


def test_a_ball_falls_freely_until_it_hits_the_bed_and_loses_its_speed_there():
    times, height, top = example("impact_on_a_bed")(500, (0.01, 0.01), 4e7, 2e-6, settle=0.02, duration=0.04, ball=3e-3)
    falling = height > top
    assert 0.01 < top < 0.03 and 5 < falling.sum() < 18
    assert height[falling] == pytest.approx((height[0] - 5.0 * times - 0.5 * 9.81 * times**2)[falling], abs=1e-5)
    assert 0.0 < height.min() < top - 3e-3 and abs(height[-1] - height[-2]) < 0.2 * 5.0 * (times[-1] - times[-2])


def test_the_avalanche_of_the_script_is_that_of_the_file(tmp_path):
    command = [sys.executable, "-m", "barchan", "run", str(EXAMPLES / "avalanche.toml"), "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    fields = last_state(tmp_path).fields
    sim = example("avalanche")()
    for name in ("position", "velocity", "omega", "force"):
        assert np.array_equal(sim.grains.sorted_by_id(name), fields[name])
