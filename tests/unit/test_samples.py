"""Samples brought to a pressure or a solid fraction, in rooms of all kinds; friction meanwhile and afterwards."""

import numpy as np
import pytest
from clouds import cloud
from scenes import fingerprint

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.errors import CheckpointError, MaterialError, RunError, SceneError
from barchan.measure import solid_fraction, stress
from barchan.packing import Preparation, compact, hold, press
from barchan.walls import Room, Servo

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


@pytest.mark.parametrize("kind", ["brick", "cylinder", "plates"])
def test_a_sample_is_pressed_with_a_pressure_on_all_walls(kind):
    sim = cloud(kind)
    found = press(sim, 20.0, Preparation(friction=0.1))
    room = Room(sim)
    sim.prepare()
    assert [room.stress(sim, wall) for wall in room.walls] == pytest.approx([20.0] * len(room.walls), rel=5e-3)
    if kind != "plates":  # between them the stress across is what it may be
        assert found.pressure == pytest.approx(20.0, rel=5e-3), "walls are smooth"
    assert found.unbalanced < 1e-3 and found.steps == sim.step_number and 0.0 < found.overlap < 0.2
    x, y, z = room.size
    volume = np.pi / 4.0 * x * x * z if kind == "cylinder" else x * y * z
    assert found.solid_fraction == pytest.approx(4.0 / 3.0 * np.pi * (sim.grains.radius**3).sum() / volume, rel=1e-12)
    sim.run(2000)
    assert [room.stress(sim, wall) for wall in room.walls] == pytest.approx([20.0] * len(room.walls), rel=5e-3), "it is held"


def test_the_pressure_is_reached_before_a_sample_that_may_be_restless_is_taken():
    sim = cloud("cylinder")
    found = press(sim, 20.0, Preparation(rest=100.0, look=20))
    sim.prepare()
    assert [Room(sim).stress(sim, wall) for wall in sim.walls] == pytest.approx([20.0] * 3, rel=5e-3) and found.unbalanced > 1e-3


@pytest.mark.parametrize("kind", ["brick", "cylinder", "plates", "periodic"])
def test_a_sample_gets_its_solid_fraction(kind):
    """To 1e-6, 0.1 % being allowed, at an overlap of less than a tenth."""
    sim, wanted = cloud(kind, friction=0.0), 0.62 if kind == "periodic" else 0.58
    before, dense = sim.grains.sorted_by_id("radius"), sim.grains.mass[0] / sim.grains.radius[0] ** 3
    found = compact(sim, wanted, "growth" if kind == "periodic" else "walls", steps=4000)
    room = Room(sim)
    assert found.solid_fraction == pytest.approx(wanted, rel=1e-6)
    if kind == "periodic":
        assert solid_fraction(sim) == pytest.approx(wanted, rel=1e-6)
        growth = sim.grains.sorted_by_id("radius") / before
        assert growth == pytest.approx(np.full(len(growth), growth[0]), rel=1e-10) and growth[0] > 1.0
        assert sim.grains.mass[0] / sim.grains.radius[0] ** 3 == pytest.approx(dense, rel=1e-10)
        assert not sim.actions
    else:
        assert (sim.grains.sorted_by_id("radius") == before).all() and not any(wall.speed for wall in room.walls)
    assert found.void_ratio == pytest.approx(1.0 / wanted - 1.0, rel=1e-5) and found.overlap < 0.1
    assert found.pressure == pytest.approx(stress(sim).mean_stress * sim.box.length.prod() / room.volume)


def test_walls_close_in_evenly_from_all_sides():
    sim = cloud("brick")
    compact(sim, 0.5, "walls", steps=2000)
    low, high = np.array([[wall.point[axis] for wall in pair] for axis, pair in enumerate(Room(sim).ends)]).T
    assert low == pytest.approx([low[0]] * 3) and low + high == pytest.approx([5.2] * 3) and low[0] > 0.1


def test_growth_in_a_room_with_walls_leaves_them_where_they_are():
    sim = cloud("cylinder")
    found = compact(sim, 0.45, "growth", steps=2000)
    assert found.solid_fraction == pytest.approx(0.45, rel=1e-6) and Room(sim).size == pytest.approx([5.2] * 3, rel=1e-14)


def test_friction_meanwhile_is_that_of_grains_and_is_given_back():
    sim, seen = cloud("brick"), []

    class Watch:
        due = bc.Every(500)

        def write(self, sim):
            seen.append(sim.materials.table(sim.law)[list(sim.law.parameters).index("friction")].tolist())

    sim.materials.set_pair("a", "wall", friction=0.2)
    sim.writers.append(Watch())
    compact(sim, 0.5, "walls", Preparation(friction=0.05), steps=1000)
    assert set(map(tuple, seen)) == {(0.05, 0.2, 0.2, 0.0)}
    sim.prepare()
    Watch().write(sim)
    assert seen[-1] == [0.4, 0.2, 0.2, 0.0] and "preparation" not in sim.notes


