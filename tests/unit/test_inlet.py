"""Inlets: what is due comes, where it overlaps nobody, with the sizes of its distribution; what finds no place stays owed."""

from math import ceil, inf, pi

import numpy as np
import pytest
from scenes import NOTHING, simulation

import barchan as bc
from barchan.actions import Feed
from barchan.checkpoint import restore, save
from barchan.errors import SceneError
from barchan.packing import Exponential, LogNormal, Sieves, Uniform

SAND = Sieves([0.4, 0.6, 1.2], [0.0, 0.5, 1.0])
ONCE = bc.At(1)
quietly = pytest.mark.filterwarnings("ignore:.* found no free place")


def overlaps(sim):
    """Deepest overlap of two grains of a simulation on one rank [length], over all pairs."""
    place, radius = sim.grains.view("position"), sim.grains.view("radius")
    apart = np.sqrt((sim.box.difference(place[:, None], place[None]) ** 2).sum(axis=-1)) - radius[:, None] - radius
    return -apart[np.triu_indices(len(place), 1)].min()


def room(box=None):
    """An empty simulation in which grains fly on as if there were no contacts."""
    return simulation(box, properties=NOTHING)


def inlet(sim, region, *feed, due=ONCE, name="in", seed=5, **more):
    sim.actions.append(bc.Inlet(name, region, Feed(*feed, **more), due, seed))
    return sim


def note(sim, name="in"):
    return sim.notes["inlets"][name]


@quietly
@pytest.mark.parametrize("periodic", [(False, False, False), (True, True, False)], ids=["closed", "periodic"])
def test_new_grains_overlap_nobody(periodic):
    """Neither grains that are there, frozen ones too, nor walls, nor each other: as dense as chance makes it."""
    sim = room(bc.Box((0, 0, 0), (8, 8, 9), periodic))
    sim.add_wall(bc.Plane((0, 0, 0.5), (0, 0, 1)))
    sim.add_wall(bc.Plane((0, 0, 8), (0, 0, -2)))
    random = np.random.default_rng(2)
    sites = np.stack(np.meshgrid(*3 * [np.arange(1.0, 8.0, 2.0)], indexing="ij"), axis=-1).reshape(-1, 3)
    old = sim.add_grains(sites + random.uniform(-0.3, 0.3, sites.shape) * (1, 1, 0), 0.5, frozen=sites[:, 0] < 4)
    inlet(sim, ((0, 0, 0), (8, 8, 8)), SAND, inf, 3000)
    sim.run(1)
    assert overlaps(sim) <= 1e-12
    new = sim.grains.view("id") > old[-1]
    height, radius = sim.grains.view("position")[new, 2], sim.grains.view("radius")[new]
    assert (height - radius).min() >= 0.5 - 1e-12 and (height + radius).max() <= 8.0 + 1e-12
    solid = 4 / 3 * pi * (sim.grains.view("radius") ** 3).sum() / (8 * 8 * 7.5)
    assert 0.2 < solid < 0.385, "random sequential addition ends at 0.38 for equal spheres"
    close = np.abs(sim.grains.view("position")[:, 0] - 4.0) > 3.99 - sim.grains.view("radius")
    assert close.any(), "some reach over the faces"


def test_a_grain_beyond_a_periodic_face_is_in_the_way():
    for periodic, expected in ((True, 0), (False, 1)):
        sim = simulation(bc.Box((0, 0, 0), (10, 10, 10), (periodic, False, False)))
        sim.add_grains((9.7, 5, 5), 0.5)
        with pytest.warns(UserWarning, match="1 grain.* found no free place") if periodic else pytest.MonkeyPatch.context():
            inlet(sim, ((0.2, 5, 5), (0.2, 5, 5)), 0.5, inf, 1).run(1)
        assert note(sim)["grains"] == expected


def test_places_are_even_over_the_region():
    """Mean and variance of a uniform distribution, each within five standard errors; the region lies askew in the box."""
    low, high = np.array([2.0, 3.0, 4.0]), np.array([18.0, 9.0, 16.0])
    sim = inlet(room(), (low, high), 1e-3, inf, 2500)
    sim.run(1)
    place = (sim.grains.view("position") - low) / (high - low)
    assert place.shape == (2500, 3) and place.min() >= 0.0 and place.max() <= 1.0
    assert place.mean(axis=0) == pytest.approx(0.5, abs=5 * (1 / 12 / 2500) ** 0.5)
    assert place.var(axis=0) == pytest.approx(1 / 12, abs=5 * (1 / 180 / 2500) ** 0.5)
    assert np.abs(np.corrcoef(place.T) - np.eye(3)).max() < 5 * 2500**-0.5


