"""Contracts of ``Simulation`` that no single module keeps: cutting a run, priming, and what may change between runs."""

import warnings

import numpy as np
import pytest
from scenes import NOTHING, SOFT, fingerprint, pile, simulation

import barchan as bc
from barchan.checkpoint import collect, read_state, restore, save
from barchan.compare import differences
from barchan.errors import OverlapError, SceneError
from barchan.measure import contact_table
from barchan.neighbors.contacts import Contacts
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]


def test_a_run_may_be_cut_anywhere():
    whole, cut = pile(), pile()
    whole.run(60)
    for steps in (1, 0, 20, 38, 1):
        cut.run(steps)
    assert fingerprint(whole) == fingerprint(cut)
    assert (cut.step_number, cut.time) == (whole.step_number, whole.time)


def sliding_pair():
    sim = simulation()
    sim.add_grains([[5.0, 5.0, 5.0], [5.98, 5.0, 5.0]], 0.5, velocity=[[0.0, 30.0, 0.0], [0.0, 0.0, 0.0]])
    return sim


def test_priming_does_not_touch_the_memory_of_contacts():
    """F(0) is computed without advancing history; not even equation (8), which sliding would call for, may write it."""
    sim = sliding_pair()
    sim.prepare()
    table = contact_table(sim)
    pressing = 1000.0 * 0.02
    assert table["force"][0, 1] == pytest.approx(-0.4 * pressing, rel=1e-6), "the dashpot alone makes it slide"
    assert not table["memory"].any()
    sim.run(5)
    before = contact_table(sim)["memory"]
    sim.grains.velocity[sim.grains.row_of(0)] = [0.0, 0.0, -40.0]  # now the dashpot alone calls for a memory along z
    sim.prepare()
    assert before.any() and contact_table(sim)["memory"].tobytes() == before.tobytes()


def test_priming_forgets_contacts_that_an_edit_took_apart():
    sim = sliding_pair()
    sim.run(5)
    row = sim.grains.row_of(1)
    there = sim.grains.position[row].copy()
    sim.grains.position[row, 0] += 0.1
    sim.prepare()
    assert len(contact_table(sim)["first"]) == 0
    sim.grains.position[sim.grains.row_of(1)] = there
    sim.prepare()
    assert not contact_table(sim)["memory"].any()


@pytest.mark.parametrize("skins", [(0.1, 1.5), (1.5, 0.05), (0.1, 0.0), (0.1, None)])
def test_the_skin_may_be_changed_between_runs_and_changes_no_bit(skins):
    """A list made with a thin skin must not be trusted as if it had been made with a wide one."""

    def final(first, second):
        sim = simulation(gravity=(0.0, 0.0, -1.0))
        sim.add_grains(
            [[1.0, 1.0, 5.0], [2.6, 1.0, 5.0], [3.8, 1.2, 5.1]], 0.5, velocity=[[5.0, 0, 0], [-5.0, 0, 0], [-7.0, 0, 0]]
        )
        sim.skin = first
        sim.run(20)
        sim.skin = second
        sim.run(300)
        return fingerprint(sim), np.abs(sim.grains.omega).max()

    constant, spin = final(0.1, 0.1)
    assert spin > 0.0, "they collide"
    assert final(*skins)[0] == constant


def test_a_changed_skin_takes_effect_in_the_next_run():
    sim = simulation()
    sim.add_grains([[1.0, 1.0, 5.0], [4.0, 1.0, 5.0]], 0.5)
    listed = []
    for skin in (0.1, 3.0, 0.1):
        sim.skin = skin
        sim.run(1)
        listed.append(sim.contacts.n_pairs)
    assert listed == [0, 1, 0]


@pytest.mark.parametrize("skin", [-0.3, float("nan")])
def test_an_impossible_skin_is_refused(skin):
    sim = sliding_pair()
    sim.skin = skin
    with pytest.raises(SceneError, match="skin"):
        sim.run(1)


