"""Two dimensions: the same bits on any number of threads and ranks and after a stop, and not a bit out of the plane."""

import warnings
from functools import lru_cache

import numpy as np
import pytest
import states

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.kernels import compiler
from barchan.parallel import virtual_ranks

STEPS = 200


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def final_state(shape="disc", threads=1):
    sim = states.flow(shape, threads=threads)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(STEPS)
    return collect(sim)


@lru_cache
def plain(shape="disc"):
    return final_state(shape)


@pytest.mark.parametrize("shape", ["disc", "sphere"])
def test_no_bit_leaves_the_plane(shape):
    """Grains slide, roll and collide; all numbers across the plane are zeros, without anything that makes them so."""
    fields, contacts = plain(shape).fields, plain(shape).contacts
    assert np.abs(fields["omega"][:, 2]).max() > 1.0 and np.abs(fields["torque"][:, 2]).max() > 0.0 and len(contacts.keys) > 50
    for name, across in (("position", [2]), ("velocity", [2]), ("force", [2]), ("omega", [0, 1]), ("torque", [0, 1])):
        assert not fields[name][:, across].any(), name
    assert contacts.values.any() and not contacts.values[:, 2].any(), "slips lie in the plane"


def test_no_bit_leaves_the_plane_in_a_drum():
    """A cylinder turns about its axis, which is told the other way round, and a plane turns about a point of its own."""
    grain = bc.Material("grain", density=1.0, kn=4e3, kt=1e3, gamma_n=200.0, gamma_t=50.0, friction=0.5)
    sim = bc.Simulation(bc.Box((-4, -4), (4, 4)), bc.laws.linear, grain, 4e-4, (0.0, -5.0, 0.0), threads=1)
    sim.add_wall(bc.Cylinder((0.1, 0.2, 0), (0, 0, -3), 3.0, omega=(0, 0, 0.5)))
    sim.add_wall(bc.Plane((0.3, -1, 0), (-0.3, 1, 0), omega=(0, 0, 0.2)))
    place = np.array([(0.4 * x, 0.4 * y - 0.6, 0.0) for x in range(-4, 5) for y in range(5)])
    place = place[sim.walls[1].distance(place) > 0.2]
    sim.add_grains(place[np.hypot(*place[:, :2].T) < 2.5], 0.2)
    sim.run(3000)
    assert min(wall.contacts for wall in sim.walls) > 1 and np.abs(sim.grains.omega[:, 2]).min() > 0.0
    for wall in sim.walls:
        assert wall.force[2] == 0.0 and not wall.torque[:2].any()
    assert not sim.grains.position[:, 2].any() and not sim.grains.velocity[:, 2].any() and not sim.grains.omega[:, :2].any()


@pytest.mark.parametrize(("threads", "ranks"), [(2, 1), (1, 2), (2, 2), (1, 3)], ids=str)
def test_threads_and_ranks_change_no_bit(threads, ranks):
    assert differences(plain(), virtual_ranks(ranks, final_state, "disc", threads)[-1]) == []


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_a_stop_changes_no_bit(ranks, tmp_path):
    def program():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = states.flow(threads=1)
            sim.run(77)
            save(sim, tmp_path / "stop.h5")
            again = states.flow(with_grains=False, threads=1)
            restore(again, tmp_path / "stop.h5")
            again.run(STEPS - 77)
        return collect(again)

    assert differences(plain(), virtual_ranks(ranks, program)[-1]) == []


def test_many_steps_in_one_call_are_those_made_singly():
    """Constant gravity, one thread: compiled code makes them; the list is made anew on the way."""

    def program(singly):
        sim = states.flow(threads=1)
        sim.gravity = (2.0, -20.0, 0.0)
        if singly:
            sim.clock.by_phase = True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(STEPS)
        return collect(sim), sim.clock.seconds.get("steps", 0.0) > 0.0

    (leapt, in_one_call), (single, not_singly) = program(singly=False), program(singly=True)
    assert in_one_call and not not_singly and differences(leapt, single) == []
    assert not leapt.fields["position"][:, 2].any() and not leapt.fields["omega"][:, :2].any()
