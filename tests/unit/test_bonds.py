"""Where bonds are put, what is told of them, and what is refused."""

import re
import warnings

import numpy as np
import pytest

import barchan as bc
from barchan.bonds import Weibull, cracks
from barchan.errors import BarchanError, LawError, MaterialError, NotFiniteError, RunError, SceneError
from barchan.measure import bond_table, fragments, stress, unbalanced_force
from barchan.parallel import virtual_ranks, world

GLUE = {"kn": 1e3, "ks": 5e2, "tensile_strength": 1e9, "shear_strength": 1e9}
KINDS = [bc.Bond(bc.laws.parallel_bond, "weak", **GLUE), bc.Bond(bc.laws.parallel_bond, "strong", **GLUE | {"kn": 2e3})]
STONE = {"density": 1.0, "kn": 1e3, "kt": 3e2, "gamma_n": 0.0, "gamma_t": 0.0, "friction": 0.4}


def empty(box=None, bonds=KINDS, **options):
    box = box or bc.Box((0, 0, 0), (8, 8, 8), (True, True, False))
    sim = bc.Simulation(box, bc.laws.linear, bc.Material("stone", **STONE), 1e-3, threads=1, bonds=bonds, **options)
    sim.max_overlap = np.inf
    return sim


def crowd(count=250, **options):
    """Grains at random places, some of which overlap."""
    sim, random = empty(**options), np.random.default_rng(4)
    sim.add_grains(random.uniform(0.5, 7.5, (count, 3)), random.uniform(0.3, 0.5, count))
    return sim


def close_pairs(sim, overlap):
    """Set of pairs of ids that overlap by more, from all distances."""
    position, radius = sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("radius")
    branch = sim.box.difference(position[:, None], position[None])
    depth = radius[:, None] + radius[None] - np.sqrt((branch**2).sum(axis=-1))
    return {(i, j) for i, j in np.argwhere(depth > overlap).tolist() if i < j}


def bonded(sim):
    table = bond_table(sim)
    return list(zip(table["first"].tolist(), table["second"].tolist()))


@pytest.fixture(autouse=True)
def deep_overlaps_are_meant():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("overlap", [0.0, 0.2, -0.3])
@pytest.mark.parametrize("ranks", [1, 3])
def test_pairs_that_overlap_by_more_are_bonded(overlap, ranks):
    """Each once, whoever owns its grains; below 0 also those that are near without touching, beyond the skin of the list."""
    expected = close_pairs(crowd(), overlap)

    def program():
        sim = crowd()
        count = sim.install_bonds(overlap)
        skin = sim.skin
        sim.run(0)
        return count, bonded(sim), skin

    for count, pairs, skin in virtual_ranks(ranks, program):
        assert len(pairs) == count == len(set(pairs)) > 40 and set(pairs) == expected
        assert skin is None, "as it was before"


def test_among_some_grains_and_not_twice():
    sim, some = crowd(), np.arange(0, 250, 2)
    expected = close_pairs(sim, 0.0)
    inside = {pair for pair in expected if pair[0] % 2 == 0 and pair[1] % 2 == 0}
    assert sim.install_bonds(among=some, kind="strong") == len(inside) > 10
    assert sim.install_bonds() == len(expected) - len(inside), "the others"
    assert sim.install_bonds() == 0
    sim.run(0)
    kinds = bond_table(sim)["kind"]
    assert set(bonded(sim)) == expected and np.count_nonzero(kinds == 1) == len(inside)


def test_a_kind_makes_its_bonds_stiffer():
    forces = []
    for kind in ("weak", 1):
        sim = empty()
        sim.add_grains([(2, 2, 2), (3, 2, 2)], 0.5, mass=1e30, velocity=[(0, 0, 0), (0.01, 0, 0)])
        sim.install_bonds(-1e-6, kind=kind)
        sim.run(10)
        forces.append(float(bond_table(sim)["force"][0, 0]))
    area = np.pi * 0.25
    assert forces == pytest.approx([1e3 * area * 1e-4, 2e3 * area * 1e-4], rel=1e-9)