@pytest.mark.parametrize("dt", [0.0, -1e-3, float("nan"), 10.0])
def test_an_impossible_time_step_is_refused_before_and_between_runs(dt):
    if dt != 10.0:
        with pytest.raises(SceneError, match="dt = "):
            simulation(dt=dt)
    sim = sliding_pair()
    sim.run(2)
    before = fingerprint(sim)
    sim.dt = dt
    with pytest.raises(SceneError, match="dt"):
        sim.run(1)
    assert fingerprint(sim) == before, "nothing was advanced"


def test_a_pair_that_is_set_between_runs_holds_from_then_on():
    sim = simulation(properties={**NOTHING, "kn": 1000.0})
    sim.add_grains([[5.0, 5.0, 5.0], [5.98, 5.0, 5.0]], 0.5)
    sim.run(1)
    sim.materials.set_pair("a", "a", kn=2000.0)
    sim.prepare()
    assert sim.grains.force[sim.grains.row_of(1), 0] == pytest.approx(2000.0 * 0.02, rel=1e-2)


def test_gravity_may_be_changed_between_runs():
    sim = simulation(gravity=(0.0, 0.0, -1.0))
    sim.add_grains([[5.0, 5.0, 5.0]], 0.5)
    sim.run(10)
    sim.gravity = lambda time: (2.0, 0.0, 0.0)
    sim.run(11)  # the force at the moment of the change was computed with the old one
    assert sim.grains.velocity[0] == pytest.approx([10 * 2.0e-3, 0.0, -11 * 1.0e-3], rel=1e-12)


def test_velocities_of_the_full_step_are_brought_to_the_half_step():
    """With it, free fall from rest is z - g t^2 / 2 at every full step, to rounding."""
    sim = simulation(gravity=(0.0, 0.0, -2.0))
    sim.add_grains([[5.0, 5.0, 5.0]], 0.5)
    sim.start_at_full_step()
    for _ in range(3):
        sim.run(7)
        assert sim.grains.position[0, 2] == pytest.approx(5.0 - sim.time**2, rel=1e-13)


def test_an_empty_simulation_runs_without_a_warning():
    def program():
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            sim = simulation()
            sim.run(3)
            ids = sim.add_grains([[5.0, 5.0, 5.0]], 0.5, velocity=(1.0, 0.0, 0.0))
            sim.run(2)
            sim.remove(ids)
            sim.run(2)
        return sim.step_number, sim.grains.n

    assert program() == (7, 0)
    assert virtual_ranks(2, program) == [(7, 0)] * 2


def test_a_grain_that_crosses_more_than_a_period_in_a_step_is_not_let_out_of_the_box():
    """It is folded or it is an error; it does not go on outside."""
    sim = simulation(bc.Box((0, 0, 0), (10, 10, 10), (True, True, True)))
    sim.add_grains([[5.0, 5.0, 5.0]], 0.5, velocity=(27.0 / 1e-3, 0.0, 0.0))
    try:
        sim.run(1)
    except bc.BarchanError as error:
        assert "grain 0" in str(error)
    else:
        assert 0.0 <= sim.grains.position[0, 0] < 10.0


@pytest.mark.parametrize("target", [0.9, np.nextafter(0.9, 1.0), np.nextafter(0.9, 0.0), 0.1, np.nextafter(0.1, 0.0)])
def test_a_grain_that_lands_on_the_very_face_of_a_period_goes_on(target):
    """0.9 - 0.8 is a digit less than 0.1: rounding must neither take a grain out of the box nor count it as lost."""
    sim = simulation(bc.Box((0.1,) * 3, (0.9,) * 3, (True,) * 3), properties=NOTHING)
    start = 0.85 if target > 0.5 else 0.15
    sim.add_grains([[start, 0.5, 0.5]], 0.05)
    sim.prepare()
    sim.grains.velocity[0, 0] = (target - start) / sim.dt
    for _ in range(3):
        sim.run(1)
        sim.grains.velocity[...] = 0.0
    x, turns = sim.grains.position[0, 0], sim.grains.image[0, 0]
    assert x + turns * 0.8 == pytest.approx(target, abs=1e-15)
    assert 0.1 <= x <= 0.9


