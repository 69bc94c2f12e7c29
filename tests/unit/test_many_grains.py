"""Grains that are made where they belong, and the studies that need many of them."""

import json
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import barchan as bc
from barchan.bench import states
from barchan.bench.bed import Bed, simulation
from barchan.bench.cases import dense_flow, settled_flow
from barchan.errors import SceneError
from barchan.experiments.avalanche import Avalanche, build
from barchan.experiments.avalanche.setup import _radii
from barchan.packing.lattice import lattice, lattice_within
from barchan.parallel import Serial, virtual_ranks, world
from barchan.parallel.guard import on_first_rank
from barchan.report import Journal

ROOT = Path(__file__).parents[2]
MPIEXEC = Path(sys.executable).with_name("mpiexec")


def on_ranks(ranks, *command, limit=300):
    """What a program on several ranks prints."""
    command = [str(MPIEXEC), "-n", str(ranks), sys.executable, *map(str, command)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=limit, env=os.environ)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("kind", ["sc", "bcc", "fcc"])
def test_parts_of_a_lattice_make_up_the_whole(kind, axis):
    low, cells, edge = (0.3, -1.0, 2.0), (5, 4, 3), 0.7
    whole, seen = lattice(kind, edge, low, cells), set()
    for a, b in pairwise(low[axis] + np.linspace(-0.3, 3.7, 6)):
        space = np.full(3, -9.0), np.full(3, 9.0)
        space[0][axis], space[1][axis] = a, b
        numbers, points = lattice_within(kind, edge, low, cells, space)
        assert (np.diff(numbers) > 0).all() and np.array_equal(points, whole[numbers])
        inside = np.flatnonzero((whole[:, axis] >= a) & (whole[:, axis] < b))
        assert np.isin(inside, numbers).all() and len(numbers) < len(whole)
        seen |= set(numbers.tolist())
    assert sorted(seen) == list(range(len(whole)))


def test_radii_are_those_of_one_row_of_random_numbers():
    """Whichever grains a rank asks for."""
    scene = Avalanche.make({"seed": 7})
    count = 30_000
    uniform = np.random.Generator(np.random.Philox(key=7, counter=0)).random(count)
    small, large = scene.simulated.radius_min, scene.simulated.radius_max
    for numbers in (np.arange(count), np.array([0, 5, 4095, 4096, 29_999]), np.arange(8190, 8200), np.zeros(0, dtype=np.int64)):
        assert np.array_equal(_radii(scene, numbers), small + (large - small) * uniform[numbers])


def of_avalanche():
    """Ids, places and radii of this rank's grains of an avalanche at its start."""
    sim = build(Avalanche.make({}).with_grains(900), threads=1)
    return tuple(sim.grains.view(name).copy() for name in ("id", "position", "radius", "part"))


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_an_avalanche_made_by_several_ranks_is_that_made_by_one(ranks):
    alone, parts = of_avalanche(), virtual_ranks(ranks, of_avalanche)
    assert all(len(part[0]) for part in parts)
    for one, several in zip(alone, zip(*parts)):
        together = np.concatenate(several)[np.argsort(np.concatenate([part[0] for part in parts]))]
        assert np.array_equal(one[np.argsort(alone[0])], together)


def sparse():
    sand = bc.Material("sand", density=1.0, kn=1.0, kt=1.0, friction=0.5)
    return bc.Simulation(bc.Box((0, 0, 0), (8, 8, 8)), bc.laws.linear, sand, dt=1e-3)


POINTS = np.array([(1.0, 4.0, 4.0), (3.0, 4.0, 4.0), (7.0, 4.0, 4.0)])


@pytest.mark.parametrize("numbers", [[0, 1], [0, 1, 3], [0, 2, 1], [0, 1, 1], [0.0, 1.0, 2.0], [-1, 0, 1]])
def test_numbers_that_cannot_be_are_refused(numbers):
    with pytest.raises(SceneError, match=r"add_part: numbers = .* must be 3 ascending whole numbers from 0 to 2"):
        sparse().add_part(numbers, 3, POINTS, 0.4)


@pytest.mark.parametrize("total", [-1, 2.5, "3", None, np.nan])
def test_a_total_that_cannot_be_is_refused(total):
    with pytest.raises(SceneError, match=r"add_part: total = .* must be a whole number >= 0"):
        sparse().add_part([0, 1, 2], total, POINTS, 0.4)


def test_grains_that_no_rank_gives_are_missed():
    with pytest.raises(SceneError, match="of 4 grains 3 were given by the rank in whose space they are"):
        sparse().add_part([0, 1, 2], 4, POINTS, 0.4)


def test_the_same_number_on_two_ranks_is_refused():
    def program():
        sim = sparse()
        low, high = sim.space
        sim.add_part([0], 2, [0.5 * (low + high)], 0.4)

    with pytest.raises(SceneError, match="the same number"):
        virtual_ranks(2, program)


def test_lists_that_differ_between_ranks_are_refused():
    def program():
        sparse().add_grains(POINTS + 0.1 * world().rank, 0.4)

    with pytest.raises(SceneError, match="the ranks gave different grains"):
        virtual_ranks(2, program)


