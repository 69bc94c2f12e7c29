"""When space is shared among the ranks anew, and how evenly."""

import warnings

import numpy as np
import pytest
from scenes import pile

from barchan.errors import SceneError
from barchan.parallel import Serial, virtual_ranks, world
from barchan.parallel.balance import Balance, _costs

pytestmark = pytest.mark.nojit


class Two:
    """Two ranks of which the other one computed for ``other`` seconds so far."""

    size, rank, other = 2, 0, 0.0

    def sum(self, values):
        return np.array(values) + int(1e9 * self.other)

    def from_first(self, item):
        return item


def test_the_rule_stops_at_the_first_rise_of_the_degradation():
    """Moon & Saltz: W(n) = [C + sum of (t_max - t_avg)] / n. Ranks drift apart by 1 ms more in every step, C is 50 ms:
    n* = sqrt(2 C / slope) = 14.1 with slope 0.5 ms of t_max - t_avg, so W rises first from n = 14 to 15 or the step after."""
    balance, comm = Balance(), Two()
    balance.count, balance._last_cost, balance._before = 1, 0.05, np.inf
    decided = None
    for step in range(1, 40):
        slow, fast = 0.01 + 1e-3 * step, 0.01
        balance.note(slow, fast, 1)
        comm.other += slow
        if balance.is_due(comm, step):
            decided = step
            break
    waited = [0.5e-3 * n * (n + 1) / 2 for n in range(1, 40)]
    degradation = [(0.05 + w) / n for n, w in zip(range(1, 40), waited)]
    assert decided == next(n + 1 for n in range(1, 39) if degradation[n] > degradation[n - 1])
    assert abs(decided - np.sqrt(2 * 0.05 / 0.5e-3)) < 2.0


def test_ranks_that_are_alike_are_left_alone():
    balance, comm = Balance(), Two()
    balance.count, balance._last_cost = 1, 0.05
    for step in range(1, 200):
        balance.note(0.01, 0.01, 1)
        comm.other += 0.01
        assert not balance.is_due(comm, step)


def test_one_rank_never_shares():
    balance = Balance()
    balance.when = lambda step: True
    assert not balance.is_due(Serial(), 1)


def test_speeds_are_measured_from_what_each_rank_took_for_its_cost():
    """Rank 1 takes three times as long for as much; nothing is concluded before anything was timed."""

    def program():
        balance, comm = Balance(), world()
        balance.speeds = "measured"
        first = balance._present_speeds(comm, 500.0).tolist()
        for _ in range(4):
            balance.note(0.3, 0.1 + 0.2 * comm.rank, 1)
        return first, balance._present_speeds(comm, 500.0).tolist()

    for first, then in virtual_ranks(2, program):
        assert first == [1.0, 1.0] and then[0] / then[1] == pytest.approx(3.0)


def test_a_rank_with_few_grains_or_none_is_not_starved_by_its_measured_speed():
    """Cost 100, 100, 1 and 0 in the same time: the third is held at a quarter of the median, of the fourth nothing is known."""

    def program():
        balance, comm = Balance(), world()
        balance.speeds = "measured"
        balance.note(0.1, 0.1, 1)
        return balance._present_speeds(comm, [100.0, 100.0, 1.0, 0.0][comm.rank]).tolist()

    assert virtual_ranks(4, program) == [[1.0, 1.0, 0.25, 1.0]] * 4


def test_a_typo_is_no_new_attribute():
    with pytest.raises(AttributeError, match="speed"):
        Balance().speed = [1.0, 2.0]


@pytest.mark.parametrize("speeds", [None, [1.0, 0.5], [2.0, 1.0]])
def test_a_rank_half_as_fast_gets_half_the_load(speeds):
    """Within one sub-domain: by the cost of the grains that the ranks hold after sharing anew."""

    def program():
        sim = pile(125)
        sim.balance.when, sim.balance.speeds, sim.staleness.also_when = (lambda step: True), speeds, lambda step: True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(3)
        cost, cells = _costs(sim), sim.topology.subdomain(sim.grains.view("position"))
        heaviest = np.bincount(cells, weights=cost).max(initial=0.0)
        return int(cost.sum()), float(world().maximum([heaviest])[0]), sim.balance.imbalance

    (one, heaviest, imbalance), (other, *_) = virtual_ranks(2, program)
    share = 0.5 if speeds is None else 2.0 / 3.0
    assert abs(one - share * (one + other)) <= 1.5 * heaviest
    assert 1.0 <= imbalance < 1.1


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        *(
            ("speeds", speeds, "'measured', or one positive number for each of 2 ranks")
            for speeds in ([1.0], [1.0, 0.0], [1.0, np.nan], "fast", [[1.0, 1.0]], [1.0, -1.0])
        ),
        *(("when", when, "'it pays', 'never' or a function of the step") for when in ("sometimes", None, 3)),
    ],
)
def test_settings_that_mean_nothing_are_refused(name, value, message):
    def program():
        sim = pile(40)
        setattr(sim.balance, name, value)
        sim.prepare()

    with pytest.raises(SceneError, match=rf"balance\.{name} = .* must be {message}"):
        virtual_ranks(2, program)
    if name == "when":
        with pytest.raises(SceneError, match=message):
            virtual_ranks(1, program)


def test_little_moves_when_little_has_changed():
    """Shared anew twice in a row, hardly a grain changes its owner."""

    def program():
        sim = pile(125)
        sim.balance.when, sim.staleness.also_when = (lambda step: True), lambda step: True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(2)
            before = sim.grains.view("id").copy()
            sim.run(1)
        return len(np.setdiff1d(sim.grains.view("id"), before)), sim.grains.n

    results = virtual_ranks(4, program)
    assert sum(moved for moved, _ in results) < 0.1 * sum(count for _, count in results)
