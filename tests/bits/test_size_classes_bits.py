"""Size classes change no bit: not their number, not where they are cut, not whether their grids are sparse, on any number of
threads and ranks, over rebuilds, sharing of space anew, and a stop.

Small grains lie deep in other ranks' parts of space beside large ones that these do not own: contacts begin, slide and end there.
"""

import warnings
from functools import lru_cache
from unittest.mock import patch

import numpy as np
import pytest

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.kernels import cells, compiler
from barchan.measure import contact_table
from barchan.neighbors.classes import STRATEGIES
from barchan.parallel import virtual_ranks

STEPS, EDGE = 150, 2.52
LARGE, MIDDLE, SMALL = 0.5, 0.24, 0.1
VALUES = {"friction": 0.4, "youngs_modulus": 2e4, "poisson_ratio": 0.25, "restitution": 0.7, "work_of_adhesion": 0.5}
CUTS = {"one": (), "two": (0.3,), "three": (0.15, 0.3), "chosen": None, "some empty": (0.05, 0.12, 0.2, 0.3, 0.9)}


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def mixture(law=bc.laws.hertz_mindlin, cuts=(), threads=1, with_grains=True):
    """Three sizes on a floor, between periodic faces: small grains fill what the others leave, all overlap a little and move."""
    material = bc.Material("grain", density=1.0, **{name: VALUES[name] for name in law.properties})
    sim = bc.Simulation(bc.Box((0, 0, 0), (EDGE,) * 3, (True, True, False)), law, material, 1e-4, (0, 0, -10.0), threads)
    sim.check_dt, sim.size_classes.separators = False, cuts
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    if not with_grains:
        return sim
    rng = np.random.default_rng(7)
    place, radius = np.zeros((0, 3)), np.zeros(0)
    while len(radius) < 12:
        one, size = rng.random(3) * (EDGE, EDGE, 1.5) + (0, 0, 0.45), LARGE if len(radius) < 4 else MIDDLE
        if (np.linalg.norm(sim.box.difference(place, one), axis=1) > radius + size).all():
            place, radius = np.vstack([place, one]), np.append(radius, size)
    sites = (np.stack(np.meshgrid(*3 * [np.arange(13)], indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * EDGE / 13
    sites += rng.uniform(-0.01, 0.01, sites.shape)
    gap = np.linalg.norm(sim.box.difference(sites[:, None], place[None]), axis=2) - radius - SMALL
    sites = sites[(gap > -0.01).all(axis=1)]
    place, radius = np.concatenate([sites, place]), np.concatenate([np.full(len(sites), SMALL), radius])
    order = rng.permutation(len(radius))
    sim.add_grains(place[order], radius[order], velocity=rng.normal(scale=1.0, size=(len(radius), 3)))
    return sim


def final_state(law=bc.laws.hertz_mindlin, cuts=(), threads=1, also_when=None, shared_anew="it pays"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = mixture(law, cuts, threads)
        sim.staleness.also_when, sim.balance.when = also_when, shared_anew
        sim.run(STEPS)
    return collect(sim)


@lru_cache
def plain(law):
    """Its final state with one class, on one thread and rank."""
    return final_state(law)


def test_the_state_is_worth_testing():
    """Contacts of all sizes with all, many of them new, some of the old ones gone; ghosts of all classes."""

    def program():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = mixture(cuts=CUTS["three"])
            sim.prepare()
            before, ghosts = contact_table(sim), sim.size_classes.ghosts
            offsets = sim.contacts.n_pairs - sim.contacts._n_inner
            sim.run(STEPS)
        return before, contact_table(sim), ghosts, offsets, sim.staleness.rebuilds

    (before, after, ghosts, border, rebuilds), *_ = virtual_ranks(3, program)
    assert (ghosts > 0).all() and border > 100 and rebuilds > 3
    pairs = [set(zip(t["first"].tolist(), t["second"].tolist())) for t in (before, after)]
    assert len(pairs[0] - pairs[1]) > 20 and len(pairs[1] - pairs[0]) > 20
    radius = mixture().grains.sorted_by_id("radius")
    sizes = {tuple(sorted((radius[i], radius[j]))) for i, j in pairs[1] if j >= 0}
    assert {(SMALL, SMALL), (SMALL, MIDDLE), (SMALL, LARGE)} <= sizes


@pytest.mark.parametrize("law", [bc.laws.hertz_mindlin, bc.laws.jkr], ids=lambda law: law.name)
@pytest.mark.parametrize("cuts", ["two", "three", "chosen", "some empty"])
@pytest.mark.parametrize(("threads", "ranks"), [(1, 1), (2, 2), (1, 3)], ids=str)
def test_classes_threads_and_ranks_change_no_bit(law, cuts, threads, ranks):
    found = virtual_ranks(ranks, final_state, law, CUTS[cuts], threads, lambda step: step % 7 == 3)
    assert differences(plain(law), found[-1]) == []


@pytest.mark.parametrize("strategy", STRATEGIES[1:])
@pytest.mark.parametrize(("threads", "ranks"), [(2, 1), (1, 3)], ids=str)
def test_strategies_change_no_bit(strategy, threads, ranks):
    """Nor does a change of them on the way."""

    def program():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = mixture(cuts=CUTS["three"], threads=threads)
            sim.run(30)
            sim.size_classes.strategy = strategy
            sim.run(STEPS - 30)
        return collect(sim)

    assert differences(plain(bc.laws.hertz_mindlin), virtual_ranks(ranks, program)[-1]) == []


@pytest.mark.parametrize("ranks", [1, 3])
def test_sparse_grids_change_no_bit(ranks):
    with patch.multiple(cells, DENSE=0, FEWEST=7, SPARSE=1):
        found = virtual_ranks(ranks, final_state, bc.laws.hertz_mindlin, CUTS["three"])
    assert differences(plain(bc.laws.hertz_mindlin), found[-1]) == []


def test_sharing_space_anew_changes_no_bit():
    found = virtual_ranks(3, final_state, bc.laws.hertz_mindlin, CUTS["three"], 1, lambda step: step % 5 == 2, lambda step: True)
    assert differences(plain(bc.laws.hertz_mindlin), found[-1]) == []


@pytest.mark.parametrize("ranks", [1, 2])
def test_other_classes_after_a_stop_change_no_bit(ranks, tmp_path):
    """Classes are no part of the state: a checkpoint of one choice goes on with another, and so does a run."""

    def program():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = mixture(cuts=CUTS["two"])
            sim.run(50)
            sim.size_classes.separators = CUTS["three"]
            sim.run(20)
            save(sim, tmp_path / "stop.h5")
            again = mixture(cuts=CUTS["some empty"], with_grains=False)
            restore(again, tmp_path / "stop.h5")
            again.run(STEPS - 70)
        return collect(again)

    assert differences(plain(bc.laws.hertz_mindlin), virtual_ranks(ranks, program)[-1]) == []