def test_a_rate_in_numbers():
    """floor(rate t) from the first look on, until all are in."""
    sim = inlet(room(), ((1, 1, 1), (19, 19, 19)), 0.1, 250.0, 40, due=bc.Every(20, start=100))
    sim.run(99)
    assert "inlets" not in sim.notes
    for step in range(100, 400, 20):
        sim.run(step - sim.step_number)
        due = min(40, 250.0 * (step - 100) * 1e-3)
        assert sim.grains.n == note(sim)["grains"] == int(due + 1e-9), step
        assert note(sim)["owed"] == pytest.approx(due - int(due + 1e-9), abs=1e-9)


def test_a_rate_in_mass():
    """The mass that came is below what is due by less than the next grain."""
    sim = inlet(room(), ((1, 1, 1), (19, 19, 19)), SAND, 100.0, 9.0, due=bc.Every(10), by="mass", velocity=(0, 0, -1.5))
    masses = 4 / 3 * pi * SAND.radii(5, np.arange(1000)) ** 3
    for step in range(10, 200, 10):
        sim.run(10)
        due, came = min(9.0, 100.0 * (step - 10) * 1e-3), note(sim)["grains"]
        assert note(sim)["mass"] == pytest.approx(masses[:came].sum(), rel=1e-13)
        assert sim.grains.view("mass").sum() == pytest.approx(note(sim)["mass"], rel=1e-13)
        assert masses[:came].sum() <= due * (1 + 1e-9) and masses[: came + 1].sum() > due * (1 - 1e-9)
        assert note(sim)["owed"] == pytest.approx(due - note(sim)["mass"], abs=1e-9)
    assert np.array_equal(sim.grains.sorted_by_id("radius"), SAND.radii(5, np.arange(came)))
    assert (sim.grains.view("velocity") == (0, 0, -1.5)).all()


@pytest.mark.parametrize(
    "sizes",
    [Uniform(0.1, 0.4), Exponential(0.1, 0.1, 0.4), LogNormal(0.2, 0.3, 0.1, 0.4)],
    ids=lambda sizes: type(sizes).__name__,
)
def test_sizes_by_a_formula(sizes):
    """Grain number k has the radius number k, and the mass that comes is about that of as many grains of the mean volume."""
    sim = inlet(room(), ((1, 1, 1), (19, 19, 19)), sizes, inf, 500 * sizes.mean_volume, by="mass")
    sim.run(1)
    assert np.array_equal(sim.grains.sorted_by_id("radius"), sizes.radii(5, np.arange(sim.grains.n)))
    assert 400 < sim.grains.n < 600


def test_a_whole_number_of_equal_masses_comes_to_the_last_grain():
    mass = 4 / 3 * pi * 0.1**3
    sim = inlet(room(), ((1, 1, 1), (19, 19, 19)), 0.1, inf, 1537 * mass, by="mass")
    sim.run(1)
    assert sim.grains.n == 1537


@quietly
@pytest.mark.parametrize("radius", [0.31, 0.45])
def test_what_finds_no_place_comes_when_there_is_one(radius):
    """From one point, grains with speed v follow each other when the one before has moved by a diameter."""
    sim = inlet(room(), 2 * [(10, 10, 15)], radius, inf, 6, due=bc.Every(10), velocity=(0, 0, -4.0))
    came, grains = [], 0
    for _ in range(150):
        sim.run(10)
        assert note(sim)["grains"] + note(sim)["owed"] == 6 == note(sim)["grains"] + len(note(sim)["waiting"])
        came, grains = came + (note(sim)["grains"] - grains) * [sim.step_number], note(sim)["grains"]
    looks = ceil(2 * radius / (4.0 * 10e-3))
    assert came == [10 + 10 * looks * k for k in range(6)]
    assert note(sim)["waiting"] == [] and note(sim)["owed"] == 0.0


@quietly
def test_large_grains_are_not_passed_over_for_good():
    """Few trials succeed for the large grains, many for the small ones: in the end each number has come once."""
    sizes = Sieves([0.5, 0.6, 2.8, 3.0], [0.0, 0.1, 0.1, 1.0])
    sim = room()
    inlet(sim, ((3, 3, 16), (17, 17, 18)), sizes, inf, 90, due=bc.Every(50), velocity=(0, 0, -8.0))
    sim.max_overlap = inf
    sim.actions.append(bc.Outlet("below", (0, 0, 3), (0, 0, -1), bc.Every(10)))
    came = {}
    for _ in range(100):
        sim.run(20)
        came |= dict(zip(sim.grains.view("id").tolist(), sim.grains.view("radius").tolist()))
    assert note(sim)["grains"] == 90 and sorted(came) == list(range(90))
    assert sorted(came.values()) == sorted(sizes.radii(5, np.arange(90)).tolist())


def test_one_warning_tells_of_grains_that_wait():
    sim = inlet(simulation(), 2 * [(5, 5, 5)], 0.5, inf, 3, due=bc.Every(1))
    with pytest.warns(UserWarning) as told:
        sim.run(5)
    assert [str(one.message)[:59] for one in told] == ["step 1: inlet 'in': 2 grain(s) found no free place in 50 tr"]