@pytest.mark.parametrize(("argument", "value"), [("box", (1, 1, 1)), ("law", "linear"), ("materials", [])])
def test_what_a_simulation_is_made_of_is_checked(argument, value):
    given = {
        "box": bc.Box((0, 0, 0), (1, 1, 1)),
        "law": bc.laws.linear,
        "materials": bc.Material("a", density=1.0, **SOFT),
        "dt": 1e-3,
    }
    with pytest.raises(SceneError, match=argument):
        bc.Simulation(**{**given, argument: value})


def test_one_error_for_each_scene_that_cannot_run():
    """Bad input never starts a run, and the message says what is wrong with which grain."""

    def message(change, **options):
        sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), (True, False, False)), **options)
        sim.add_grains([[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]], 0.5)
        change(sim)
        with pytest.raises(SceneError) as caught:
            sim.run(1)
        assert sim.step_number == 0
        return str(caught.value)

    def edit(name, value):
        def change(sim):
            getattr(sim.grains, name)[sim.grains.row_of(1)] = value

        return change

    assert "grain 1: velocity = [nan" in message(edit("velocity", np.nan))
    assert "grain 1: radius = 0 [length] must be > 0" in message(edit("radius", 0.0))
    assert "grain 1: mass = -1 [mass] must be > 0" in message(edit("mass", -1.0))
    assert "grain 1: material number 1 does not exist; the scene has 1" in message(edit("material", 1))
    assert "grain 1 at [3.0, 7.5, 3.0] lies outside the box" in message(edit("position", (3.0, 7.5, 3.0)))
    assert "its period along x is 6 [length]; it must be at least two cut-offs" in message(edit("radius", 1.6))
    stiff = message(lambda sim: None, properties={**SOFT, "kn": 1e9})
    assert "dt = 0.001 [time] is above the stable time step" in stiff


def test_overlap_and_loss_stop_a_run_with_the_grain_and_the_step():
    sim = simulation(properties=NOTHING)
    sim.add_grains([[5.0, 5.0, 5.0], [6.05, 5.0, 5.0]], 0.5, velocity=[[100.0, 0, 0], [0, 0, 0]])
    with pytest.raises(bc.errors.OverlapError, match=r"grain 0 and grain 1 at .* step \d+: overlap .* allowed are 20 %"):
        sim.run(4)
    sim = simulation()
    sim.add_grains([[0.05, 5.0, 5.0]], 0.5, velocity=(-20.0, 0, 0))
    with pytest.raises(bc.errors.LostGrainError, match=r"grain 0 at .*, step 3, .* not periodic"):
        sim.run(10)


def test_an_overlap_stops_the_run_in_its_very_step_and_no_later_one():
    """Surfaces 0.05 and 0.30 apart, closing by 0.1 a step: in step 3 the first two overlap by 0.25, the others not yet."""
    sim = simulation(properties=NOTHING)
    fast = [[0, 0, 0], [-100.0, 0, 0]] * 2
    sim.add_grains([[5.0, 9.0, 9.0], [6.30, 9.0, 9.0], [5.0, 5.0, 5.0], [6.05, 5.0, 5.0]], 0.5, velocity=fast)
    sim.run(2)
    with pytest.raises(bc.errors.OverlapError, match=r"grain 2 and grain 3 at .*, step 3: overlap 0.25 \[length\] is 25.0 %"):
        sim.run(1)
    assert sim.step_number == 3
    sim.grains.position[sim.grains.row_of(3)] = (15.0, 15.0, 15.0)
    sim.run(1)  # the fault has been told, and is gone
    assert sim.step_number == 4


def test_the_deepest_overlap_is_named():
    sim = simulation(properties=NOTHING)
    sim.add_grains([[5.0, 9.0, 9.0], [5.75, 9.0, 9.0], [5.0, 5.0, 5.0], [5.6, 5.0, 5.0], [9.0, 5.0, 5.0], [9.7, 5.0, 5.0]], 0.5)
    with pytest.raises(bc.errors.OverlapError, match=r"grain 2 and grain 3 .* is 40\.0 %"):
        sim.run(1)