def test_a_preparation_that_was_interrupted_goes_on_in_the_same_process_with_the_same_bits():
    whole, parts = cloud("brick"), cloud("brick")
    expected = press(whole, 20.0, Preparation(friction=0.1))

    class Stop:
        due = bc.At(777, 3001)

        def write(self, sim):
            sim.stop_requested = True

    parts.writers.append(Stop())
    for _ in range(2):
        with pytest.raises(bc.errors.Interrupted):
            press(parts, 20.0, Preparation(friction=0.1))
    assert press(parts, 20.0, Preparation(friction=0.1)) == expected
    assert parts.materials.pairs == {}
    assert (parts.grains.sorted_by_id("position") == whole.grains.sorted_by_id("position")).all()


def test_what_follows_a_preparation_is_resumed_in_a_scene_whose_walls_hold_the_pressure(tmp_path):
    sim, again = cloud("cylinder"), cloud("cylinder")
    press(sim, 20.0, Preparation(friction=0.1))
    sim.run(200)
    save(sim, tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="walls"):
        restore(cloud("cylinder"), tmp_path / "c.h5")
    hold(again, 20.0)
    restore(again, tmp_path / "c.h5")
    for one in (sim, again):
        one.run(200)
    assert fingerprint(sim) == fingerprint(again)


def test_a_sample_that_does_not_come_to_rest_is_told():
    with pytest.raises(RunError, match=r"not at rest after 2000 steps: unbalanced force inf, allowed"):
        compact(cloud("brick"), 0.5, "walls", Preparation(most=1000), steps=2000)
    with pytest.raises(RunError, match=r"not at rest after 1000 steps: unbalanced force .*, allowed 0.001. Damp more"):
        press(cloud("brick"), 20.0, Preparation(most=1000))


def test_a_checkpoint_of_something_else_is_no_preparation(tmp_path):
    save(cloud("periodic"), tmp_path / "c.h5")
    with pytest.raises(SceneError, match="no sample was being prepared when it was written"):
        compact(cloud("periodic"), 0.5, "growth", Preparation(resume=tmp_path / "c.h5"))
    with pytest.raises(CheckpointError, match="friction"):
        compact(cloud("periodic"), 0.5, "growth", Preparation(friction=0.1, resume=tmp_path / "c.h5"))


def controlled():
    sim = cloud("brick")
    sim.walls[2].control = Servo(1.0, force=1.0)
    return sim


def without_wall(number, kind="brick"):
    sim = cloud(kind)
    del sim.walls[number]
    return sim


def twice_round():
    sim = cloud("cylinder")
    sim.add_wall(bc.Cylinder((2, 2, 0), (0, 0, 1), 9.0))
    return sim


def of_nothing():
    sim = cloud("brick")
    sim.remove(sim.grains.id.copy())
    return sim


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: press(cloud("periodic"), 1.0), "press: the box is periodic on all sides, .* let grains grow"),
        (lambda: press(cloud("brick"), 0.0), r"press: pressure = 0.0 \[force/length\^2\] must be a finite number > 0"),
        (lambda: press(cloud("brick"), 1.0, 0.3), r"press: how = 0.3 must be a barchan.packing.Preparation"),
        (lambda: press(cloud("brick"), 1.0, Preparation(look=0)), "press: look = 0 "),
        (lambda: press(cloud("brick"), 1.0, Preparation(rest=-1.0)), "press: rest = -1.0 "),
        (lambda: press(without_wall(1), 1.0), "along x the box is not periodic, and 1 plane.s. face up and 0 down"),
        (lambda: press(without_wall(0, "cylinder"), 1.0), "Room: along x"),
        (lambda: press(twice_round(), 1.0), r"Room: 2 cylinder\(s\)"),
        (lambda: press(of_nothing(), 1.0), "no grains to prepare a sample of"),
        (lambda: compact(cloud("brick"), 1.2, "walls"), "solid_fraction = 1.2 .* below 1"),
        (lambda: compact(cloud("brick"), 0.1, "walls"), r"solid_fraction = 0.1 .* above that of now, 0.2"),
        (lambda: compact(cloud("brick"), 0.5, "hand"), "by = 'hand' must be 'walls' or 'growth'"),
        (lambda: compact(cloud("brick"), 0.5, "walls", steps=3), "compact: steps = 3 must be a whole number >= 20"),
        (lambda: compact(cloud("periodic"), 0.5, "walls"), "compact: the box is periodic"),
        (lambda: compact(controlled(), 0.5, "walls"), "this plane has a control, Servo; set it to None"),
        (lambda: Room(cloud("brick")).area(bc.Plane((0, 0, 0), (0, 0, 1))), "this plane is no wall of the room, which has 6"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_a_friction_that_cannot_be_is_refused():
    sim = cloud("brick")
    with pytest.raises(MaterialError, match=r"friction = -1"):
        press(sim, 1.0, Preparation(friction=-1.0))
    assert sim.notes == {} and sim.materials.pairs == {}
