"""Plane walls: geometry, and what is refused."""

import numpy as np
import pytest
from scenes import simulation

import barchan as bc
from barchan.errors import SceneError

pytestmark = pytest.mark.nojit


def test_the_normal_is_brought_to_length_one():
    assert bc.Plane((0, 0, 0), (3, 0, 4)).normal.tolist() == pytest.approx([0.6, 0, 0.8], rel=1e-15)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"point": (0, 0)}, r"plane: point = \(0, 0\) must be three finite numbers"),
        ({"normal": (0, 0, np.nan)}, "plane: normal = .* must be three finite numbers"),
        ({"velocity": (0, np.inf, 0)}, "plane: velocity = .* must be three finite numbers"),
        ({"normal": (0, 0, 0)}, r"plane: normal = \(0, 0, 0\) has no direction"),
    ],
)
def test_what_is_no_plane_is_refused(given, message):
    with pytest.raises(SceneError, match=message):
        bc.Plane(**{"point": (0, 0, 0), "normal": (0, 0, 1), **given})


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (5.0, -3.0, 0.0)])
def test_any_point_of_the_plane_gives_the_same_wall(shift):
    sim = simulation()
    sim.add_wall(bc.Plane((1.0 + shift[0], 1.0 + shift[1], 1.0), (0, 0, 1)))
    sim.add_grains([[5, 5, 1.47]], 0.5)
    sim.prepare()
    assert sim.grains.force[0] == pytest.approx([0, 0, 1000.0 * 0.03], rel=1e-12)


def test_a_moving_wall_carries_its_contacts_along():
    """A floor that slides drags a grain that lies on it; one that rises moves by dt v in each step."""
    sim = simulation(gravity=(0, 0, -10.0))
    wall = sim.add_wall(bc.Plane((0, 0, 1.0), (0, 0, 1), velocity=(2.0, 0, 0.5)))
    sim.add_grains([[5, 5, 1.5 - np.pi / 6 * 10.0 / 1000.0]], 0.5, velocity=(0, 0, 0.5))
    sim.run(100)
    assert wall.point == pytest.approx([0.2, 0, 1.05], rel=1e-12)
    assert sim.grains.velocity[0, 0] > 0.1 and sim.grains.omega[0, 1] < -0.1, "dragged along +x, it turns about -y"
    assert sim.grains.position[0, 2] == pytest.approx(1.55, abs=0.01)


def test_a_wall_does_not_touch_what_is_frozen():
    sim = simulation()
    sim.add_wall(bc.Plane((0, 0, 1.0), (0, 0, 1)))
    sim.add_grains([[5, 5, 1.45]], 0.5, frozen=True)
    sim.run(2)
    assert not sim.grains.force.any()


def test_its_state_is_kept_in_plain_numbers():
    wall = bc.Plane((1, 2, 3), (0, 1, 1), velocity=(0.1, 0, 0))
    wall.move(0.25)
    again = bc.Plane((0, 0, 0), (1, 0, 0))
    again.restore(wall.state())
    assert again.state() == {**wall.state(), "key": again.key}
    assert again.point.tolist() == [1.025, 2.0, 3.0]
