"""Which size classes are chosen: one where sizes are alike, cuts where they are far apart, the same on all ranks, stable while
grains come and go."""

from unittest.mock import patch

import numpy as np
import pytest
from scenes import NOTHING, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.neighbors import classes
from barchan.neighbors.classes import Survey, choose, divide
from barchan.parallel import virtual_ranks


def sizes_of(*bins, filled=0.5):
    """Radii and numbers of grains, in a volume of which they fill a part."""
    largest, count = np.array(bins, dtype=float).T
    return Survey(largest, count.astype(int), float((4.0 / 3.0 * np.pi * largest**3 * count).sum() / filled))


def cloud(radius, edge=40.0):
    sim = simulation(bc.Box((0, 0, 0), (edge,) * 3, (True,) * 3), properties=NOTHING)
    sim.max_overlap, sim.check_dt = 1e9, False
    sim.add_grains(np.random.default_rng(1).uniform(0, edge, (len(radius), 3)), radius)
    return sim


def test_two_sizes_far_apart_are_two_classes():
    found = choose(sizes_of((1.0, 700_000), (10.0, 250)), 0.5)
    assert found.largest.tolist() == [1.0, 10.0] and found.count.tolist() == [700_000, 250]


@pytest.mark.parametrize(
    "bins", [[(1.0, 10**6)], [(1.0, 10**6), (1.3, 10**6)], [(1.0, 100), (3.0, 3)]], ids=["one", "alike", "few"]
)
def test_one_class_where_that_is_best(bins):
    assert len(choose(sizes_of(*bins), 0.1).largest) == 1


def test_more_classes_only_where_they_pay():
    """Of all choices with one cut or none, none costs less by the model than what is chosen."""
    largest = np.geomspace(1.0, 100.0, 24)
    sizes = sizes_of(*zip(largest, 1e6 * largest**-2.0))
    found = choose(sizes, 0.2)
    others = [divide(sizes, 0.2, ()), *(divide(sizes, 0.2, (radius,)) for radius in largest)]
    assert len(found.largest) > 2 and found.seconds < min(other.seconds for other in others)
    assert found.count.sum() == sizes.count.sum() and found.largest[-1] == 100.0


def test_the_model_counts_grains_in_a_cell():
    sizes = Survey(np.array([1.0, 5.0]), np.array([8000, 10]), 40.0**3)
    per_cell = divide(sizes, 0.5, (1.0,)).per_cell
    assert per_cell == pytest.approx([8000 * 2.5**3 / 40.0**3, 10 * 10.5**3 / 40.0**3])


def test_separators_are_the_largest_radii_of_classes():
    sim = cloud(np.repeat([0.5, 1.0, 1.000001, 3.0], [40, 30, 20, 10]))
    sim.size_classes.separators = (0.1, 1.0, 7.0)
    sim.prepare()
    assert sim.size_classes.largest.tolist() == [1.0, 3.0] and sim.size_classes.choice.count.tolist() == [70, 30]
    assert str(sim.size_classes).startswith("2 (as given): up to radius 1: 70 grains, ")


def test_ranks_choose_alike_and_tell_of_their_ghosts():
    radius = np.repeat([0.2, 4.0], [40_000, 5])

    def program():
        sim = cloud(radius)
        sim.prepare()
        return sim.size_classes.largest.tolist(), sim.size_classes.choice.count.tolist(), sim.size_classes.ghosts

    alone, parts = virtual_ranks(1, program)[0], virtual_ranks(3, program)
    assert alone[:2] == ([0.2, 4.0], [40_000, 5]) and alone[2].tolist() == [0, 0]
    assert all(part[:2] == alone[:2] and part[2][0] > 0 for part in parts)


def test_small_ghosts_are_few():
    """A layer of small grains one diameter and a skin thick, and around large ones, not one as thick as a large grain."""

    def program(separators):
        sim, seen = cloud(np.repeat([0.2, 4.0], [8000, 2])), []
        sim.size_classes.separators = separators
        keep = sim.ghosts.keep
        sim.ghosts.keep = lambda grains, wanted: seen.append(len(wanted)) or keep(grains, wanted)  # those a search looks at
        sim.prepare()
        return seen[0]

    several, one = (sum(virtual_ranks(2, program, separators)) for separators in ((0.2,), ()))
    assert 8 * several < one


