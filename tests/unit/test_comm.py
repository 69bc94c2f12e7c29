"""Ranks in one process: what they tell each other, and how an error on one ends all."""

import threading

import numpy as np
import pytest

from barchan.errors import OverlapError, RankError, SceneError
from barchan.parallel import Serial, world
from barchan.parallel import virtual_ranks as start_ranks
from barchan.parallel.guard import raise_together

pytestmark = pytest.mark.nojit


def virtual_ranks(size, program, *args):
    """The same with an alarm: ranks that wait for each other for ever shall fail a test, not hang it."""
    outcome = []

    def start():
        try:
            outcome.append((start_ranks(size, program, *args), None))
        except BaseException as error:
            outcome.append((None, error))

    alarm = threading.Thread(target=start, daemon=True)
    alarm.start()
    alarm.join(timeout=30.0)
    assert outcome, "the ranks hang"
    results, error = outcome[0]
    if error is not None:
        raise error
    return results


@pytest.mark.parametrize("size", [1, 2, 5])
def test_every_rank_knows_itself_and_all_get_the_same_sum_and_maximum(size):
    def program(offset):
        comm = world()
        total = comm.sum([comm.rank, 10**15, -1])
        largest = comm.maximum([-float(comm.rank), offset + comm.rank])
        return comm.rank, comm.size, total.tolist(), total.dtype, largest.tolist(), comm.all_gather(f"rank {comm.rank}")

    names = [f"rank {k}" for k in range(size)]
    for rank, result in enumerate(virtual_ranks(size, program, 0.5)):
        expected_sum = [size * (size - 1) // 2, size * 10**15, -size]
        assert result == (rank, size, expected_sum, np.int64, [0.0, size - 0.5], names)


def test_one_rank_alone_is_the_same_without_a_world():
    comm = world()
    assert isinstance(comm, Serial) and (comm.rank, comm.size) == (0, 1)
    assert comm.sum([3, 4]).tolist() == [3, 4] and comm.maximum([0.5]).tolist() == [0.5] and comm.all_gather("x") == ["x"]
    assert comm.exchange({0: b"x"}) == {0: b"x"}


@pytest.mark.parametrize("size", [1, 4])
def test_what_the_first_says_and_what_lower_ranks_have(size):
    def program():
        comm = world()
        return comm.from_first(f"rank {comm.rank}"), comm.before([comm.rank + 1, 10]).tolist()

    assert virtual_ranks(size, program) == [("rank 0", [rank * (rank + 1) // 2, 10 * rank]) for rank in range(size)]


def test_messages_reach_the_rank_they_are_for_and_nobody_else():
    """Each sends to the next two; the third of four hears from the first and the second."""

    def program():
        comm = world()
        boxes = {(comm.rank + step) % comm.size: np.array([comm.rank, step], dtype=np.uint8) for step in (1, 2)}
        return {source: message.tolist() for source, message in comm.exchange(boxes).items()}

    for rank, received in enumerate(virtual_ranks(4, program)):
        assert received == {(rank - step) % 4: [(rank - step) % 4, step] for step in (1, 2)}


def test_a_message_is_a_copy():
    """What a rank writes into its own array after sending it must not arrive, nor come back."""

    def program():
        comm = world()
        mine = np.array([comm.rank, 7], dtype=np.uint8)
        received = comm.exchange({1 - comm.rank: mine})
        mine[1] = 9
        comm.barrier()
        received[1 - comm.rank][0] = 99
        comm.barrier()
        return received[1 - comm.rank].tolist(), mine.tolist()

    assert virtual_ranks(2, program) == [([99, 7], [0, 9]), ([99, 7], [1, 9])]


def test_only_one_rank_computes_at_a_time():
    """They share one process's compiled threads, so they take turns."""
    running, most = [], []

    def program():
        for _ in range(20):
            running.append(1)
            most.append(len(running))
            sum(range(1000))
            running.pop()
            world().barrier()

    virtual_ranks(3, program)
    assert max(most) == 1 and len(most) == 60


@pytest.mark.parametrize("guilty", [0, 1, 2])
@pytest.mark.parametrize("waiting", ["barrier", "sum", "exchange"])
def test_an_error_on_one_rank_ends_all_with_its_message(guilty, waiting):
    """The others wait in a collective call; they must neither hang nor go on."""
    ended = {}

    def program():
        comm = world()
        if comm.rank == guilty:
            raise OverlapError("grain 5 and grain 6: overlap 40 %")
        try:
            {"barrier": comm.barrier, "sum": lambda: comm.sum([1]), "exchange": lambda: comm.exchange({})}[waiting]()
            ended[comm.rank] = "went on"
        except RankError as error:
            ended[comm.rank] = str(error)
            raise

    with pytest.raises(OverlapError, match="grain 5 and grain 6"):
        virtual_ranks(3, program)
    told = f"stopped because rank {guilty} failed: grain 5 and grain 6: overlap 40 %"
    assert ended == {rank: told for rank in range(3) if rank != guilty}


def test_an_error_is_raised_together():
    """The rank with the error raises it; the others raise one that quotes it."""

    def program():
        comm = world()
        raise_together(comm, None)  # nobody has one: all go on
        try:
            raise_together(comm, ValueError("bad box") if comm.rank == 1 else None)
        except (ValueError, RankError) as error:
            return type(error).__name__, str(error)

    told = ("RankError", "stopped because rank 1 failed: bad box")
    assert virtual_ranks(3, program) == [told, ("ValueError", "bad box"), told]


def test_the_lowest_guilty_rank_speaks_and_no_thread_is_left_behind():
    def program():
        raise KeyError(world().rank)

    before = threading.active_count()
    with pytest.raises(KeyError):
        virtual_ranks(4, program)
    assert threading.active_count() == before
    assert virtual_ranks(2, lambda: world().size) == [2, 2], "the next world is untouched by the last one's failure"


@pytest.mark.parametrize("size", [0, -1, 1.5, "two", True, None])
def test_a_number_of_ranks_that_means_nothing_is_refused(size):
    with pytest.raises(SceneError, match=f"virtual_ranks: size = {size!r} must be a whole number >= 1"):
        virtual_ranks(size, world)
