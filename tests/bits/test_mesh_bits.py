"""Meshes: the same bits in steps of Python and in compiled ones, on any number of threads and ranks, at any time of rebuilds,
across periodic faces and after a stop."""

import warnings
from functools import lru_cache

import numpy as np
import pytest
from meshed import PRESSED, meshed

from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError
from barchan.kernels import compiler
from barchan.parallel import virtual_ranks

STEPS = 1000


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def quietly(sim, steps):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(steps)
    return sim


def final_state(threads=1, rebuilds=None):
    sim = meshed(threads=threads)
    sim.staleness.also_when = rebuilds
    quietly(sim, STEPS)
    return collect(sim), [(*wall.force, *wall.torque, wall.contacts) for wall in sim.walls]


@lru_cache
def plain():
    return final_state()


def test_steps_are_made_many_at_a_time_until_a_control_begins(monkeypatch):
    """Those of the other tests are not: on several threads or virtual ranks, and when lists are made at given steps."""
    sim, by_python, touched = meshed(threads=1), [], np.zeros(4, dtype=bool)
    step = sim.step
    monkeypatch.setattr(sim, "step", lambda begun=None: by_python.append(begun is None) or step(begun))
    for _ in range(10):
        quietly(sim, PRESSED // 10)
        touched |= [wall.contacts > 0 for wall in sim.walls]
    assert not any(by_python) and touched[:3].all(), "and the mesh at rest, that moves, and that turns are touched"


def test_the_scene_has_what_it_is_for():
    """All meshes are touched by many, patches of one mesh by one grain, and memory goes from patch to patch."""
    state, loads = plain()
    keys = state.contacts.keys[state.contacts.keys < 0]
    assert len(np.unique(keys)) > 8 and min(load[-1] for load in loads[:3]) > 1 and loads[3][-1] > 0


@pytest.mark.parametrize(("threads", "ranks"), [(2, 1), (1, 2), (2, 3)], ids=str)
def test_threads_and_ranks_change_no_bit(threads, ranks):
    state, loads = virtual_ranks(ranks, final_state, threads)[-1]
    assert differences(plain()[0], state) == [] and loads == plain()[1]


@pytest.mark.parametrize("often", [lambda step: True, lambda step: step % 7 == 3])
def test_when_lists_are_made_changes_no_bit(often):
    state, loads = final_state(rebuilds=often)
    assert differences(plain()[0], state) == [] and loads == plain()[1]


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_stop_changes_no_bit(ranks, tmp_path):
    def program():
        save(quietly(meshed(), 577), tmp_path / "stop.h5")
        again = meshed(with_grains=False)
        restore(again, tmp_path / "stop.h5")
        return collect(quietly(again, STEPS - 577))

    assert differences(plain()[0], virtual_ranks(ranks, program)[-1]) == []


def test_another_mesh_is_refused(tmp_path):
    save(quietly(meshed(), 3), tmp_path / "stop.h5")
    with pytest.raises(CheckpointError, match=r"wall 0 is .*'mesh'"):
        restore(meshed(with_grains=False, hills=0.2), tmp_path / "stop.h5")