def test_a_position_that_is_not_finite_stops_the_run_in_its_step():
    """Written behind the back of the checks: the second of two grains gets a speed of NaN."""
    sim = simulation()
    sim.add_grains([[5.0, 5.0, 5.0], [15.0, 15.0, 15.0]], 0.5)
    sim.run(3)
    sim.grains.view("velocity")[sim.grains.row_of(1)] = np.nan
    with pytest.raises(bc.errors.NotFiniteError, match=r"grain 1 at \[nan, nan, nan\].* step 4.* not finite"):
        sim.run(5)
    assert sim.step_number == 4


def test_a_force_that_is_not_finite_stops_the_run_in_its_step():
    """From step 4 on gravity is so strong that m g is beyond all numbers for the heavy grain, not for the light one."""
    sim = simulation(gravity=lambda time: (0.0, 0.0, 1e308 if time > 3.5e-3 else 0.0))
    sim.add_grains([[5.0, 5.0, 5.0], [15.0, 15.0, 15.0]], 0.5, mass=[0.5, 10.0])
    sim.run(3)
    with pytest.raises(bc.errors.NotFiniteError, match=r"grain 1 at .*, step 4: its force .*inf.* is not finite"):
        sim.run(1)


def test_a_lost_grain_stops_all_ranks_in_the_same_step():
    """It leaves on rank 1; rank 0 has nothing to complain about, and must neither go on nor hang."""

    def program():
        sim = simulation(bc.Box((0, 0, 0), (9, 9, 40)))
        sim.add_grains([[4.0, 4.0, 5.0], [4.0, 4.0, 30.0], [4.0, 4.0, 39.95]], 0.5, velocity=[[0, 0, 0], [0, 0, 0], [0, 0, 20.0]])
        with pytest.raises(bc.errors.RunError) as caught:
            sim.run(10)
        return type(caught.value).__name__, str(caught.value), sim.step_number

    (other, quoted, step), (guilty, message, _) = virtual_ranks(2, program)
    assert (other, guilty, step) == ("RankError", "LostGrainError", 3)
    assert message.startswith("grain 2 at ") and "step 3" in message
    assert quoted == f"stopped because rank 1 failed: {message}"


class Trip:
    """An action that fails once, at step 20."""

    tripped = False

    def due(self, step):
        return step == 20

    def apply(self, sim):
        if not self.tripped:
            self.tripped = True
            raise RuntimeError("tripped")


def test_forces_of_a_step_that_was_broken_off_are_computed_anew():
    """Two grains fly into one another: the force is k_n times the overlap at the present positions, not at those before."""
    sim = simulation(properties={**NOTHING, "kn": 1000.0})
    sim.add_grains([[5.0, 5.0, 5.0], [5.98, 5.0, 5.0]], 0.5, velocity=[[1.0, 0, 0], [-1.0, 0, 0]])
    sim.actions = [Trip()]
    with pytest.raises(RuntimeError, match="tripped"):
        sim.run(50)
    with pytest.warns(UserWarning, match="step 20 was broken off"):
        sim.prepare()
    (first, second), (force, _) = sim.grains.sorted_by_id("position")[:, 0], sim.grains.sorted_by_id("force")[:, 0]
    assert force == pytest.approx(-1000.0 * (1.0 - (second - first)), rel=1e-9)


class Insert:
    """Adds grains at step 30, when those that fly have gone further than half the skin."""

    def due(self, step):
        return step == 30

    def apply(self, sim):
        sim.add_grains([[5.98, 5.0, 5.0], [9.0, 9.0, 9.0], [12.0, 9.0, 9.0]], 0.5)


def test_grains_that_an_action_adds_within_a_step_are_felt_in_that_step():
    """The displacements since the last rebuild are those of the grains that were there then."""
    sim = simulation()
    sim.add_grains([[5.0, 5.0, 5.0], [15.0, 15.0, 1.0]], 0.5, velocity=[[0, 0, 0], [0, 0, 6.0]])
    sim.skin = 0.2
    sim.actions.append(Insert())
    sim.run(29)
    assert sim.grains.n == 2
    sim.run(1)
    assert sim.grains.n == 5
    assert sim.grains.force[sim.grains.row_of(0), 0] == pytest.approx(-1000.0 * 0.02, rel=1e-9)
    sim.run(40)
    assert sim.grains.velocity[sim.grains.row_of(2), 0] > 0.0


