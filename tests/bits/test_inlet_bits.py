"""Grains that an inlet lets in: the same bits on any number of ranks and threads, and after a resume on another number."""

from math import inf

import pytest
import states

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.packing import Sieves
from barchan.parallel import virtual_ranks

LAW = bc.laws.linear
pytestmark = pytest.mark.filterwarnings("ignore")

SIZES = Sieves([0.3, 0.5, 0.9], [0.0, 0.4, 1.0])


def letting_in(sim):
    """Rain of a few sizes into and above a dense bed, over the periodic faces, more than there is room for; and a jet."""
    fine = bc.Feed(SIZES, rate=30_000.0, total=120.0, by="mass", material="m1", velocity=(1.0, 0.0, -3.0))
    jet = bc.Feed(0.2, rate=inf, total=30, velocity=(0.0, 4.0, 0.0))
    sim.actions = [
        bc.Inlet("rain", ((0.0, 0.0, 3.0), (8.0, 6.0, 11.5)), fine, bc.Every(5), seed=1),
        bc.Inlet("jet", ((0.1, 0.1, 10.0), (0.1, 3.0, 10.0)), jet, bc.Every(7), seed=1),
    ]
    sim.dt = 1e-4
    sim.walls[1].point = (0.0, 0.0, 11.9)
    return sim


def begin():
    return letting_in(states.dense(LAW))


def program(path=None):
    sim = begin()
    sim.run(33)
    if path:
        save(sim, path)
    sim.run(30)
    return collect(sim), sim.notes


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    path = tmp_path_factory.mktemp("inlet") / "c.h5"
    return *program(path), path


def test_the_scene_asks_for_more_than_there_is_room_for(alone):
    _, notes, _ = alone
    rain, jet = (notes["inlets"][name] for name in ("rain", "jet"))
    assert rain["grains"] > 100 and rain["owed"] > 0.0 and rain["waiting"] and jet["waiting"] and jet["grains"] > 2


@pytest.mark.parametrize("ranks", [2, 4])
def test_inlets_on_several_ranks(ranks, alone):
    for state, notes in virtual_ranks(ranks, program):
        assert notes == alone[1]
        assert differences(alone[0], state) == []


@pytest.mark.parametrize("ranks", [1, 3])
def test_inlets_after_a_resume(ranks, alone):
    def resumed():
        sim = letting_in(states.empty(LAW))
        restore(sim, alone[2])
        sim.run(30)
        return collect(sim), sim.notes

    for state, notes in virtual_ranks(ranks, resumed):
        assert notes == alone[1] and differences(alone[0], state) == []


def test_new_grains_are_on_several_ranks():
    """Else the tests above would compare one rank with itself."""

    def own():
        sim = begin()
        sim.run(33)
        return (sim.grains.view("id") >= 600).any()

    assert sum(virtual_ranks(4, own)) >= 2
