"""Several processes compute the bits that one computes."""

import re
import warnings

import numpy as np
import pytest
import states
from clouds import cloud
from scenes_mpi import SCENES, avalanche, state_after

import barchan as bc
from barchan.checkpoint import collect, read_state, restore, save
from barchan.compare import differences
from barchan.errors import BarchanError, Interrupted
from barchan.kernels import compiler
from barchan.measure import laguerre_cells
from barchan.packing import Preparation, compact, press
from barchan.parallel import Serial

STEPS = 150


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


@pytest.fixture(scope="module")
def alone():
    """Name of a scene -> its state on one rank and one thread."""
    known = {}

    def of(name):
        if name not in known:
            known[name] = state_after(name, STEPS, threads=1, comm=Serial())
        return known[name]

    return of


def every_rebuild(sim):
    """Shared anew in each of many rebuilds."""
    sim.balance.when = lambda step: True
    sim.staleness.also_when = lambda step: step % 7 == 0


def never(sim):
    sim.balance.when = "never"


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("change", [every_rebuild, never, None], ids=lambda change: change.__name__ if change else "when it pays")
@pytest.mark.parametrize("name", SCENES)
def test_the_same_bits(name, change, threads, comm, alone):
    assert differences(alone(name), state_after(name, STEPS, change, threads=threads)) == []


@pytest.mark.parametrize("threads", [1, 2])
def test_the_avalanche_has_the_same_bits(threads, comm):
    serial = collect(avalanche(comm=Serial()))
    sim = avalanche(threads)
    assert differences(serial, collect(sim)) == []
    assert sim.balance.count >= 1 and comm.sum([sim.grains.n_ghost])[0] > 0