def test_strengths_follow_a_distribution_whoever_owns_the_grains():
    def program():
        sim = crowd()
        sim.install_bonds(-0.3, strength=Weibull(3.0, seed=5))
        sim.run(0)
        return bond_table(sim)["strength"]

    alone, *_ = virtual_ranks(1, program)
    assert all(np.array_equal(alone, part) for part in virtual_ranks(3, program)) and len(np.unique(alone)) == len(alone)
    many = Weibull(3.0, seed=5)(np.arange(100_000), np.arange(100_000) + 7)
    assert many.mean() == pytest.approx(1.0, abs=0.01)
    assert many.std() == pytest.approx(0.3634, rel=0.02), "sqrt(Gamma(1 + 2/m) / Gamma(1 + 1/m)^2 - 1)"
    assert not np.array_equal(many, Weibull(3.0, seed=6)(np.arange(100_000), np.arange(100_000) + 7))


def test_a_stretched_periodic_chain_has_the_stress_of_its_bonds():
    """The force of the bonds over the cross-section of the box, on any number of ranks; the energy of as many springs."""

    def program():
        sim = empty(bc.Box((0, 0, 0), (8, 3, 3), (True,) * 3))
        place = np.stack([np.arange(8.0) + 0.5, np.full(8, 1.5), np.full(8, 1.5)], axis=1)
        sim.add_grains(place, 0.5, mass=1e30, velocity=np.outer((np.arange(8) - 3.5) * 0.01, (1.0, 0.0, 0.0)))
        assert sim.install_bonds(-1e-6) == 8
        sim.run(10)
        table = bond_table(sim)
        return stress(sim).contact, table["bond_normal_force"], table["energy"].sum(), table["distance"]

    for tensor, force, energy, distance in [*virtual_ranks(1, program), *virtual_ranks(3, program)]:
        stiffness, grown = 1e3 * np.pi * 0.25, 0.01 * 1e-3 * 10
        expected = -stiffness * np.append(np.full(7, grown), -7 * grown)
        assert sorted(force) == pytest.approx(sorted(expected), rel=1e-9)
        assert tensor[0, 0] == pytest.approx((force * distance).sum() / 72.0 + pressed(distance), rel=1e-9)
        assert energy == pytest.approx((force**2 / (2.0 * stiffness)).sum(), rel=1e-9)


def test_the_unbalanced_force_knows_bonds():
    """Two ends of a chain are pulled by the bonds with all that they carry: the mean over six grains of two resultants."""
    sim = empty(bc.Box((0, 0, 0), (9, 3, 3)))
    place = np.stack([np.arange(6.0) + 1.5, np.full(6, 1.5), np.full(6, 1.5)], axis=1)
    sim.add_grains(place, 0.5, mass=1e30, velocity=np.outer(np.arange(6) * 0.01, (1.0, 0.0, 0.0)))
    sim.install_bonds(-1e-6)
    sim.run(10)
    assert unbalanced_force(sim) == pytest.approx(2.0 / 6.0, rel=1e-9)


def pressed(distance):
    """Stress of the contact law in the one gap that was closed."""
    depth = np.maximum(1.0 - distance, 0.0)
    return (1e3 * depth * distance).sum() / 72.0


def test_fragments_are_the_connected_parts():
    def program():
        sim = crowd()
        sim.install_bonds()
        sim.run(0)
        return fragments(sim), bonded(sim), sim.grains.sorted_by_id("mass")

    parts = virtual_ranks(1, program) + virtual_ranks(3, program)
    found, pairs, mass = parts[0]
    label = np.arange(250)
    for _ in range(250):
        for a, b in pairs:
            label[[a, b]] = min(label[a], label[b])
    for root in np.unique(label):
        members = np.flatnonzero(label == root)
        number = found.of[members[0]]
        assert (found.of[members] == number).all() and found.grains[number] == len(members)
        assert found.mass[number] == pytest.approx(mass[members].sum())
    assert len(found.grains) == len(np.unique(label)) and (np.diff(found.mass) <= 0.0).all() and found.grains[0] > 3
    for other, *_ in parts[1:]:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(found, other))


