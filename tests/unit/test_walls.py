"""Plane walls: geometry, and what is refused."""

import numpy as np
import pytest
from scenes import fingerprint, simulation

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


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("velocity", (0, np.nan, 0), "plane: velocity = .* must be three finite numbers"),
        ("velocity", 1.0, "plane: velocity = 1.0 must be three finite numbers"),
        ("point", "here", "plane: point = 'here'"),
        ("normal", (0, 0, 0), "plane: normal = .* has no direction"),
    ],
)
def test_what_is_no_plane_cannot_be_set_later_either(name, value, message):
    wall = bc.Plane((0, 0, 0), (0, 0, 1))
    with pytest.raises(SceneError, match=message):
        setattr(wall, name, value)
    assert wall.state() == bc.Plane((0, 0, 0), (0, 0, 1)).state()
    with pytest.raises(ValueError, match="read-only"):
        getattr(wall, name)[0] = np.nan


def test_a_misspelt_attribute_of_a_wall_is_refused():
    with pytest.raises(AttributeError, match="velocty"):
        bc.Plane((0, 0, 0), (0, 0, 1)).velocty = (0, 0, 1)


@pytest.mark.parametrize(
    ("name", "value"),
    [("normal", (0, 0.6, 1.6)), ("point", (0, 0, 1.02)), ("velocity", (2.0, 0, 0)), ("material", "b")],
)
def test_a_wall_edited_between_runs_equals_one_that_was_so_from_the_start(name, value):
    """A normal of any length too; forces and neighbours are made anew before the next step."""

    def scene(**changed):
        materials = [
            bc.Material(n, density=1.0, kn=kn, kt=300.0, gamma_t=5.0, friction=0.4) for n, kn in (("a", 1e3), ("b", 2e3))
        ]
        sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), bc.laws.linear, materials, 1e-3)
        sim.add_wall(bc.Plane(**{"point": (0, 0, 1.0), "normal": (0, 0, 1), "material": "a", **changed}))
        sim.add_grains([[5, 0.1, 1.48], [8, 0.1, 1.49]], 0.5)
        sim.prepare()
        return sim

    edited, plain = scene(), scene(**{name: value})
    setattr(edited.walls[0], name, value)
    for sim in (edited, plain):
        sim.run(3)
    assert fingerprint(edited) == fingerprint(plain) != fingerprint(scene())


def test_an_edit_that_does_not_fit_the_box_is_refused_until_it_is_mended():
    sim = simulation(bc.Box((0, 0, 0), (9, 9, 9), (True, False, False)))
    wall = sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    sim.add_grains([[5, 5, 1.48]], 0.5)
    sim.run(1)
    wall.normal = (1, 0, 1)
    for _ in range(2):
        with pytest.raises(SceneError, match=r"wall 0 \(plane\): its normal .* leans along x"):
            sim.run(1)
    wall.normal = (0, 0, 1)
    sim.run(1)
    wall.material = "wood"
    with pytest.raises(SceneError, match="no material 'wood'"):
        sim.run(1)


def test_restoring_a_wall_keeps_its_bits_and_is_no_edit():
    wall = bc.Plane((1, 2, 3), (0.3, 0.5, 0.7))
    again = bc.Plane((0, 0, 0), (1, 0, 0))
    again.edited = False
    again.restore(wall.state())
    assert again.normal.tobytes() == wall.normal.tobytes() and not again.edited