@pytest.mark.parametrize("name", SCENES)
def test_the_scenes_are_worth_it(name, comm):
    """Grains migrate, pairs across ranks touch, and ranks have ghosts: without a clock, so that it is always the same."""
    sim, across, moved = SCENES[name](threads=1), 0, 0
    every_rebuild(sim)
    sim.prepare()
    for _ in range(STEPS // 5):
        before = sim.grains.view("id").copy()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(5)
        pairs = sim.contacts.n_pairs
        across += int(((sim.contacts.slot[:pairs] > 0) & (sim.contacts.second >= sim.grains.n)).sum())
        moved += len(np.setdiff1d(sim.grains.view("id"), before))
    moved, across, ghosts = comm.sum([moved, across, sim.grains.n_ghost]).tolist()
    assert moved >= 2 and across >= 1 and ghosts > 5, (moved, across, ghosts)


@pytest.mark.parametrize("name", SCENES)
def test_steps_in_one_call_are_those_taken_one_by_one(name, comm):
    """Compiled code that calls MPI, and Python that does, for ranks of one thread."""

    def one_by_one(sim):
        sim.clock.by_phase = True

    sims = [SCENES[name](threads=1) for _ in range(2)]
    one_by_one(sims[1])
    for sim in sims:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(STEPS)
    assert differences(*map(collect, sims)) == []
    sim = sims[0]
    waits = callable(sim.gravity) or sim.bonds.active or sim.deformation.acts
    in_one_call = not waits and all(wall.steady_steps(0) for wall in sim.walls)
    assert [sim.clock.seconds.get("steps", 0.0) > 0.0 for sim in sims] == [in_one_call, False]


def test_a_wish_to_stop_on_one_rank_ends_all_in_the_same_step(comm, alone):
    sim = SCENES["gas"](threads=1)
    sim.run(20)
    sim.stop_requested = comm.rank == comm.size - 1
    with pytest.raises(Interrupted):
        sim.run(STEPS)
    assert len(set(comm.all_gather(sim.step_number))) == 1 and 20 < sim.step_number < STEPS
    sim.run(STEPS - sim.step_number)
    assert differences(alone("gas"), collect(sim)) == []


@pytest.mark.parametrize("by_phase", [False, True])
def test_a_fault_on_one_rank_ends_all_in_the_step_in_which_one_rank_ends(by_phase, comm):
    """In compiled steps and in those of Python: the first overlap that is too large, wherever it is."""

    def end(**options):
        sim = SCENES["gas"](threads=1, **options)
        sim.max_overlap, sim.clock.by_phase = 0.01, by_phase
        with warnings.catch_warnings(), pytest.raises(BarchanError) as caught:
            warnings.simplefilter("ignore")
            sim.run(10 * STEPS)
        return sim.step_number, re.search(r"step \d+", str(caught.value))[0]

    expected = end(comm=Serial())
    assert expected[0] > 20
    assert comm.all_gather(end()) == [expected] * comm.size


def test_grains_that_touch_migrate_together_alone_and_back(comm, alone):
    """Two grains that stick out of nothing but their contact cross a border back and forth, rebuilt in every step; so do the
    border and they at once."""

    def pair(comm=None, also=None):
        box = bc.Box((0, 0, 0), (8, 4, 4), (True, True, True))
        soft = bc.Material("m", density=1.0, kn=2e3, kt=6e2, friction=0.4)
        sim = bc.Simulation(box, bc.laws.hertz, soft, dt=2e-3, threads=1, comm=comm)
        sim.add_grains([(3.3, 2, 2), (4.2, 2.1, 2), (0.5, 1, 1), (7.6, 1.1, 1)], 0.5, velocity=[(1.5, 0.4, 0), (1.3, 0, 0)] * 2)
        sim.balance.when, sim.staleness.also_when = "never" if also is None else also, lambda step: True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for turn in range(12):
                sim.run(100)
                sim.grains.velocity = -sim.grains.velocity if turn % 2 else 1.0 * sim.grains.velocity
        return collect(sim), sim.balance.count

    expected = pair(Serial())[0]
    assert len(expected.contacts.keys)
    assert differences(expected, pair()[0]) == []
    state, count = pair(also=lambda step: step % 3 == 0)
    assert differences(expected, state) == [] and count > 100


@pytest.mark.parametrize("kind", ["brick", "periodic"])
def test_a_sample_is_prepared_with_the_same_bits(kind, comm):
    """Pressed by walls, and by grains that grow."""

    def prepared(comm=None):
        sim, how = cloud(kind, comm=comm, threads=1), Preparation(friction=0.1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = press(sim, 20.0, how) if kind == "brick" else compact(sim, 0.64, "growth", how, steps=2000)
            sim.run(50)
        return found, collect(sim)

    (expected, alone), (found, together) = prepared(Serial()), prepared()
    assert found == expected and differences(alone, together) == []


def test_a_checkpoint_is_the_same_file_and_resumes_on_any_number_of_ranks(comm, shared_path):
    def run(sim, steps):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(steps)
        return sim

    law = bc.laws.hertz_standard
    together, alone = run(states.dense(law, threads=1), 60), run(states.dense(law, threads=1, comm=Serial()), 60)
    save(together, shared_path / "together.h5")
    if comm.rank == 0:
        save(alone, shared_path / "alone.h5")
    comm.barrier()
    assert (shared_path / "together.h5").read_bytes() == (shared_path / "alone.h5").read_bytes()
    run(alone, 60)
    resumed = states.empty(law, threads=1)
    restore(resumed, shared_path / "alone.h5")
    assert differences(collect(alone), collect(run(resumed, 60))) == []
    back = states.empty(law, threads=1, comm=Serial())
    restore(back, shared_path / "together.h5")
    assert differences(collect(alone), collect(run(back, 60))) == []
    part = read_state(shared_path / "together.h5", comm)
    assert len(part.fields["id"]) <= -(-len(read_state(shared_path / "together.h5").fields["id"]) // comm.size)


@pytest.mark.parametrize("name", ["gas", "sheared"])
def test_cells_of_grains_have_the_same_bits(name, comm):
    """Of grains that have drifted since the last rebuild, in a box that has tilted."""

    def cells(**options):
        sim = SCENES[name](threads=1, **options)
        sim.run(STEPS)
        found = laguerre_cells(sim)
        areas = np.split(found.area, found.start[1:-1])
        return {int(i): (volume, area.tobytes()) for i, volume, area in zip(found.id, found.volume.tolist(), areas)}

    together = {}
    for part in comm.all_gather(cells()):
        together |= part
    assert together == cells(comm=Serial())
