"""Bonds keep the same bits on ranks and threads, over rebuilds at any moment, and after stop and resume, while they break."""

import warnings

import numpy as np
import pytest
import states

import barchan as bc
from barchan.bonds import cracks
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.kernels import compiler
from barchan.parallel import virtual_ranks, world

STEPS = 120


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    """Two threads share even these 580 grains, or the tests of threads would test nothing."""
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


@pytest.fixture(autouse=True)
def deep_overlaps_are_meant():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def final_state(steps=STEPS, also_when=None, **options):
    sim = states.bonded(**options)
    sim.staleness.also_when = also_when
    sim.run(steps)
    return collect(sim)


@pytest.fixture(scope="module")
def plain():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return final_state(threads=1)


def test_it_breaks_in_every_mode_and_much_holds(plain):
    """Otherwise the tests below would test less than they say."""
    modes = plain.cracks[:, list(cracks.COLUMNS).index("mode")]
    steps = plain.cracks[:, 0]
    assert set(modes) == {1.0, 2.0, 3.0, 4.0} and len(modes) > 100 and len(plain.bonds.keys) > 500
    assert np.ptp(steps) > 60, "all along"


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_any_number_of_ranks(ranks, plain):
    """Bonds cross borders, and break there; grains migrate with them."""

    def program():
        sim = states.bonded(threads=1)
        ends = sim.bonds.owners.copy()
        sim.run(STEPS)
        across = int((ends[:, 0] != ends[:, 1]).sum())
        seen = sim.bonds.cracks.values
        return collect(sim), across, len(seen)

    parts = virtual_ranks(ranks, program)
    assert sum(across > 10 for _, across, _ in parts) > 1 and sum(seen > 3 for _, _, seen in parts) > 1
    assert sum(seen for *_, seen in parts) == len(plain.cracks), "each break is noted on one rank"
    for state, *_ in parts:
        assert differences(plain, state) == []


@bc.law(properties={"kn": "force/length"})
def spring(overlap, kn):
    """It reads places alone: of ghosts, bonds need velocities, too."""
    return kn * overlap, (0.0, 0.0, 0.0)


def test_beside_a_law_that_reads_places_alone():
    def program():
        sim = states.dense(spring, threads=1, bonds=states.KINDS)
        sim.install_bonds(kind="tough")
        sim.run(40)
        return collect(sim)

    alone, *_ = virtual_ranks(1, program)
    for state in virtual_ranks(3, program):
        assert differences(alone, state) == []


def test_two_threads(plain):
    assert differences(plain, final_state(threads=2)) == []


def test_any_moment_of_rebuild(plain):
    draws = np.random.default_rng(5).random(10000) < 0.25
    assert differences(plain, final_state(threads=1, also_when=lambda step: bool(draws[step]))) == []


def test_run_in_parts(plain):
    sim = states.bonded(threads=1)
    for part in (1, 50, STEPS - 51):
        sim.run(part)
    assert differences(plain, collect(sim)) == []


@pytest.mark.parametrize("before, after", [(1, 1), (1, 3), (3, 1), (2, 5)])
def test_resume_in_the_middle_of_cracking(before, after, plain, tmp_path):
    """On other numbers of ranks than it began with; the file is the same for any number."""
    path, again = tmp_path / "state.h5", tmp_path / "again.h5"

    def begin():
        sim = states.bonded(threads=1)
        sim.run(57)
        save(sim, path)

    def go_on():
        sim = states.empty(bc.laws.linear, bonds=states.KINDS, threads=1)
        restore(sim, path)
        save(sim, again)
        sim.run(STEPS - 57)
        return collect(sim)

    virtual_ranks(before, begin)
    for state in virtual_ranks(after, go_on):
        assert differences(plain, state) == []
    assert path.read_bytes() == again.read_bytes()


def test_grains_that_are_taken_out_take_their_bonds_along():
    """Also those with grains of other ranks, which have to be told."""

    def program():
        sim = states.bonded(threads=1)
        sim.max_overlap = 0.5
        sim.run(20)
        sim.remove(np.arange(100, 180))
        sim.run(20)
        return collect(sim)

    alone = virtual_ranks(1, program)[0]
    assert not np.isin(alone.bonds.keys, np.arange(100, 180)).any() and len(alone.bonds.keys) > 300
    for state in virtual_ranks(3, program):
        assert differences(alone, state) == []


def test_ghosts_follow_bonds_however_far_grains_part():
    """Strings as long as half the box, between grains that share no border: each end feels the other."""

    def program():
        glue = bc.Bond(bc.laws.parallel_bond, kn=0.2, ks=0.1, tensile_strength=1e9, shear_strength=1e9)
        grain = bc.Material("a", density=1.0, kn=100.0, kt=1.0, friction=0.0)
        sim = bc.Simulation(bc.Box((0, 0, 0), (40, 4, 4)), bc.laws.linear, grain, dt=1e-3, bonds=glue, threads=1)
        place = np.stack([np.repeat([19.4, 20.6], 3), np.tile([0.8, 2.0, 3.2], 2), np.full(6, 2.0)], axis=1)
        sim.add_grains(place, 0.5, velocity=np.outer(np.repeat([-9.0, 9.0], 3), (1.0, 0.0, 0.0)))
        sim.install_bonds(overlap=-0.25)
        sim.run(1500)
        apart = [(a, b) for a, b in sim.bonds.owners.tolist() if a != b]
        return collect(sim), len(apart), world().rank

    alone, parts = virtual_ranks(1, program)[0][0], virtual_ranks(4, program)
    length = np.ptp(alone.fields["position"][:, 0])
    assert length > 20.0 and len(alone.bonds.keys) >= 3, "so far that they are no neighbours of any kind"
    assert any(across for _, across, _ in parts)
    for state, *_ in parts:
        assert differences(alone, state) == []