def test_a_crack_is_told_once_with_its_place_and_energy():
    def program():
        brittle = bc.Bond(bc.laws.parallel_bond, **GLUE | {"tensile_strength": 10.0})
        sim = empty(bonds=brittle)
        sim.add_grains([(7.6, 2, 2), (0.8, 2, 2)], (0.5, 0.7), mass=1e30, velocity=[(-1.0, 0, 0), (0, 0, 0)])
        sim.install_bonds(-1e-6)
        sim.run(20)
        return cracks.table(sim), sim.bonds.holding.any(), sim.grains.view("force").copy()

    for told, holds, force in [*virtual_ranks(1, program), *virtual_ranks(2, program)]:
        assert not holds and (force == 0.0).all()
        row = {name: column.tolist() for name, column in told.items()}
        assert (row["step"], row["first"], row["second"], row["mode"]) == ([10], [0], [1], [1]), "10 / (1e3 * 1e-3) steps"
        assert row["x"][0] == pytest.approx(0.1 - 0.005) and row["nx"] == [-1.0] and row["time"][0] == pytest.approx(0.01)
        assert row["energy"][0] == pytest.approx(0.5 * 1e3 * np.pi * 0.25 * 0.01**2, rel=1e-9)


def test_bonds_in_a_plane_stay_in_it():
    sim = empty(bc.Box((0, 0), (9, 9)), shape="disc")
    place = np.stack([*np.meshgrid(np.arange(1.5, 7), np.arange(1.5, 7))], axis=-1).reshape(-1, 2)
    place = np.concatenate([place, np.zeros((len(place), 1))], axis=1)
    spin = np.zeros((len(place), 3))
    spin[:, 2] = np.random.default_rng(2).normal(size=len(place))
    sim.add_grains(place, 0.5, omega=spin)
    assert sim.install_bonds(-1e-6) == 60
    sim.run(200)
    grains = sim.grains
    assert (grains.position[:, 2] == 0.0).all() and (grains.omega[:, :2] == 0.0).all() and (grains.force[:, :2] != 0.0).any()


def test_a_time_step_too_long_for_the_bonds_is_refused():
    sim = empty(bonds=bc.Bond(bc.laws.parallel_bond, **GLUE | {"kn": 1e7}))
    sim.add_grains([(2, 2, 2), (3, 2, 2)], 0.5)
    sim.run(1)
    sim.install_bonds(-1e-6)
    with pytest.raises(SceneError, match="above the stable time step"):
        sim.run(1)
    sim.dt = 0.9 * 0.17 * np.sqrt(np.pi / 6.0 / (1e7 * np.pi / 4.0))
    sim.run(1)


def test_what_was_refused_leaves_no_trace():
    sim = crowd()
    with pytest.raises(SceneError, match="period along x"):
        sim.install_bonds(-5.0)
    assert sim.skin is None and not len(sim.bonds)
    sim.run(1)


def test_a_strength_that_one_rank_alone_finds_wrong_stops_all():
    """Of a pair of the first rank's, which the others do not hold."""

    def program():
        sim, said = crowd(), "nothing"
        sim.run(0)
        wrong = sim.comm.from_first(int(sim.grains.view("id").min()))
        try:
            sim.install_bonds(-0.1, strength=lambda first, second: np.where(first == wrong, -1.0, 1.0))
        except BarchanError as error:
            said = str(error)
        return sim.comm.all_gather(said), len(sim.bonds)

    for said, bonds in virtual_ranks(3, program):
        assert all("must be a finite number > 0" in text for text in said) and len(set(said)) > 1 and bonds == 0


def test_a_rank_on_which_nothing_moves_has_no_stable_time_step_of_its_own():
    sim = empty()
    sim.add_grains([(2, 2, 2), (3, 2, 2), (4, 2, 2)], 0.5)
    assert sim.install_bonds(-1e-6) == 2
    sim.freeze([0, 1, 2])
    sim.run(1)
    assert sim.stable_dt == np.inf


@bc.bond()
def string(stretch):
    """A bond of another law."""
    return -stretch, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0