@pytest.mark.parametrize("part", ["put_aside", "build", "carry_over"])
def test_a_rebuild_that_an_error_broke_off_is_not_taken_for_whole(part, tmp_path, monkeypatch):
    """What contacts remember is neither in the old list nor in the new one: only a checkpoint helps."""
    sim, fresh = pile(), pile()
    sim.run(30)
    fresh.run(30)
    save(sim, tmp_path / "before.h5")
    real = getattr(sim.contacts, part)

    def broken(*arguments):
        real(*arguments)
        raise MemoryError

    monkeypatch.setattr(sim.contacts, part, broken)
    with pytest.raises(MemoryError):
        sim.rebuild()
    monkeypatch.undo()
    attempts = (sim.prepare, sim.step, sim.rebuild, lambda: save(sim, tmp_path / "after.h5"), lambda: sim.freeze([0]))
    for attempt in attempts:
        with pytest.raises(SceneError, match="restore a checkpoint"):
            attempt()
    restore(sim, tmp_path / "before.h5")
    sim.run(20)
    fresh.run(20)
    assert differences(collect(sim), collect(fresh)) == []


def test_a_step_that_an_error_broke_off_is_not_taken_for_whole(tmp_path):
    """An action raises once: the state is told apart from a sound one, in a checkpoint too, and going on warns."""

    sim = pile()
    sim.actions = [Trip()]
    with pytest.raises(RuntimeError, match="tripped"):
        sim.run(50)
    with pytest.warns(UserWarning, match="step 20 was broken off.*a run from what is saved now"):
        save(sim, tmp_path / "broken.h5")
    assert not read_state(tmp_path / "broken.h5").about["forces_are_current"]
    with pytest.warns(UserWarning, match="step 20 was broken off"):
        sim.run(30)
    assert sim.step_number == 50


@pytest.mark.parametrize("broken", ["by an error", "and its error was never told"])
def test_a_state_that_is_restored_knows_nothing_of_the_step_that_was_broken_off(broken, tmp_path):
    """A run ends in the middle of a step; a checkpoint taken up by the same simulation goes on with the bits that it has."""
    sim, fresh = pile(), pile()
    for one in (sim, fresh):
        one.run(30)
    save(sim, tmp_path / "before.h5")
    if broken == "by an error":
        sim.max_overlap = 1e-9
        with pytest.raises(OverlapError):
            sim.run(20)
        assert sim._in_step
    else:
        sim.faults.found = OverlapError("of a run that Ctrl-C ended")
    sim.max_overlap = fresh.max_overlap
    restore(sim, tmp_path / "before.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.run(20)
    fresh.run(20)
    assert differences(collect(sim), collect(fresh)) == []


def test_what_a_broken_off_rebuild_left_of_the_store_is_not_used_again(tmp_path, monkeypatch):
    """It ended when memory was at one end of the store and its flag said the other."""
    sim, fresh = pile(), pile()
    for one in (sim, fresh):
        one.skin = 0.6
        one.run(30)
    save(sim, tmp_path / "before.h5")

    def broken(contacts):
        raise KeyboardInterrupt

    monkeypatch.setattr(Contacts, "_lay_out", broken)
    with pytest.raises(KeyboardInterrupt):
        sim.rebuild()
    monkeypatch.undo()
    restore(sim, tmp_path / "before.h5")
    sim.run(20)
    fresh.run(20)
    assert differences(collect(sim), collect(fresh)) == []


@pytest.mark.parametrize("ranks", [1, 3])
def test_large_overlaps_are_told_once_by_one_rank(ranks):
    """However often they happen, and on whichever rank; the count goes on."""

    def program():
        sim = simulation(bc.Box((0, 0, 0), (12, 4, 4)), properties=SOFT, dt=1e-4)
        sim.add_grains([(x, 2, 2) for x in (1.0, 1.9, 5.5, 6.4, 10.0, 10.9)], 0.5)
        for _ in range(3):
            sim.run(5)
        return int(sim.comm.sum([sim.faults.large_overlaps])[0])

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert virtual_ranks(ranks, program) == [48] * ranks
    assert len(told) == 1 and "overlap by more than 5 %" in str(told[0].message)
