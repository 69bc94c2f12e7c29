"""Looking, changing and saving, between runs and from actions and writers: the same bits however the run is cut."""

import warnings

import numpy as np
import pytest
import states

import barchan as bc
from barchan import stepping
from barchan.checkpoint import Checkpoints, all_checkpoints, collect, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError, RankError, SceneError
from barchan.parallel import virtual_ranks

LAW = bc.laws.linear


class Doing:
    """An action or writer that calls a function at some steps."""

    def __init__(self, steps, function):
        self.due, self.function = bc.At(*steps), function

    def apply(self, sim):
        self.function(sim)

    write = apply


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def halve(sim):
    sim.grains.velocity[:] *= 0.5


def shift(sim):
    sim.grains.position[:, 0] += 0.3


def stiffen(sim):
    sim.materials.set_pair("m0", "m1", kn=3e4)


@pytest.mark.parametrize("change", [halve, shift, stiffen], ids=lambda f: f.__name__)
def test_what_was_changed_before_saving_is_honoured_after_resume(change, tmp_path):
    straight = states.dense(LAW)
    straight.run(20)
    change(straight)
    save(straight, tmp_path / "c.h5")
    straight.run(20)
    resumed = states.empty(LAW)
    if change is stiffen:
        stiffen(resumed)
    restore(resumed, tmp_path / "c.h5")
    resumed.run(20)
    assert differences(collect(straight), collect(resumed)) == []


def act(sim):
    """Removes two grains, adds one, slows one down, makes one heavier."""
    sim.remove([400, 401])
    sim.add_grains([(4.0, 3.0, 7.0)], 0.4, "m0")
    sim.grains.velocity[sim.grains.id == 300] = (0.1, 0.2, 0.3)
    sim.grains.mass[sim.grains.id == 301] *= 2.0


def cut(*parts, ranks=1):
    def program():
        sim = states.dense(LAW)
        sim.max_overlap = np.inf  # wherever the new grain lands
        sim.actions.append(Doing((15,), act))
        sim.writers.append(Doing((10, 30), lambda s: s.grains.position.sum()))
        for steps in parts:
            sim.run(steps)
        return collect(sim)

    return virtual_ranks(ranks, program)[0]


@pytest.mark.parametrize("how", [((20, 20), 1), ((14, 1, 25), 1), ((40,), 3), ((10, 30), 2)], ids=str)
def test_actions_and_looking_writers_give_the_same_bits_however_the_run_is_cut(how):
    parts, ranks = how
    assert differences(cut(40), cut(*parts, ranks=ranks)) == []


class Odd(bc.Every):
    """A user's trigger, made from ours."""

    def __call__(self, step):
        return step % 7 == 3


@pytest.mark.parametrize(
    ("triggers", "leaps"),
    [([bc.Every(13, start=2), bc.At(50)], True), ([Odd(5)], False), ([lambda step: step in (20, 41)], False)],
    ids=["ours", "made from ours", "a function"],
)
def test_many_steps_in_one_call_leave_out_no_action(triggers, leaps, monkeypatch):
    """Gravity that an action sets counts from the next run on, in one call or step by step."""

    def final():
        sim = states.dense(LAW, threads=1)
        sim.gravity = (3.0, 0.3, -1.0)
        for due in triggers:
            action = Doing((), lambda s: (halve(s), setattr(s, "gravity", (0.0, 0.0, -2.0))))
            action.due = due
            sim.actions.append(action)
        sim.run(40)
        sim.run(30)
        return sim

    at_once = final()
    monkeypatch.setattr(stepping, "steps_ahead", lambda sim, end: 0)
    singly = final()
    assert ("steps" in at_once.clock.seconds, "steps" in singly.clock.seconds) == (leaps, False)
    assert differences(collect(at_once), collect(singly)) == []


def test_a_writer_sees_the_state_of_its_step():
    """Not a view kept from an earlier step: on ranks the number of grains changes."""

    def program():
        seen = []
        sim = states.dense(LAW)
        sim.writers.append(Doing(range(200), lambda s: seen.append(len(s.grains.position) == s.grains.n)))
        sim.run(150)
        return all(seen)

    assert all(virtual_ranks(3, program))


def test_a_writer_must_not_change_the_state():
    sim = states.dense(LAW)
    sim.writers.append(Doing((3,), halve))
    with pytest.raises(SceneError, match="writer changed velocity"):
        sim.run(5)


def test_what_an_action_adds_is_checked():
    sim = states.dense(LAW)
    sim.actions.append(Doing((3,), lambda s: s.add_grains([(4.0, 3.0, 10.0)], -2.0, "m0", mass=1.0)))
    with pytest.raises(SceneError, match="radius = -2"):
        sim.run(5)


def test_a_directory_with_later_steps_of_another_run_is_refused(tmp_path):
    """Else the new checkpoints would be pruned as the oldest, and a resume would load the other run."""
    first, second = states.dense(LAW), states.dense(LAW)
    first.writers.append(Checkpoints(tmp_path, bc.Every(10)))
    first.run(30)
    kept = all_checkpoints(tmp_path)
    second.writers.append(Checkpoints(tmp_path, bc.Every(10)))
    with pytest.raises(CheckpointError, match="another run"):
        second.run(10)
    assert all_checkpoints(tmp_path) == kept


def test_damaged_later_checkpoints_are_put_aside(tmp_path):
    (tmp_path / "checkpoint_000000000700.h5").write_bytes(b"cut")
    sim = states.dense(LAW)
    sim.writers.append(Checkpoints(tmp_path, bc.Every(10)))
    sim.run(30)
    assert [p.name for p in all_checkpoints(tmp_path)] == ["checkpoint_000000000020.h5", "checkpoint_000000000030.h5"]
    assert (tmp_path / "checkpoint_000000000700.damaged").exists()


def test_an_error_on_one_rank_ends_all(tmp_path):
    """With the rank's own error there and a message that quotes it elsewhere."""

    def program():
        sim = states.dense(LAW)
        sim.run(2)
        if sim.comm.rank == 1:
            sim.grains.velocity[0] = np.nan
        try:
            sim.run(2)
        except SceneError as error:
            return "own", str(error)
        except RankError as error:
            return "quoted", str(error)

    results = virtual_ranks(3, program)
    assert [kind for kind, _ in results] == ["quoted", "own", "quoted"]
    assert "velocity" in results[0][1] and "rank 1" in results[0][1]
