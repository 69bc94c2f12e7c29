"""Rows that travel between ranks: all arrive, once, with their bits, in the order that was promised."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from barchan.parallel import virtual_ranks, world
from barchan.parallel.mapping import Mapping, by_rank
from barchan.parallel.regroup import ById

pytestmark = pytest.mark.nojit

KINDS = ["u1", "i2", "u4", "i4", "i8", "f4", "f8", "?"]


def rows_of(rank, seed, kinds=KINDS):
    """Some fields of a rank, of all types and widths; any bits, also those of NaN."""
    rng = np.random.default_rng([seed, rank])
    count = int(rng.integers(0, 12))
    fields = []
    for number, kind in enumerate(kinds):
        shape = (count,) if number % 2 else (count, 1 + number % 5)
        width = int(np.prod(shape)) * np.dtype(kind).itemsize
        raw = rng.integers(0, 2 if kind == "?" else 256, width, dtype=np.uint8)
        fields.append(raw.view(kind).reshape(shape))
    return fields, rng.integers(0, 3, count)


def same_bits(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from([1, 3]))
def test_fields_of_any_type_arrive_with_their_bits(seed, size):
    """As one would expect who knows all ranks: by ascending sender, each sender's in its own order."""

    def program():
        comm = world()
        fields, owner = rows_of(comm.rank, seed)
        mapping = Mapping.define(comm, by_rank(owner % comm.size))
        for field in fields:
            mapping.push(field)
        mapping.send()
        return [mapping.pop().copy() for _ in fields]

    known = [rows_of(rank, seed) for rank in range(size)]
    for rank, received in enumerate(virtual_ranks(size, program)):
        for number, field in enumerate(received):
            expected = np.concatenate([fields[number][owner % size == rank] for fields, owner in known])
            assert same_bits(field, expected)


def test_a_definition_is_used_again_and_costs_one_message_a_rank():
    """However many fields; what is defined once is not agreed upon again."""

    def program():
        comm, sent = world(), []
        start = comm.start
        comm.start = lambda outgoing, incoming: sent.append(len(outgoing)) or start(outgoing, incoming)
        others = {rank: np.array([0, 2]) for rank in range(comm.size) if rank != comm.rank}
        mapping = Mapping.define(comm, others, [*others])
        for step in range(3):
            x, n = np.full((3, 4), step + comm.rank + 0.5), np.arange(3) + 10 * step
            mapping.push(x).push(n).send()
            assert mapping.pop().tolist() == [[step + rank + 0.5] * 4 for rank in others for _ in range(2)]
            assert mapping.pop().tolist() == [10 * step, 2 + 10 * step] * (comm.size - 1)
        return sent

    assert virtual_ranks(3, program) == [[2, 2, 2, 2]] * 3, "one to agree, then one for each time"


def test_ghost_put_brings_contributions_back_to_the_real_rows():
    """Each rank's ghosts count themselves; a row learns how many ghosts it has, whoever made them."""

    def program():
        comm = world()
        sends = {rank: np.arange(comm.rank + 1 + rank) for rank in range(comm.size) if rank != comm.rank}
        get = Mapping.define(comm, sends)
        put = get.reverse()
        ones = np.ones(get.n_received, dtype=np.int64)
        back, counts = put.push(ones).send().pop(), np.zeros(10, dtype=np.int64)
        np.add.at(counts, get.rows, back)
        return counts.tolist()

    for rank, counts in enumerate(virtual_ranks(3, program)):
        others = [other for other in range(3) if other != rank]
        assert counts == [sum(row < rank + 1 + other for other in others) for row in range(10)]


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from([2, 4]))
def test_a_narrowed_mapping_brings_what_is_wanted_and_nothing_else(seed, size):
    """In the same order; a rank that wants nothing of another's gets no message from it."""

    def program():
        comm, rng, messages = world(), np.random.default_rng([seed, world().rank]), []
        owner = rng.integers(0, size, 20)
        mapping = Mapping.define(comm, by_rank(owner, but=comm.rank), [r for r in range(size) if r != comm.rank])
        everything = mapping.push(rng.random((20, 2))).send().pop().copy()
        wanted = rng.random(len(everything)) < rng.choice([0.0, 0.1, 0.9])
        narrow, rng = mapping.narrowed(wanted), np.random.default_rng([seed, comm.rank])
        rng.integers(0, size, 20)
        start = comm.start
        comm.start = lambda outgoing, incoming: messages.append(sorted(outgoing)) or start(outgoing, incoming)
        some = narrow.push(rng.random((20, 2))).send().pop()
        assert same_bits(np.ascontiguousarray(some), everything[wanted])
        assert all(len(rows) for rows in narrow.sends.values()) and all(narrow.receives.values())
        return messages == [sorted(narrow.sends)] and narrow.n_received == wanted.sum()

    assert all(virtual_ranks(size, program))


def test_a_message_for_a_rank_that_does_not_listen_is_refused():
    def program():
        comm = world()
        Mapping.define(comm, {2: np.arange(1)} if comm.rank == 0 else {}, [r for r in (0, 1) if r != comm.rank])

    with pytest.raises(ValueError, match="message for rank 2"):
        virtual_ranks(3, program)


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.sampled_from([1, 2, 5]))
def test_from_one_topology_to_another_and_back(seed, size):
    """Grains in the order of ids, shared evenly; and every bit is back where it was."""
    everyone = np.random.default_rng(seed).permutation(60)[:40]

    def program():
        comm = world()
        ids = everyone[np.random.default_rng(seed + 1).integers(0, size, 40) == comm.rank].astype(np.int64)
        field = np.random.default_rng(seed + comm.rank).random((len(ids), 3))
        parts = ById(comm, ids, 0, 60)
        there = parts.bring(field)
        assert same_bits(parts.take_back(there), field)
        return parts.ids.tolist(), parts.begin, parts.total, parts.bring(ids).tolist()

    results = virtual_ranks(size, program)
    assert [i for ids, *_ in results for i in ids] == sorted(everyone.tolist())
    begin = 0
    for ids, first, total, brought in results:
        assert (first, total, brought) == (begin, 40, ids)
        begin += len(ids)
