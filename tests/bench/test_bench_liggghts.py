"""LIGGGHTS beside barchan: grain by grain, in a whole benchmark, and when it fails."""

import shutil

import numpy as np
import pytest
from test_bench_lammps import bed, found, rows_of, short

from barchan.bench import cases
from barchan.bench.case import Constants, Grains
from barchan.bench.observed import count_contacts, kinetic_energy
from barchan.bench.peers import liggghts
from barchan.bench.peers.barchan import Engine as Ours

pytestmark = pytest.mark.skipif(shutil.which("liggghts") is None, reason="LIGGGHTS is not installed (apt install liggghts)")


@pytest.fixture
def theirs(tmp_path):
    engine = liggghts.Engine(1, tmp_path)
    yield engine
    if engine.process is not None:
        engine.process.communicate()


def after(engine, case, steps):
    engine.set_up(case, 0.1)
    engine.run(steps, False)
    return engine.observe()


def way(case, a, b):
    """Largest distance from one place of a grain to the other; a period is none."""
    length = np.subtract(case.high, case.low)
    away = a["position"] - b["position"]
    return np.abs(away - np.where(case.periodic, length * np.round(away / length), 0.0)).max()


def few(law, gamma_n):
    """Five grains in three collisions: with the floor, with a frozen grain, and through a periodic face. None slides."""
    radius = np.array([0.5, 0.45, 0.5, 0.5, 0.45])
    position = np.array([[2, 2, 0.501], [4, 4, 3], [4.951, 4, 3], [9.9, 8, 5], [0.851, 8, 5]])
    velocity = np.array([[0.3, 0, -1], [1, 0.2, 0], [0, 0, 0], [0, 0, 0], [-1, 0, 0.3]])
    frozen = np.arange(5) == 2
    grains = Grains(position, radius, 2.0 + frozen, velocity, np.zeros((5, 3)), frozen)
    constants = Constants(kn=2000.0, kt=600.0, gamma_n=gamma_n, gamma_t=0.0, friction=10.0)
    box = dict(low=(0, 0, -1), high=(10, 10, 20), floor=0.0, gravity=(1.0, 0.0, -2.0))
    return cases.small(None)._replace(grains=grains, law=law, constants=constants, **box)


def check_collisions(case, ours, theirs, turned=0.05):
    """Normal to the contacts all is the same, speeds being about 1; along them, but for the overlap that a code may have in its
    lever arm, or what else ``turned`` allows."""
    across = [0, 1, 3, 4], [2, 0, 0, 0]
    assert theirs["velocity"][across] == pytest.approx(ours["velocity"][across], abs=1e-3)
    turning = np.abs(ours["omega"]) > 0.01
    assert turning.sum() >= 4 and theirs["omega"][turning] == pytest.approx(ours["omega"][turning], rel=turned)
    assert way(case, ours, theirs) < 0.01 * way(case, ours, {"position": case.grains.position})
    assert np.array_equal(theirs["position"][2], case.grains.position[2])


@pytest.mark.parametrize("law", ["hooke", "hertz"])
def test_collisions_are_the_same(theirs, law):
    case = few(law, gamma_n=20.0)
    check_collisions(case, after(Ours(1, None), case, 50), after(theirs, case, 50))


@pytest.mark.parametrize(
    ("make", "closeness", "energy"),
    [(cases.small, 2e-3, 5e-4), (bed, 4e-3, 5e-4), (lambda journal: cases.gas(journal, count=2000), 5e-4, 1e-4)],
    ids=["small", "bed", "gas"],
)
def test_grains_go_the_same_way(theirs, make, closeness, energy):
    """After 50 steps: distance relative to the way of the fastest grain; what is left is the lever arm and the damping."""
    case = make(None)
    ours, seen = after(Ours(1, None), case, 50), after(theirs, case, 50)
    assert way(case, ours, seen) < closeness * way(case, ours, {"position": case.grains.position})
    assert kinetic_energy(case, seen) == pytest.approx(kinetic_energy(case, ours), rel=energy)
    assert count_contacts(case, seen) == count_contacts(case, ours) > 0
    assert not seen["velocity"][case.grains.frozen].any()


def test_it_does_the_same_work_and_a_rebuild_is_forced(tmp_path):
    row = rows_of(short(bed(None)), ("barchan-1", "liggghts"))["liggghts"]
    assert row["same_work"] and row["rebuilds"] >= 5 and not row["same_law"] and row["memory_per_grain"] is not None, row
    assert row["version"].startswith("LIGGGHTS-PUBLIC 3")
    case = bed(None)._replace(steps=5, scan_steps=5, rounds=2, skins=(0.1,), forced=True)
    assert rows_of(case, ("barchan-1", "liggghts"))["liggghts"]["rebuilds"] == 5


def test_what_it_refuses_is_said(theirs):
    case = cases.small(None)
    with pytest.raises(RuntimeError, match=r"(?s)LIGGGHTS ended.*ERROR"):
        theirs.set_up(case._replace(law="jkr"), 0.1)


def test_there_is_one_row():
    assert [(peer.missing, peer.same_law) for peer in found("liggghts")] == [(None, False)]
