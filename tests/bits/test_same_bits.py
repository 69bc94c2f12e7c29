"""The state has the same bits for every number of threads and ranks, every moment of rebuild, and after stop and resume."""

import warnings

import numpy as np
import pytest
import states

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.kernels import cells, compiler
from barchan.measure import contact_table
from barchan.parallel import virtual_ranks

STEPS = 120
#: Those of every commit: one of each kind of memory and of scheme. The others at full size.
ALWAYS = ("silbert", "hertz_mindlin", "hertz_mindlin_rolling", "jkr", "hertz_standard")
LAWS = [
    pytest.param(law, id=name, marks=[] if name in ALWAYS else [pytest.mark.validate]) for name, law in bc.laws.SHIPPED.items()
]


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    """Two threads share even these 600 grains, or the tests of threads would test nothing."""
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def at_random(seed):
    """A rebuild in about every fourth step, at moments that depend on ``seed``."""
    draws = np.random.default_rng(seed).random(10000) < 0.25
    return lambda step: bool(draws[step])


def final_state(law, threads=1, also_when=None, skin=None, steps=STEPS):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = states.dense(law, threads=threads)
        sim.staleness.also_when, sim.skin = also_when, skin
        sim.run(steps)
    return collect(sim)


@pytest.fixture(scope="module")
def plain():
    """Law -> its final state on one thread and one rank with the default skin."""
    known = {}

    def of(law):
        if law.name not in known:
            known[law.name] = final_state(law)
        return known[law.name]

    return of


def assert_same(first, second):
    assert differences(first, second) == []


@pytest.mark.parametrize("ranks", [1, 3])
def test_contacts_are_found_again_beyond_a_skin_that_is_thinner_than_their_reach(ranks, plain):
    """Held grains are up to four skins apart when the list is made: they must be in it, and among the ghosts."""
    found = virtual_ranks(ranks, final_state, bc.laws.jkr, 1, None, 0.005)
    assert_same(plain(bc.laws.jkr), found[-1])