@quietly
def test_a_resumed_inlet_goes_on_where_it_was(tmp_path):
    def begin():
        return inlet(simulation(dt=5e-4), ((1, 1, 1), (4, 4, 4)), SAND, 8000.0, 300, due=bc.Every(10), velocity=(9.0, 9.0, 9.0))

    straight = begin()
    straight.run(60)
    save(straight, tmp_path / "c.h5")
    assert note(straight)["waiting"] and note(straight)["drawn"] < 300, "a state worth keeping"
    straight.run(100)
    resumed = begin()
    restore(resumed, tmp_path / "c.h5")
    resumed.run(100)
    assert resumed.notes == straight.notes
    for name in ("id", "position", "radius", "velocity", "force"):
        assert np.array_equal(resumed.grains.sorted_by_id(name), straight.grains.sorted_by_id(name))


def test_inlets_of_different_names_try_different_places():
    sim = inlet(inlet(room(), ((1, 1, 1), (9, 9, 9)), 0.1, inf, 1), ((1, 1, 1), (9, 9, 9)), 0.1, inf, 1, name="other")
    sim.run(1)
    assert sim.grains.n == 2 and not np.isclose(*sim.grains.view("position")).any()


def test_a_scene_that_begins_empty_gets_its_skin_with_its_grains():
    sim = inlet(room(), ((1, 1, 1), (19, 19, 19)), 0.5, inf, 50, due=bc.At(3))
    sim.run(200)
    assert sim._scope.skin == 0.1 * 2 * 0.5


def test_a_time_step_above_that_of_new_grains_is_refused():
    """kn = 1000, density 1: 0.17 sqrt(m/k) of radius 0.5 is 3.9 ms, of radius 0.05 it is 0.12 ms; dt is 1 ms."""
    sim = inlet(simulation(), ((1, 1, 1), (19, 19, 19)), 0.05, inf, 5, due=bc.At(3))
    sim.add_grains((10, 10, 10), 0.5)
    with pytest.raises(SceneError, match=r"dt = 0.001 \[time\] is above the stable time step"):
        sim.run(5)


REGION = ((1, 1, 1), (9, 9, 9))


@pytest.mark.parametrize(
    ("region", "feed", "more", "message"),
    [
        (((1, 1, 1), (9, 0, 9)), Feed(0.1, 1.0, 5), {}, "region = .* low and a high corner"),
        (((1, 1), (9, 9)), Feed(0.1, 1.0, 5), {}, "region = "),
        (((1, 1, 1), (9, np.nan, 9)), Feed(0.1, 1.0, 5), {}, "region = "),
        ("here", Feed(0.1, 1.0, 5), {}, "region = 'here'"),
        (REGION, (0.1, 1.0, 5), {}, "feed = .* must be a barchan.actions.Feed"),
        (REGION, Feed(0.0, 1.0, 5), {}, "radius = 0.0"),
        (REGION, Feed([0.1, 0.2], 1.0, 5), {}, r"radius = \[0.1, 0.2\]"),
        (REGION, Feed(inf, 1.0, 5), {}, "radius = inf"),
        (REGION, Feed(0.1, 0.0, 5), {}, "rate = 0.0"),
        (REGION, Feed(0.1, np.nan, 5), {}, "rate = nan"),
        (REGION, Feed(0.1, 1.0, -5), {}, "total = -5"),
        (REGION, Feed(0.1, 1.0, True), {}, "total = True"),
        (REGION, Feed(0.1, inf, inf), {}, "rate and total cannot both be infinite"),
        (REGION, Feed(0.1, 1.0, 5, by="volume"), {}, "by = 'volume'"),
        (REGION, Feed(0.1, 1.0, 5, velocity=1.0), {}, "velocity = 1.0"),
        (REGION, Feed(0.1, 1.0, 5, velocity=(0, 0, inf)), {}, "velocity = "),
        (REGION, Feed(0.1, 1.0, 5), {"seed": -1}, "seed = -1"),
        (REGION, Feed(0.1, 1.0, 5), {"seed": 0.5}, "seed = 0.5"),
        (REGION, Feed(0.1, 1.0, 5), {"due": 10}, "due = 10 must be a trigger"),
    ],
)
def test_what_is_no_inlet_is_refused(region, feed, more, message):
    with pytest.raises(SceneError, match=rf"inlet 'in': {message}"):
        bc.Inlet("in", region, feed, **{"due": ONCE} | more)


def test_a_region_outside_the_box_is_refused():
    with pytest.raises(SceneError, match="reaches out of the box"):
        inlet(room(), ((1, 1, 1), (9, 9, 21)), 0.1, inf, 1).run(1)


def test_a_material_without_density_is_refused():
    air = bc.Material("air", kn=1.0, kt=1.0, friction=0.0)
    sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), bc.laws.linear, air, 1e-3)
    with pytest.raises(SceneError, match="inlet 'in': material 'air' has no density"):
        inlet(sim, REGION, 0.1, inf, 1).run(1)