WRONG = {
    "no kinds": (lambda: crowd(bonds=()).install_bonds(), "no kind of bond 0 in this scene; give the simulation some"),
    "name of a kind": (
        lambda: crowd().install_bonds(kind="glue"),
        "no kind of bond 'glue' in this scene; there are: weak, strong",
    ),
    "number of a kind": (lambda: crowd().install_bonds(kind=2), "no kind of bond 2"),
    "overlap": (lambda: crowd().install_bonds(float("nan")), "overlap = nan"),
    "a mask": (lambda: crowd().install_bonds(among=np.ones(250, dtype=bool)), "must be whole numbers (a mask goes"),
    "grains that are not there": (lambda: crowd().install_bonds(among=[3, 250]), "no grain has id [250]"),
    "strength": (lambda: crowd().install_bonds(strength=0.0), "strength = 0.0 must be a finite number > 0"),
    "strengths": (lambda: crowd().install_bonds(strength=lambda a, b: np.ones(3)), "one for each bond"),
    "near neighbours as far as a period": (lambda: crowd().install_bonds(-5.0), "period along x"),
    "what is no bond": (lambda: empty(bonds="glue"), "must be a barchan.Bond or a list of them"),
    "two of one name": (lambda: empty(bonds=[KINDS[0], KINDS[0]]), "each with a name of its own"),
    "modulus": (lambda: Weibull(0.0), "modulus = 0.0 must be a finite number >= 0.1"),
    "seed": (lambda: Weibull(2.0, seed=-1), "seed = -1 must be a whole number from 0 to below 2^64"),
    "seed too long": (lambda: Weibull(2.0, seed=2**64), "must be a whole number from 0"),
    "kinds of two laws": (lambda: empty(bonds=[KINDS[0], bc.Bond(string, "string")]), "all of one law"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_cannot_be_is_refused(what):
    do, message = WRONG[what]
    with pytest.raises(SceneError, match=re.escape(message)):
        do()


def test_kinds_are_checked():
    with pytest.raises(LawError, match="must be a bond law"):
        bc.Bond(bc.laws.linear, kn=1.0)
    with pytest.raises(MaterialError, match="bond 'a': law 'parallel_bond' knows no property 'kt'; known are: kn, ks, "):
        bc.Bond(bc.laws.parallel_bond, "a", **GLUE, kt=1.0)
    with pytest.raises(MaterialError, match=r"needs shear_strength \[force/length\^2\], which is not given"):
        bc.Bond(bc.laws.parallel_bond, "a", **{name: value for name, value in GLUE.items() if name != "shear_strength"})
    with pytest.raises(MaterialError, match=r"tensile_strength = 0\.0"):
        bc.Bond(bc.laws.parallel_bond, "a", **GLUE | {"tensile_strength": 0.0})


@pytest.mark.parametrize("skin", [None, 0.0, 1e-9, 2.5])
@pytest.mark.parametrize("speed", [2.0, 900.0])
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_bond_that_grows_to_half_a_period_ends_the_run(ranks, speed, skin):
    """In that very step, however far it was from it in the step before: from there on it would pull the grains together round the
    other side."""
    steps = int(np.floor((4.0 - 0.8) / (2e-3 * speed))) + 1

    def program():
        sim = empty(box=bc.Box((0, 0, 0), (8, 8, 8), (True, True, True)))
        sim.add_grains([[3.6, 4, 4], [4.4, 4, 4]], 0.4, mass=1e12, velocity=[[-speed, 0, 0], [speed, 0, 0]])
        sim.skin = skin
        assert sim.install_bonds(-1e-6) == 1
        message = rf"bond between grains 0 and 1, step {steps}, .*longer than half the period, in a box of \[8.0, 8.0, 8.0\]"
        with pytest.raises(RunError, match=message):
            sim.run(10_000)
        return sim.bonds.holding.all()

    assert all(virtual_ranks(ranks, program))


def chain(law, count=6, **options):
    """Grains in a row that part, bonded by a law without properties."""
    sim = empty(bonds=bc.Bond(law), **options)
    sim.add_grains([[1 + 0.8 * i, 4, 4] for i in range(count)], 0.4, velocity=[[0.1 * i, 0, 0] for i in range(count)])
    assert sim.install_bonds(-1e-6) == count - 1
    return sim


@pytest.mark.parametrize("mode", [-1, 255, 256, 0.5, float("nan"), 3, 254, 252])
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_mode_that_a_law_does_not_have_ends_the_run(mode, ranks):
    @bc.bond(history={"pull": 1}, modes=("torn", "sheared"))
    def wrong(stretch, pull):
        pull = pull + stretch
        return -pull, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (mode if pull > 1e-3 else 0), pull

    message = r"bond between grains \d and \d, step 1[01], .*law 'wrong' returned a mode that it has not; .* 1: torn, 2: sheared"

    def program():
        sim = chain(wrong)
        with pytest.raises(RunError, match=message):
            sim.run(100)
        return sim.bonds.holding.all()

    assert all(virtual_ranks(ranks, program))


def test_what_is_remembered_must_be_finite():
    @bc.bond(history={"pull": 1, "way": 3})
    def forgets(stretch, pull, way):
        pull = pull + stretch
        return -pull, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, pull, (0.0, (pull - pull) / (pull - 1e-3 if pull > 1e-3 else 1.0), 0.0)

    @bc.bond(history={"pull": 1})
    def overflows(stretch, pull):
        return -stretch, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, 1e300 * (pull + stretch)

    with pytest.raises(
        NotFiniteError, match=r"bond between grains .* what it remembers is not finite; look at bond law 'overflows'"
    ):
        chain(overflows).run(100)
    chain(forgets).run(100)


def test_energies_that_are_none_are_refused():
    def made(energy):
        @bc.bond(history={"pull": 1}, energy=energy)
        def string(stretch, pull):
            pull = pull + stretch
            return -pull, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1 if pull > 1e-3 else 0), pull

        return string

    def two(pull):
        return pull, pull

    def text(pull):
        return "much"

    def endless(pull):
        return 1.0 / (pull * pull)

    def late(pull):
        return 1.0 / (pull - pull) if pull > 1e-3 else 0.0

    for energy in (two, text, endless):
        with pytest.raises(LawError, match=r"bond law 'string': its energy\(\) must return one finite number"):
            chain(made(energy))
    with pytest.raises(NotFiniteError, match=r"bond law 'string': its energy\(\) is not finite for a bond that broke"):
        chain(made(late)).run(100)


def test_a_law_cannot_remember_by_a_name_of_the_table():
    for name in ("force", "energy", "kind", "point", "first"):
        with pytest.raises(LawError, match=f"history '{name}' is what every table of bonds tells"):

            @bc.bond(history={name: 1})
            def taken(stretch):
                return -stretch, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, 0.0


def test_a_table_of_no_bonds():
    sim = crowd()
    sim.run(1)
    table = bond_table(sim)
    assert len(table["first"]) == 0 and table["force"].shape == (0, 3)


@pytest.mark.parametrize("ranks", [1, 2])
def test_strengths_must_follow_from_the_ids(ranks):
    """Both owners of a bond ask for them."""

    def program():
        random = np.random.default_rng(world().rank)
        with pytest.raises(SceneError, match=r"strength\(\) returned other numbers .*Weibull, or draw them once by id"):
            crowd().install_bonds(strength=lambda first, second: random.uniform(0.5, 2.0, len(first)))
        with pytest.raises(SceneError, match=r"strength = .* must be a finite number > 0, or a function"):
            crowd().install_bonds(strength=[1.0, 2.0])
        return crowd().install_bonds(strength=lambda first, second: 1.0 + first.max() * 0.0)  # never asked for none

    assert min(virtual_ranks(ranks, program)) > 40


def test_far_too_much_is_refused():
    for overlap in (-1e300, -20.0, 1e9, np.nan):
        with pytest.raises(SceneError, match=r"install_bonds: overlap = .* no larger than the box is across, 13.8"):
            crowd().install_bonds(overlap)
    sim = crowd()
    sim.skin = 1e300
    with pytest.raises(SceneError, match=r"skin = 1e\+300 .* at most 1e\+50"):
        sim.run(1)
    for modulus in (0.0, 0.005, -1.0):
        with pytest.raises(SceneError, match=r"modulus = .* must be a finite number >= 0.1"):
            Weibull(modulus)