@pytest.mark.parametrize("law", LAWS)
class TestSameBits:
    def test_the_state_is_worth_testing(self, law):
        """Coordination above 3, and contacts form, break and slide: otherwise equal bits would be no surprise."""
        sim = states.dense(law)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.prepare()
            before = contact_table(sim)
            sim.run(STEPS)
        after = contact_table(sim)
        pairs = [set(zip(t["first"].tolist(), t["second"].tolist())) for t in (before, after)]
        assert 2 * len(pairs[1]) / sim.grains.n > 3
        assert len(pairs[0] - pairs[1]) > 20 and len(pairs[1] - pairs[0]) > 20
        assert any(second < 0 for _, second in pairs[1]), "some grains touch a wall"
        held = int((after["overlap"] < 0.0).sum())
        assert held > 20 if law.reach else held == 0, "contacts outlast touching if they may"

    @pytest.mark.parametrize("variant", ["every step", "at random", "wide skin"])
    def test_moment_of_rebuild(self, law, variant, plain):
        options = {
            "every step": {"also_when": lambda step: True},
            "at random": {"also_when": at_random(3)},
            "wide skin": {"skin": 0.9},
        }
        assert_same(plain(law), final_state(law, **options[variant]))

    def test_two_threads(self, law, plain):
        assert_same(plain(law), final_state(law, threads=2))

    @pytest.mark.parametrize("ranks", [2, 4])
    def test_virtual_ranks(self, law, ranks, plain):
        results = virtual_ranks(ranks, final_state, law)
        assert_same(plain(law), results[0])

    def test_ranks_threads_and_rebuilds_together(self, law, plain):
        results = virtual_ranks(3, final_state, law, 2, at_random(5), 0.3)
        assert_same(plain(law), results[2])

    def test_run_in_two_parts(self, law, plain):
        sim = states.dense(law)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(STEPS // 3)
            assert sim.grains.position.shape == (sim.grains.n, 3), "looking must not change a bit"
            sim.run(STEPS - STEPS // 3)
        assert_same(plain(law), collect(sim))

    @pytest.mark.parametrize("skin", [0.02, None], ids=["many rebuilds", "few rebuilds"])
    def test_many_steps_in_one_call(self, law, skin, tmp_path):
        """As they are made for few grains under constant gravity, on one thread and one rank: the same bits as one by one, after
        a stop, on two threads and on three ranks."""

        def falling(threads=1, sim=None):
            sim = sim or states.dense(law, threads=threads)
            sim.gravity, sim.skin = (3.0, 0.3, -1.0), skin
            return sim

        def on_ranks():
            sim = falling()
            sim.run(STEPS)
            return collect(sim)

        at_once, singly, two_threads = falling(), falling(), falling(threads=2)
        resumed = falling(sim=states.empty(law, threads=1))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            at_once.run(STEPS // 2)
            save(at_once, tmp_path / "middle.h5")
            at_once.run(STEPS - STEPS // 2)
            for _ in range(STEPS):
                singly.run(1)
            restore(resumed, tmp_path / "middle.h5")
            resumed.run(STEPS - STEPS // 2)
            two_threads.run(STEPS)
            ranks = virtual_ranks(3, on_ranks)
        made_at_once = ["steps" in sim.clock.seconds for sim in (at_once, resumed, singly, two_threads)]
        assert made_at_once == [True, True, False, False]
        assert at_once.staleness.rebuilds == singly.staleness.rebuilds > 0
        for other in (collect(singly), collect(resumed), collect(two_threads), ranks[0]):
            assert_same(collect(at_once), other)

    @pytest.mark.parametrize("ranks", [(1, 1), (1, 4), (3, 1), (2, 3)], ids=lambda r: f"{r[0]}-then-{r[1]}-ranks")
    def test_stop_and_resume(self, law, ranks, plain, tmp_path):
        """Also on another number of ranks than before."""
        middle = tmp_path / "middle.h5"

        def first_half():
            sim = states.dense(law)
            sim.run(STEPS // 2)
            save(sim, middle)

        def second_half():
            sim = states.empty(law)
            restore(sim, middle)
            sim.run(STEPS - STEPS // 2)
            return collect(sim)

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            virtual_ranks(ranks[0], first_half)
            results = virtual_ranks(ranks[1], second_half)
        assert_same(plain(law), results[0])


@pytest.mark.parametrize("steps", [6, 7], ids=["even", "odd"])
def test_ctrl_c_while_many_steps_are_made_in_one_call(steps, monkeypatch):
    """It is raised as soon as the compiled code returns: what was done is known, and the run goes on with the same bits."""
    whole, stopped = (states.dense(bc.laws.SHIPPED["hertz"], threads=1) for _ in range(2))
    for sim in (whole, stopped):
        sim.gravity = (3.0, 0.3, -1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole.run(40)
        stopped.prepare()
        right = stopped.loops

        def interrupted(most, *arguments):
            right.advance(steps, *arguments)
            raise KeyboardInterrupt

        monkeypatch.setattr(stopped, "loops", right._replace(advance=interrupted))
        with pytest.raises(KeyboardInterrupt):
            stopped.run(40)
        monkeypatch.setattr(stopped, "loops", right)
        assert stopped.step_number == steps
        stopped.run(40 - steps)
    assert_same(collect(whole), collect(stopped))


def test_strips_of_cells(monkeypatch):
    """The order of rows in a box so wide that it has several strips, here of 4 lines, on threads and ranks."""
    law = bc.laws.SHIPPED["hertz"]

    def run(threads=1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = states.dense(law, threads=threads)
            sim.run(STEPS)
        return collect(sim)

    one_strip = run()
    monkeypatch.setattr(cells, "LAYER", 1.0)
    for other in (run(), run(threads=2), virtual_ranks(3, run)[0]):
        assert_same(one_strip, other)


def test_damped_grains(tmp_path):
    """Damping in steps of Python and in many at once, on threads and ranks, and after a stop."""
    law = bc.laws.hertz_mindlin_rolling

    def run(gravity, threads=1, stop=None):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = states.dense(law, threads=threads)
            sim.gravity, sim.damping = gravity, bc.Damping(local=0.2, viscous=3.0)
            sim.run(STEPS // 2)
            if stop is not None:
                save(sim, stop)
                sim = states.empty(law, threads=threads)
                sim.gravity = gravity
                restore(sim, stop)
            sim.run(STEPS // 2)
        return collect(sim)

    steady, singly = states.GRAVITY["steady"], lambda time: states.GRAVITY["steady"]
    plain = run(steady)
    assert differences(plain, run(steady, stop=tmp_path / "c.h5")) == []
    assert differences(plain, run(steady, threads=2)) == [], "steps of Python"
    one_by_one = run(singly)
    for name, values in plain.fields.items():
        np.testing.assert_array_equal(values, one_by_one.fields[name])
    for ranks in (2, 3):
        assert_same(plain, virtual_ranks(ranks, run, steady)[0])


def test_rebuilds_before_the_first_step_after_resume(tmp_path):
    """A restored list knows its memory before any force was computed with it."""
    law = bc.laws.SHIPPED["hertz"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole, resumed = states.dense(law), states.empty(law)
        whole.run(20)
        save(whole, tmp_path / "c.h5")
        restore(resumed, tmp_path / "c.h5")
        resumed.prepare()
        resumed.rebuild()
        resumed.rebuild()
        for sim in (whole, resumed):
            sim.run(20)
    assert_same(collect(whole), collect(resumed))


def test_changes_between_runs_on_ranks_and_after_resume(tmp_path):
    """Adding, removing, freezing and writing into fields between runs: the same on 1 and 3 ranks, saved in between or not."""
    law = bc.laws.hertz_mindlin

    def story(save_to):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = states.dense(law)
            sim.run(30)
            newcomers = np.array([(1.0, 1.0, 3.0), (5.0, 4.0, 4.0)])
            away = [sim.box.difference(sim.grains.position, point) for point in newcomers]
            sim.remove(sim.grains.id[np.min([(d**2).sum(axis=1) for d in away], axis=0) < 0.9])
            sim.add_grains(newcomers, 0.5, "m1", velocity=(0.0, 0.0, -3.0))
            sim.freeze(np.arange(300, 320))
            sim.grains.velocity[sim.grains.id == 250] = (0.1, -0.2, 0.3)
            if save_to is not None:
                save(sim, save_to)
                sim = states.empty(law)
                restore(sim, save_to)
            sim.run(40)
            sim.release(np.arange(300, 310))
            sim.grains.position[:, 2] += 0.01
            sim.run(40)
            return collect(sim)

    straight = story(None)
    assert_same(straight, story(tmp_path / "one.h5"))
    assert_same(straight, virtual_ranks(3, story, None)[1])
    assert_same(straight, virtual_ranks(2, story, tmp_path / "two.h5")[0])
