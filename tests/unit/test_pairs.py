"""The neighbour list against a look at every pair: none missed, none twice, the smaller id first, on any number of ranks."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from neighbours import (
    SHORTEST,
    assert_its_lists_are_right,
    grids_of,
    listed_pairs,
    make,
    surface_distances,
)
from scenes import NOTHING, simulation

import barchan as bc
from barchan.kernels import cells
from barchan.kernels.lanes import LANES
from barchan.parallel import virtual_ranks, world

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

PERIODS = st.sampled_from([SHORTEST, 2.3, 2.999, 3.0, 4.7])
OPEN_EDGES = st.sampled_from([0.2, 1.0, 1.7, 3.0, 6.0])

#: Radii that cut the grains, of at most 1, into size classes; None leaves the choice to the cost model.
SEPARATORS = st.sampled_from([None, (), (0.5,), (0.05,), (0.1, 0.3, 0.6), (0.002, 0.01, 0.05, 0.3, 0.9)])


@st.composite
def scenes(draw):
    """A gas of grains that hardly feel each other: radii, places, velocities, box, skin and some immobile grains."""
    periodic = draw(st.tuples(st.booleans(), st.booleans(), st.booleans()))
    count, ratio = draw(st.integers(1, 60)), draw(st.sampled_from([1.0, 1.5, 4.0, 10.0, 100.0, 1000.0]))
    skin, edges = draw(st.sampled_from([0.02, 0.2, 1.0])), [draw(PERIODS if p else OPEN_EDGES) for p in periodic]
    frozen_part, separators = draw(st.sampled_from([0.0, 0.3])), draw(SEPARATORS)
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    radius = np.exp(rng.uniform(-np.log(ratio), 0.0, count))
    largest = radius.max()
    low = rng.uniform(-5.0, 5.0, 3)
    box = bc.Box(low, low + np.array(edges) * (2.0 * largest + skin), periodic)
    return {
        "box": box,
        "skin": skin,
        "radius": radius,
        "position": low + rng.random((count, 3)) * box.length,
        "velocity": rng.normal(size=(count, 3)),
        "frozen": rng.random(count) < frozen_part,
        "separators": separators,
        "sparse": draw(st.booleans()),
    }


@pytest.mark.parametrize("ranks", [1, 2, 3])
@given(scene=scenes())
@settings(max_examples=60)
def test_the_list_holds_exactly_the_pairs_within_the_skin(ranks, scene):
    assert_its_lists_are_right(ranks, scene)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("axis", range(3), ids="xyz")
@pytest.mark.parametrize("edge", [SHORTEST, 2.6, 3.0, 3.6, 4.7, 9.5])
def test_no_pair_is_missed_across_the_end_of_a_period(edge, axis, ranks, monkeypatch):
    """Crowded boxes, in which hardly a pair of neighbouring cells has no pair of grains: a run of cells that is cut off too early
    at the end of a period shows (scenes drawn at random are too empty for that). So does a wrong number of a cell in a box so
    wide that it has several strips: here of 4 lines, the last of 1 or 2."""
    monkeypatch.setattr(cells, "LAYER", 1.0)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        edges, count, skin = np.full(3, 2.3), int(52 * edge), 0.2
        edges[axis] = edge
        scene = {"box": bc.Box((0, 0, 0), edges * (1.0 + skin), (True, True, True)), "skin": skin, "radius": np.full(count, 0.5)}
        scene |= {"position": rng.random((count, 3)) * scene["box"].length, "velocity": np.zeros((count, 3))}
        scene |= {"frozen": np.zeros(count, dtype=bool), "separators": None, "sparse": seed > 1}
        assert_its_lists_are_right(ranks, scene)


@pytest.mark.parametrize("ranks", [1, 2, 3])
@given(scene=scenes())
@settings(max_examples=25)
def test_no_touching_pair_is_missed_between_rebuilds(ranks, scene):
    """The same after every step of a flight: the list may be old, but it holds all pairs that touch by now."""
    scene["box"] = bc.Box(scene["box"].low, scene["box"].high, (True, True, True))
    cutoff = 2.0 * scene["radius"].max() + scene["skin"]
    if (scene["box"].length < SHORTEST * cutoff).any():  # widen the directions that had no period
        edges = np.maximum(scene["box"].length, SHORTEST * cutoff)
        scene["box"] = bc.Box(scene["box"].low, scene["box"].low + edges, (True, True, True))

    def program():
        sim, seen = make(scene), []
        for _ in range(12):
            sim.run(1)
            pairs, own = listed_pairs(sim)
            places = dict(zip(sim.grains.view("id").tolist(), sim.grains.view("position").tolist()))
            seen.append((pairs, own, places))
        return seen

    frozen = scene["frozen"]
    with grids_of(scene):
        steps = zip(*virtual_ranks(ranks, program))
    for parts in steps:
        places = {grain: place for _, _, part in parts for grain, place in part.items()}
        position = np.array([places[grain] for grain in sorted(places)]).reshape(-1, 3)
        gap = surface_distances(scene["box"], position, scene["radius"])
        touching = {(i, j) for i, j in np.argwhere(gap < 0.0).tolist() if i < j and not (frozen[i] and frozen[j])}
        for pairs, own, _ in parts:
            concerned = {(i, j) for i, j in touching if i in own or j in own}
            assert concerned <= set(pairs), f"missed: {concerned - set(pairs)}"


@given(st.integers(0, 10**6))
@example(0)
@settings(max_examples=10)
def test_the_list_grows_when_a_grain_has_many_neighbours(seed):
    """One big grain among hundreds of small ones overflows the room that rows start with; the search is done again."""
    rng = np.random.default_rng(seed)
    sim = simulation(bc.Box((0, 0, 0), (10, 10, 10)), properties=NOTHING)
    sim.skin, sim.max_overlap, sim.check_dt = 0.3, 1e9, False
    direction = rng.normal(size=(200, 3))
    around = 5.0 + direction / np.linalg.norm(direction, axis=1)[:, None] * 2.2
    sim.add_grains([[5.0, 5.0, 5.0]], 2.0)
    sim.add_grains(around, 0.1)
    sim.prepare()
    pairs, _ = listed_pairs(sim)
    assert {(0, j) for j in range(1, 201)} <= set(pairs)
    assert sorted(set(pairs)) == sorted(pairs)


@pytest.mark.parametrize("radius", [0.9, 4.0], ids=["about ten contacts a grain", "all with all"])
@pytest.mark.parametrize("rebuilt", [False, True], ids=["ordered anew", "order carried over"])
def test_contacts_that_touch_are_in_ascending_order_of_the_partners_key(radius, rebuilt):
    """The order of a grain's sum: walls first (negative keys), then ids; it may not depend on rows. Few contacts are sorted in
    one way, many in another. All contacts are listed once for each of their grains, whether they touch or not."""
    rng = np.random.default_rng(4)
    sim = simulation(bc.Box((0, 0, 0), (5, 5, 5)), properties=NOTHING)
    sim.skin, sim.max_overlap, sim.check_dt = 1.0, 1e9, False
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_wall(bc.Plane((0, 0, 5), (0, 0, -1)))
    sim.add_grains(rng.uniform(0, 5, (50, 3)), radius, velocity=rng.normal(size=(50, 3)))
    sim.run(20)  # contacts begin and end
    if rebuilt:
        sim.rebuild()
    contacts, ids = sim.contacts, sim.grains.view("id")
    seen = touching = 0
    for row in range(sim.grains.n):
        entries = contacts.incidence[contacts.start[row] : contacts.start[row + 1]].astype(int)
        keys = []
        for entry in entries:
            k, side = entry >> 1, entry & 1
            if k < contacts.n_pairs:
                members = (contacts.first[k], contacts.second[k])
                assert members[side] == row
                keys.append(ids[members[1 - side]])
            else:
                assert side == 0 and contacts.wall_grain[k - contacts.n_pairs] == row
                keys.append(contacts.wall_key[k - contacts.n_pairs])
        has_column = [bool(contacts.slot[entry >> 1]) for entry in entries]
        count = contacts.touched[row]
        assert has_column == [True] * count + [False] * (len(entries) - count), "those that touch come first"
        assert keys[:count] == sorted(keys[:count]) and len(set(keys)) == len(keys)
        seen, touching = seen + len(entries), touching + count
    assert seen == 2 * contacts.n_pairs + len(contacts.wall_grain) > 100
    assert (touching > 100 and touching < seen) or radius == 4.0


@pytest.mark.parametrize("count", [1, 2, 7, 300])
def test_there_is_memory_beside_the_last_candidate(count):
    """Eight candidates are looked at together, also where fewer are left."""
    sim = simulation(bc.Box((0, 0, 0), (5, 5, 5)), properties=NOTHING)
    sim.skin, sim.max_overlap, sim.check_dt = 1.0, 1e9, False
    sim.add_grains(np.random.default_rng(count).uniform(0, 5, (count, 3)), 0.3)
    sim.prepare()
    contacts = sim.contacts
    for name in ("first", "second", "slot"):
        assert len(contacts._lists._arrays[name]) >= len(getattr(contacts, name)) + LANES
    assert contacts.seen.shape[1] >= count + LANES


def test_a_grain_with_many_contacts_remembers_them_all_over_a_rebuild():
    """A big grain pressed by 100 small ones that slide on it: more contacts than are taken off the list at a time."""
    rng = np.random.default_rng(5)
    sim = simulation(bc.Box((0, 0, 0), (10, 10, 10)), dt=1e-4)
    direction = rng.normal(size=(100, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    sim.add_grains([[5.0, 5.0, 5.0]], 2.0, omega=(0.0, 0.0, 1.0))
    sim.add_grains(5.0 + direction * 2.09, 0.1)
    sim.max_overlap = 1e9
    sim.run(5)

    def memory():
        contacts, ids = sim.contacts, sim.grains.view("id")
        pairs = zip(ids[contacts.first].tolist(), ids[contacts.second].tolist())
        return dict(zip(pairs, contacts.memory().T.tolist()))

    before = memory()
    sim.rebuild()
    assert memory() == before
    assert sum(first == 0 and any(values) for (first, _), values in before.items()) > 64


@pytest.mark.parametrize("ratio", [1.0, 8.0])
def test_a_ghost_is_what_an_owned_grain_may_touch_and_no_other(ratio):
    """Of the layer along the border that a search looks at, ranks go on sending what it has found."""
    rng = np.random.default_rng(8)
    position, radius = rng.uniform(0, 8, (1200, 3)), np.where(np.arange(1200) < 8, 0.2 * ratio, 0.2)
    frozen = np.arange(1200) % 7 == 3

    def program():
        sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True,) * 3), properties=NOTHING)
        sim.skin, sim.max_overlap, sim.check_dt = 0.2, 1e9, False
        sim.size_classes.separators = (0.3,) if ratio > 1.0 else ()
        sim.add_grains(position, radius, frozen=frozen)
        sim.prepare()
        own, n = set(sim.grains.view("id").tolist()), sim.grains.n
        return own, sim.grains.view("id", ghosts=True)[n:].tolist(), sim.ghosts.get.n_received, sim.size_classes.ghosts.sum()

    gap = surface_distances(bc.Box((0, 0, 0), (8, 8, 8), (True,) * 3), position, radius)
    near = (gap < 0.2) & ~(frozen[:, None] & frozen[None, :])
    for own, ghosts, received, told in virtual_ranks(3, program):
        mine = np.isin(np.arange(1200), list(own))
        assert sorted(ghosts) == np.flatnonzero(~mine & near[mine].any(axis=0)).tolist()
        assert len(ghosts) == received == told > 20


def test_each_virtual_rank_of_the_tests_above_has_work():
    """Otherwise the tests on two and three ranks would be tests of one."""

    def program():
        rng = np.random.default_rng(1)
        sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True,) * 3), properties=NOTHING)
        sim.skin, sim.max_overlap, sim.check_dt = 0.2, 1e9, False
        sim.add_grains(rng.uniform(0, 8, (60, 3)), 0.5)
        sim.prepare()
        return world().rank, sim.grains.n, sim.grains.n_ghost

    for ranks in (2, 3):
        parts = virtual_ranks(ranks, program)
        assert [rank for rank, _, _ in parts] == list(range(ranks))
        assert all(own > 5 and ghosts > 1 for _, own, ghosts in parts) and sum(own for _, own, _ in parts) == 60