def test_the_choice_stays_while_little_changes():
    sim = cloud(np.repeat([0.2, 4.0], [40_000, 5]))
    sim.prepare()
    choices = []
    for count, size in ((10, 0.21), (30_000, 1.5)):
        sim.add_grains(np.random.default_rng(count).uniform(0, 40, (count, 3)), size)
        sim.prepare()
        choices.append(sim.size_classes.largest.tolist())
    assert choices[0] == [0.21, 4.0], "ten new grains are no reason"
    assert choices[1] == [1.5, 4.0], "thirty thousand are: not so far from the large ones that three classes pay"


def test_cuts_grow_with_the_grains():
    """As in ``compact``: all radii by a thousandth, again and again."""
    sim = cloud(np.append(np.geomspace(0.1, 0.4, 4000), np.linspace(3.0, 4.0, 5)))
    sim.prepare()
    before = sim.size_classes.choice
    with patch.object(classes, "choose") as chosen:
        for _ in range(30):
            sim.grains.radius *= 1.001
            sim.prepare()
    assert not chosen.called, "to choose takes longer than to keep"
    assert len(before.largest) >= 2 and sim.size_classes.choice.count == pytest.approx(before.count, rel=0.1)


@pytest.mark.parametrize("separators", [(2.0, 1.0), (0.0,), (-1.0,), (np.nan,), 3.0, "two", [[1.0]], (np.inf,)])
def test_separators_that_are_none(separators):
    sim = cloud(np.ones(10))
    sim.size_classes.separators = separators
    with pytest.raises(SceneError, match=r"size_classes\.separators = .*ascending positive radii"):
        sim.prepare()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("separators", (3.0, 1.0)),
        ("strategy", "nonsense"),
        *(("cell", cell) for cell in (-1.0, 0.0, np.nan, "1", True)),
    ],
)
def test_what_an_action_sets_is_checked_in_its_step(name, value):
    class Sets:
        due = bc.At(3)

        def apply(self, sim):
            setattr(sim.size_classes, name, value)

    sim = cloud(np.ones(10))
    sim.actions.append(Sets())
    with pytest.raises(SceneError, match=rf"size_classes\.{name} = "):
        sim.run(10)
    assert sim.step_number == 3


def test_classes_of_ones_own_take_their_place_in_any_step():
    sim, other = cloud(np.repeat([0.1, 3.0], [500, 3])), classes.SizeClasses()
    sim.run(2)
    other.separators, other.cell = (1.0,), np.float32(0.5)
    sim.size_classes = other
    sim.run(2)
    assert other.choice.count.tolist() == [500, 3] and "2 (as given): " in str(other)
    other.separators = ()
    assert "2 (as given): " in str(other), "of now"
    sim.run(2)
    assert "1 (as given): " in str(other)
    for wrong in ((1.0,), None, classes.SizeClasses):
        sim.size_classes = wrong
        with pytest.raises(SceneError, match=r"size_classes = .* must be a barchan\.neighbors\.classes\.SizeClasses"):
            sim.run(1)


def test_the_text_tells_what_one_class_would_cost():
    sim = cloud(np.repeat([0.1, 3.0], [500, 3]))
    sim.size_classes.separators = (1.0,)
    sim.prepare()
    alone = divide(sim._scope.sizes, sim._scope.reach, ()).seconds
    assert f"s by the cost model, {alone:.2g} s with one class; it took" in str(sim.size_classes)
    sim.size_classes.separators = ()
    sim.prepare()
    assert "with one class" not in str(sim.size_classes)


def test_a_typo_is_told_of():
    with pytest.raises(AttributeError):
        cloud(np.ones(3)).size_classes.seperators = (1.0,)


def test_no_grains_at_all():
    sim = simulation(bc.Box((0, 0, 0), (1, 1, 1)))
    sim.run(2)
    assert sim.size_classes.choice.count.tolist() == [0]