@pytest.mark.parametrize("brick", [((0, 0, 4), (8, 8, 1)), ((9, 0, 0), (12, 8, 8)), ((0, 0, 0), (8, float("nan"), 8))])
def test_bricks_that_cannot_be_filled_are_refused(brick):
    with pytest.raises(
        SceneError, match=r"share_space: brick 1, .* must have a high corner above its low one, and a part inside"
    ):
        sparse().share_space([((0, 0, 0), (8, 8, 8)), brick])


def test_each_rank_knows_how_many_grains_there_are_in_all():
    def program():
        sim = sparse()
        sim.add_grains(np.arange(1.0, 6.0)[:, None] * (1.0, 1.0, 1.0), 0.1)
        return sim.n_grains

    assert virtual_ranks(3, program) == [5, 5, 5]


def test_parts_get_ids_after_all_before_them():
    sim = sparse()
    assert sim.add_grains(POINTS, 0.4).tolist() == [0, 1, 2]
    sim.add_part([0, 1, 2], 3, POINTS + np.array((0.0, 2.0, 0.0)), 0.4)
    assert sim.grains.id.tolist() == [0, 1, 2, 3, 4, 5] and sim.next_id == 6


def of_bed():
    flow, side = dense_flow()
    made = Bed(flow.take(np.arange(500)), side, 3, 2)
    sim = simulation(made, 1, world())
    return made.count, sim.grains.view("id").copy(), sim.grains.view("position").copy()


def test_a_bed_made_by_several_ranks_is_that_made_by_one():
    (count, ids, position), parts = of_bed(), virtual_ranks(4, of_bed)
    order = np.argsort(np.concatenate([part[1] for part in parts]))
    assert count == 3000 and np.array_equal(np.concatenate([part[2] for part in parts])[order], position[np.argsort(ids)])


@pytest.mark.validate
def test_a_bed_is_settled_by_one_rank_alone(tmp_path, monkeypatch):
    """While the others wait: where no state is kept yet."""
    monkeypatch.setenv("BARCHAN_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(states, "SETTLING", 2)

    def program():
        return on_first_rank(world(), lambda: settled_flow(Journal(), 2)).shape

    assert virtual_ranks(2, program) == [(32000, 3)] * 2


@pytest.mark.validate
def test_scaling_tells_what_it_measured():
    """Speed-up and efficiency follow from the times by equations (14) and (15); phases, ghosts and messages are there."""
    told = on_ranks(2, "-m", "barchan", "scaling", "--grains", 2000, "--steps", 100, "--sync")
    one, both, gain, share = (
        float(re.search(rf"^ *{re.escape(name)} +([\d.]+)", told, re.MULTILINE)[1])
        for name in ("one rank t(1)", "all ranks t(2)", "speed-up S", "efficiency e")
    )
    assert gain == pytest.approx(one / both, rel=0.3) and share == pytest.approx(gain / 2.0, abs=2e-3)
    assert re.search(r"grains +4,000 on 2 ranks of 1 thread", told)
    ghosts, messages, size = (
        float(re.search(text, told)[1].replace(",", ""))
        for text in (r"ghosts +([\d.]+) for", r"at most (\d+) with", r"with ([\d,]+) bytes")
    )
    assert messages == 1 and 0.05 < ghosts < 1.0 and size / 72 == pytest.approx(ghosts * 2000, rel=0.2)
    for phase in ("motion", "neighbours", "ghosts", "forces", "waiting"):
        assert re.search(rf"^  {phase} +[\d.]+ +[\d.]+$", told, re.MULTILINE), phase


def test_scaling_refuses_one_process():
    done = subprocess.run([sys.executable, "-m", "barchan", "scaling"], capture_output=True, text=True)
    assert done.returncode == 2 and "mpiexec -n 2 barchan scaling" in done.stderr


def capacity(grains, steps, path, limit):
    told = json.loads(on_ranks(2, ROOT / "tests" / "reference" / "capacity.py", grains, steps, path, limit=limit))
    assert told["grains"] >= grains and told["rebuilds"] >= 2 and told["shared_anew"] == 1 and told["read_back"]
    return told


def test_a_bed_runs_is_shared_anew_saved_and_read_back(tmp_path):
    assert capacity(8_000, 120, tmp_path / "small.h5", 300)["coordination"] > 4.0


@pytest.mark.validate
def test_fifteen_million_grains_on_two_ranks(tmp_path):
    told = capacity(15_000_000, 200, tmp_path / "large.h5", 3600)
    (ROOT / "runs").mkdir(exist_ok=True)
    (ROOT / "runs" / "capacity.json").write_text(json.dumps(told, indent=1))
    assert told["coordination"] > 4.0 and max(told["peak_bytes"].values()) < 18 * 2**30


def test_memory_is_asked_of_each_machine(monkeypatch):
    """Twice as many grains as one machine holds fit on three, each with two ranks."""
    from barchan.preflight import check_memory

    class OnThree(Serial):
        size, ranks_on_node = 6, 2

    monkeypatch.setattr("os.sysconf", {"SC_PHYS_PAGES": 1_000_000, "SC_PAGE_SIZE": 4096}.__getitem__)
    with pytest.raises(SceneError, match="or more machines"):
        check_memory(5_000_000, Serial())
    check_memory(5_000_000, OnThree())
