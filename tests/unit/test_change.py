"""Parameters that change on a trigger: honoured in that step, once, the same bits on ranks, and made again by a resume."""

import numpy as np
import pytest
from fuzzing import write_state
from scenes import SOFT, fingerprint

import barchan as bc
from barchan.actions import Change, mark_places
from barchan.checkpoint import collect, read_state, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError, SceneError
from barchan.measure import strain
from barchan.parallel import virtual_ranks
from barchan.walls import Proportional, Servo, Vibration

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


def cell(**options):
    """Grains between four walls, without changes."""
    stuff = [bc.Material(name, density=1.0, **{**SOFT, "friction": mu}) for name, mu in (("a", 0.4), ("b", 0.1), ("c", 0.7))]
    sim = bc.Simulation(bc.Box((-2, -2, -2), (9, 9, 9)), bc.laws.linear, stuff, 5e-4, gravity=(0, 0, -3.0), **options)
    sim.max_overlap, random = 1.0, np.random.default_rng(5)
    cells = np.stack(np.meshgrid(*3 * [np.arange(4)], indexing="ij"), axis=-1).reshape(-1, 3)
    place, radius = cells + 1.0 + random.uniform(-0.05, 0.05, cells.shape), random.uniform(0.4, 0.5, len(cells))
    sim.add_grains(place, radius, random.integers(0, 2, len(cells)), velocity=random.normal(scale=1.0, size=cells.shape))
    side = sim.add_wall(bc.Cylinder((2.5, 2.5, 0), (0, 0, 1), 2.6, material="c"))
    sim.add_wall(bc.Plane((0, 0, 0.55), (0, 0, 1)))
    top = sim.add_wall(bc.Plane((0, 0, 4.45), (0, 0, -1), material="b"))
    sim.add_wall(bc.Sphere((2.4, 2.6, 2.5), 0.3, inside=False))
    side.control = Servo(max_speed=2.0, stress=20.0, area=lambda sim: 20.0 * side.radius)
    top.control = Proportional(1e-3, force=30.0, max_speed=3.0)
    return sim


def slide(sim):
    """A wall's velocity, its material, and what its control aims at."""
    sim.walls[1].velocity = (0.5, 0, 0)
    sim.walls[1].material = "c"
    sim.walls[0].control.stress = 40.0


def rub(sim):
    """Friction of two pairs, one of them that of grains."""
    sim.materials.set_pair("a", "c", friction=0.9)
    sim.materials.set_pair("a", "a", friction=0.05)


def shake(sim):
    """Other controls, gravity and damping."""
    sim.walls[2].control = Servo(max_speed=1.0, force=50.0)
    sim.walls[3].control = Vibration((0.1, 0, 0), 30.0)
    sim.gravity, sim.damping = (0.5, 0, -2.0), bc.Damping(local=0.2)


def changing(**options):
    sim = cell(**options)
    sim.actions = [
        Change("slide", bc.At(40), slide),
        Change("rub", bc.Every(10, start=60), rub),
        Change("shake", bc.At(81), shake),
    ]
    return sim


def after(path, *steps):
    sim = changing()
    for number, count in enumerate(steps):
        if number:
            sim = changing()
            restore(sim, path)
        sim.run(count)
        save(sim, path)
    return collect(sim)


@pytest.mark.parametrize("stops", [(20, 130), (40, 110), (41, 20, 89), (60, 90), (61, 20, 69), (100, 50)], ids=str)
@pytest.mark.parametrize("ranks", [1, 3])
def test_the_same_bits_on_ranks_and_after_a_resume(ranks, stops, tmp_path):
    """Stopped before, in, and after the step of a change."""
    after(tmp_path / "whole.h5", 150)
    virtual_ranks(ranks, after, tmp_path / "parts.h5", *stops)
    assert (tmp_path / "parts.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()


@pytest.mark.parametrize("change", [slide, rub, shake])
def test_a_change_begins_in_its_step_and_is_noted(change):
    plain, changed = cell(), cell()
    changed.actions = [Change("it", bc.At(40), change)]
    for sim in (plain, changed):
        sim.run(39)
    assert fingerprint(plain) == fingerprint(changed) and "changes" not in changed.notes
    for sim in (plain, changed):
        sim.run(20)
    assert fingerprint(plain) != fingerprint(changed) and changed.notes["changes"] == ["it"]


def test_forces_of_the_step_have_the_new_friction():
    """Two grains that slide on each other at Coulomb's limit: in step 5 the tangential force is that of the new friction."""
    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, bc.Material("a", density=1.0, **{**SOFT, "kt": 1e4}), 1e-4)
    sim.add_grains([(3, 3, 3), (3, 3, 3.95)], 0.5, velocity=[(0, 0, 0), (40.0, 0, 0)])
    sim.actions = [Change("smooth", bc.At(5), lambda sim: sim.materials.set_pair("a", "a", friction=0.1))]
    found = []
    for _ in range(6):
        sim.run(1)
        table = bc.measure.contact_table(sim)
        centres = sim.grains.sorted_by_id("position")
        normal = (centres[0] - centres[1]) / np.linalg.norm(centres[0] - centres[1])
        along = table["force"][0] @ normal
        found.append(np.linalg.norm(table["force"][0] - along * normal) / along)
    assert found == pytest.approx([0.4] * 4 + [0.1] * 2, rel=1e-9)


def test_a_change_is_made_once():
    sim, count = cell(), []
    sim.actions = [Change("it", bc.Every(3), count.append)]
    sim.run(10)
    assert len(count) == 1


def test_a_stiffness_that_the_time_step_does_not_suit_is_refused_in_the_step_of_the_change():
    sim = cell()
    sim.actions = [Change("harden", bc.At(7), lambda sim: sim.materials.set_pair("a", "a", kn=1e9))]
    with pytest.raises(SceneError, match="above the stable time step"):
        sim.run(20)
    assert sim.step_number == 7


def test_a_scene_without_the_change_is_refused(tmp_path):
    after(tmp_path / "c.h5", 70)
    sim = cell()
    sim.actions = [Change("slide", bc.At(40), slide)]
    with pytest.raises(CheckpointError, match="change 'rub' was made by then, and this scene has 'slide'; put the same"):
        restore(sim, tmp_path / "c.h5")
    state = read_state(tmp_path / "c.h5")
    state.about["notes"]["changes"] = {"rub": 3}
    write_state(state, tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="notes of changes"):
        restore(changing(), tmp_path / "c.h5")


def test_places_may_be_marked_by_a_change_and_a_resume_has_those_of_the_checkpoint(tmp_path):
    def marking():
        sim = cell()
        sim.actions = [Change("mark", bc.At(20), mark_places)]
        return sim

    sim = marking()
    sim.run(30)
    save(sim, tmp_path / "c.h5")
    again = marking()
    restore(again, tmp_path / "c.h5")
    for one in (sim, again):
        one.run(30)
    assert strain(again).grains == 64 and strain(again).gradient.tobytes() == strain(sim).gradient.tobytes()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Change("it", bc.At(3), 4), "change 'it': 4 must be a function of the simulation"),
        (lambda: Change("it", 3, slide), "change 'it': due = 3 must be a trigger"),
    ],
)
def test_what_is_no_change_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_states_differ_where_they_should():
    """The comparison of the first test sees a change that was left out."""
    whole, less = changing(), changing()
    del less.actions[1]
    for sim in (whole, less):
        sim.run(100)
    assert differences(collect(whole), collect(less))
