"""How ranks share a sample: ghosts against a count over all pairs, and what is made of the counts."""

import io
from time import process_time

import numpy as np
import pytest

from barchan.bench import graded, shared
from barchan.bench.peers.barchan import Engine
from barchan.parallel import virtual_ranks, world
from barchan.report import Journal

RANKS = 3


@pytest.fixture(scope="module")
def case():
    return graded.bidisperse(10, 90)(Journal(stream=io.StringIO()))


def listed(case, ranks):
    """Of each rank: ids that it owns, pairs of its list, those that it computes if each is computed once, and the ids of its
    grains whose forces it is then sent back."""

    def program():
        engine = Engine(1, None)
        engine.set_up(case, case.skins[0])
        sim = engine.sim
        ids, back = sim.grains.view("id", ghosts=True), []
        if ranks > 1:
            back = shared.put_once(sim).push(ids[np.unique(shared.once(sim)[1])]).send().pop().tolist()
        pairs = (
            np.sort(ids[np.stack(rows, axis=1)], axis=1) for rows in ((sim.contacts.first, sim.contacts.second), shared.once(sim))
        )
        return sim.grains.view("id").copy(), *pairs, back

    return virtual_ranks(ranks, program)


def owners(parts, count):
    """Rank of each grain."""
    owner = np.empty(count, dtype=int)
    for rank, (own, *_) in enumerate(parts):
        owner[own] = rank
    return owner


@pytest.mark.validate
def test_ghosts_are_those_that_pairs_of_two_ranks_need(case):
    """Counted from the list of one rank alone and from who owns what."""
    ((_, pairs, *_),), parts = listed(case, 1), listed(case, RANKS)
    owner = owners(parts, case.count)
    across = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    wanted = {(i, owner[j]) for i, j in np.concatenate([across, across[:, ::-1]]).tolist()}
    found = shared.shares(case, RANKS, timed=1)
    assert [share.owned for share in found] == [len(own) for own, *_ in parts]
    assert sum(share.kept for share in found) == len(wanted) > 500
    totals = np.array([[share.of_one_class, share.searched, share.kept, share.put] for share in found]).sum(axis=0)
    assert totals[0] > totals[1] > totals[2] > totals[3] > 0.4 * totals[2]


def test_each_pair_can_be_computed_once_and_the_forces_put_back(case):
    """By the owner of the small grain where the other is large; the ghosts in those pairs are grains whose owners get forces."""
    ((_, pairs, *_),), parts = listed(case, 1), listed(case, RANKS)
    owner, large = owners(parts, case.count), case.grains.radius > 5.0
    across = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    computed = [tuple(pair) for _, _, mine, _ in parts for pair in mine.tolist()]
    assert sorted(computed) == sorted(map(tuple, across.tolist()))
    wanted = [set() for _ in parts]
    for rank, (_, _, mine, _) in enumerate(parts):
        for pair in mine.tolist():
            ghost = next(one for one in pair if owner[one] != rank)
            assert not (large[pair].any() and not large[ghost] and not large[pair].all()), "small ones look for large ones"
            wanted[owner[ghost]].add((ghost, rank))
    assert [len(back) for *_, back in parts] == [len(ghosts) for ghosts in wanted]
    assert [sorted(back) for *_, back in parts] == [sorted(ghost for ghost, _ in ghosts) for ghosts in wanted]


def test_a_rank_computes_while_it_has_the_baton():
    """Not while it waits for the others."""

    def program():
        comm = world()
        comm.barrier()
        before = comm.computed
        end = process_time() + 0.05 * (1 + comm.rank)
        while process_time() < end:
            pass
        comm.barrier()
        return comm.computed - before

    assert virtual_ranks(3, program) == pytest.approx([0.05, 0.1, 0.15], abs=0.02)


def test_what_is_made_of_the_shares(tmp_path):
    shares = [
        shared.Share(10, 100, 40, 30, 20, rebuilds=(1.0, 1.0, 9.0), steps=(0.1, 0.1, 0.1)),
        shared.Share(30, 300, 40, 50, 40, rebuilds=(3.0, 3.0, 3.0), steps=(0.3, 0.5, 0.5)),
    ]
    found = shared.summary(shares)
    assert found.ranks == 2 and found.slowest == 3.0
    assert (found.received_one_class, found.received, found.received_once) == (72 * 200, 72 * 40, (72 + 48) * 30)
    assert found.uneven_rebuild == pytest.approx(3.0 / 2.0) and found.uneven_step == pytest.approx(0.3 / 0.2)
    alone = shared.summary([shared.Share(40, 0, 0, 0, 0, rebuilds=(5.1,), steps=(0.5,))])
    told = shared.lines("sample", [alone, found])
    assert "1.7" in told[2].split() and "2.88" in told[2].split()
    shared.draw({"sample": [alone, found], "other": [alone, found]}, tmp_path / "shared.png")
    assert (tmp_path / "shared.png").stat().st_size > 10_000
