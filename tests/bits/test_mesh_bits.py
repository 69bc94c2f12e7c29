"""Meshes: the same bits on any number of threads and ranks, at any time of rebuilds, across periodic faces and after a stop."""

import warnings
from functools import lru_cache

import meshes
import numpy as np
import pytest

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError
from barchan.kernels import compiler
from barchan.parallel import virtual_ranks

STEPS = 1000


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def scene(with_grains=True, threads=1, hills=0.3):
    """Grains of two sizes on a hilly floor that fits the periods, around a block with edges and a drum that turns."""
    sand = bc.Material("sand", density=1.0, kn=4e3, kt=1e3, gamma_n=20.0, gamma_t=5.0, friction=0.5)
    box = bc.Box((0, 0, 0), (6, 6, 6), (True, True, False))
    sim = bc.Simulation(box, bc.laws.linear, sand, 4e-4, (4.0, 1.0, -25.0), threads=threads)
    line = np.linspace(0.0, 6.0, 13)
    x, y = np.meshgrid(line, line, indexing="ij")
    height = 1.0 + hills * np.sin(2 * np.pi * x / 6.0) * np.cos(2 * np.pi * y / 6.0)
    sim.add_wall(bc.Mesh(*meshes.sheet(np.stack([x, y, height], axis=-1))))
    sim.add_wall(bc.Mesh(*meshes.box((4.9, 2.1, 1.2), (6.2, 3.4, 2.2)), velocity=(0.3, 0.0, 0.0)))
    sim.add_wall(bc.Mesh(meshes.ball(0.7, 1)[0] + (5.5, 5.5, 2.0), meshes.ball(0.7, 1)[1], omega=(1.0, 2.0, 0.5)))
    rng = np.random.default_rng(8)
    places = np.stack(np.meshgrid(np.arange(8), np.arange(8), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 3)
    places = 0.75 * places + (0.3, 0.3, 1.65) + rng.uniform(-0.03, 0.03, places.shape)
    radius = rng.choice([0.2, 0.34], len(places))
    if with_grains:
        free = (sim.walls[0].distance(places) > radius) & (sim.walls[1].distance(places) > radius)
        free &= sim.walls[2].distance(places) > radius
        sim.add_grains(places[free], radius[free], velocity=rng.normal(size=(free.sum(), 3)))
    return sim


def quietly(sim, steps):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(steps)
    return sim


def final_state(threads=1, rebuilds=None):
    sim = scene(threads=threads)
    sim.staleness.also_when = rebuilds
    quietly(sim, STEPS)
    return collect(sim), [(*wall.force, *wall.torque, wall.contacts) for wall in sim.walls]


@lru_cache
def plain():
    return final_state()


def test_the_scene_has_what_it_is_for():
    """All meshes are touched by many, patches of one mesh by one grain, and memory goes from patch to patch."""
    state, loads = plain()
    keys = state.contacts.keys[state.contacts.keys < 0]
    assert len(np.unique(keys)) > 8 and min(load[-1] for load in loads) > 1


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
        save(quietly(scene(), 577), tmp_path / "stop.h5")
        again = scene(with_grains=False)
        restore(again, tmp_path / "stop.h5")
        return collect(quietly(again, STEPS - 577))

    assert differences(plain()[0], virtual_ranks(ranks, program)[-1]) == []


def test_another_mesh_is_refused(tmp_path):
    save(quietly(scene(), 3), tmp_path / "stop.h5")
    with pytest.raises(CheckpointError, match=r"wall 0 is .*'mesh'"):
        restore(scene(with_grains=False, hills=0.2), tmp_path / "stop.h5")
