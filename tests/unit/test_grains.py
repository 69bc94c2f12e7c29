"""State as NumPy arrays by field name: read without a trace, written and honoured, closed after a run."""

import numpy as np
import pytest
from scenes import NOTHING, fingerprint, pile, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.fields import PHYSICAL
from barchan.parallel import virtual_ranks, world

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]


def two_in_flight():
    sim = simulation(bc.Box((0, 0, 0), (10, 10, 10), (True, False, False)), properties=NOTHING)
    sim.add_grains([[1.0, 5.0, 5.0], [6.0, 5.0, 5.0]], 0.5)
    return sim


def test_reading_between_runs_changes_no_bit():
    plain, read = pile(), pile()
    for _ in range(4):
        plain.run(10)
        read.run(10)
        for field in read.grains.table:
            getattr(read.grains, field.name).sum()
        read.grains.row_of([3, 1])
    assert fingerprint(plain) == fingerprint(read)
    assert fingerprint(plain) != fingerprint(pile())


def test_writing_the_value_that_is_there_changes_no_bit():
    plain, written = pile(), pile()
    for sim in (plain, written):
        sim.run(20)
    written.grains.velocity[...] = written.grains.velocity.copy()
    written.grains.radius = written.grains.radius.copy()
    for sim in (plain, written):
        sim.run(20)
    assert fingerprint(plain) == fingerprint(written)


def test_a_written_velocity_moves_the_grain_in_the_next_run():
    sim = two_in_flight()
    sim.run(3)
    row = sim.grains.row_of(1)
    before = sim.grains.position[row].copy()
    sim.grains.velocity[row] = (0.0, 2.0, 0.0)
    sim.run(10)
    moved = sim.grains.position[sim.grains.row_of(1)] - before
    assert moved == pytest.approx([0.0, 10 * sim.dt * 2.0, 0.0], abs=1e-12)


def test_a_written_position_is_folded_and_makes_its_contacts_at_once():
    sim = simulation(bc.Box((0, 0, 0), (10, 10, 10), (True, False, False)))
    sim.add_grains([[1.0, 5.0, 5.0], [6.0, 5.0, 5.0]], 0.5)
    sim.run(3)
    assert not sim.grains.force.any()
    sim.grains.position[sim.grains.row_of(1)] = (10.0 + 1.98, 5.0, 5.0)
    sim.prepare()
    assert sim.grains.position[sim.grains.row_of(1)] == pytest.approx([1.98, 5.0, 5.0])
    assert sim.grains.image[sim.grains.row_of(1)].tolist() == [1, 0, 0]
    assert sim.grains.force[sim.grains.row_of(0), 0] == pytest.approx(-1000.0 * 0.02, rel=1e-9)


def test_a_written_radius_mass_or_material_is_used():
    def push(**edits):
        sim = simulation(properties={**NOTHING, "kn": 1000.0})
        sim.add_grains([[1.0, 5.0, 5.0], [1.99, 5.0, 5.0]], 0.5)
        sim.run(1)
        for name, value in edits.items():
            setattr(sim.grains, name, value)
        sim.prepare()
        return sim.grains.force[sim.grains.row_of(1), 0], sim.grains.inverse_mass[0]

    deeper, _ = push(radius=0.51)
    plain, inverse = push()
    assert deeper == pytest.approx(plain + 1000.0 * 0.02, rel=1e-6)
    assert push(mass=4.0)[1] == 0.25 != inverse


@pytest.mark.parametrize("name", PHYSICAL)
def test_each_physical_edit_equals_a_scene_that_was_so_from_the_start(name):
    """After the edit, forces are those of the new state, whatever was edited."""
    values = {
        "position": (5.2, 5.0, 5.0),
        "velocity": (0.3, 0.0, 0.0),
        "omega": (0.0, 0.0, 3.0),
        "radius": 0.55,
        "mass": 3.0,
        "inertia": 0.4,
        "material": 1,
        "frozen": 1,
    }

    def scene(edit):
        materials = [
            bc.Material("a", density=1.0, kn=1000.0, kt=300.0, gamma_n=9.0, gamma_t=5.0, friction=0.4),
            bc.Material("b", density=1.0, kn=3000.0, kt=100.0, gamma_n=1.0, gamma_t=1.0, friction=0.4),
        ]
        sim = bc.Simulation(bc.Box((0, 0, 0), (10, 10, 10)), bc.laws.linear, materials, 1e-3)
        sim.add_grains(
            [[5.0, 5.0, 5.0], [6.1, 5.0, 5.0], [5.5, 5.8, 5.0]],
            0.5,
            velocity=[[0.1, 0.2, 0.0], [0.0, 0.0, 0.0], [0.0, -0.1, 0.0]],
        )
        if edit == "before":
            getattr(sim.grains, name)[0] = values[name]
        sim.prepare()
        if edit == "after":
            getattr(sim.grains, name)[sim.grains.row_of(0)] = values[name]
        sim.run(1)
        return fingerprint(sim)

    assert scene("after") == scene("before") != scene(None)


def test_views_from_before_a_run_are_read_only_after_it():
    sim = pile()
    before = sim.grains.velocity
    before[0] = 0.0
    sim.run(1)
    with pytest.raises(ValueError, match="read-only"):
        before[0] = 1.0
    sim.grains.velocity[0] = 1.0  # taken anew, it may be written


@pytest.mark.parametrize(
    "change",
    [
        lambda sim: sim.add_grains([[1.0, 1.0, 5.5]], 0.3),
        lambda sim: sim.remove([0]),
        lambda sim: sim.freeze([0]),
        lambda sim: sim.add_field("colour"),
        lambda sim: sim.add_wall(bc.Plane((0, 0, 6), (0, 0, -1))),
    ],
)
def test_an_edit_just_before_a_change_of_the_scene_is_honoured_and_its_view_closed(change):
    sim = pile(count=5)
    view = sim.grains.velocity
    row = sim.grains.row_of(3)
    view[row] = (0.0, 0.0, 9.0)
    change(sim)
    assert sim.grains.velocity[sim.grains.row_of(3)].tolist() == [0.0, 0.0, 9.0]
    with pytest.raises(ValueError, match="read-only"):
        view[row] = 0.0


def test_ids_cannot_be_changed_and_keep_what_they_were():
    sim = two_in_flight()
    sim.run(1)
    ids = sorted(sim.grains.id.tolist())
    with pytest.raises(ValueError, match=r"ids are given by barchan|read-only"):
        sim.grains.id[0] = 99
        sim.run(1)
    sim.run(1)  # the refused edit does not come back by the next run
    assert sorted(sim.grains.id.tolist()) == ids


def test_a_field_that_does_not_exist_is_refused_with_those_that_do():
    sim = two_in_flight()
    with pytest.raises(AttributeError, match="no field 'colour'; they have: position, "):
        _ = sim.grains.colour
    with pytest.raises(SceneError, match=r"no field 'colour'.*Simulation.add_field\('colour'\)"):
        sim.grains.colour = 3


def test_row_of_finds_rows_by_id_in_any_shape():
    sim = pile()
    sim.run(30)
    ids = sim.grains.id
    assert ids.tolist() != sorted(ids.tolist()), "rows are sorted in space, not by id"
    wanted = np.array([[7, 0], [39, 7]])
    rows = sim.grains.row_of(wanted)
    assert rows.shape == (2, 2) and (ids[rows] == wanted).all()
    assert ids[sim.grains.row_of(5)] == 5


@pytest.mark.parametrize("wrong", [40, -1, [3, 99], [[1], [55]]])
def test_row_of_names_an_id_that_is_not_there(wrong):
    with pytest.raises(SceneError, match=r"no grain has id \[(40|-1|99|55)\] here; ids run from 0 to 39"):
        pile().grains.row_of(wrong)


def test_row_of_among_no_grains():
    with pytest.raises(SceneError, match="no grain has id"):
        simulation().grains.row_of(0)
    sim = two_in_flight()
    assert sim.grains.row_of(np.zeros(0, dtype=int)).shape == (0,)


def test_sorted_by_id_is_a_copy():
    sim = pile()
    sim.run(30)
    assert sim.grains.sorted_by_id("id").tolist() == list(range(40))
    sim.grains.sorted_by_id("velocity")[...] = 0.0
    assert sim.grains.velocity.any()


def label(sim, ids):
    """Fields that tell a grain by its values."""
    sim.add_field("colour", dtype=np.int32, default=-7)
    sim.add_field("tensor", width=3, dimension="force")
    mine = np.isin(sim.grains.id, ids)
    sim.grains.colour[mine] = 100 + sim.grains.id[mine]
    sim.grains.tensor[mine] = np.outer(sim.grains.id[mine], (1.0, -2.0, 0.5))


def assert_labelled(sim, n_labelled):
    ids = sim.grains.id
    old = ids < n_labelled
    assert (sim.grains.colour[old] == 100 + ids[old]).all() and (sim.grains.colour[~old] == -7).all()
    assert sim.grains.colour.dtype == np.int32
    assert (sim.grains.tensor == np.where(old[:, None], np.outer(ids, (1.0, -2.0, 0.5)), 0.0)).all()


def test_user_fields_survive_rebuilds_and_grains_added_later_have_defaults():
    sim = pile()
    label(sim, np.arange(40))
    sim.run(100)
    assert sim.staleness.rebuilds >= 2
    sim.add_grains([[3.0, 3.0, 5.0], [1.0, 1.0, 5.0]], 0.3)
    sim.remove([4, 17])
    sim.run(20)
    assert sim.grains.n == 40
    assert_labelled(sim, 40)


def test_user_fields_survive_when_the_arrays_grow():
    """Room for some rows is made in advance; many grains at once need more."""
    sim = simulation()
    sim.add_grains([[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [5.0, 1.0, 1.0]], 0.3)
    label(sim, np.arange(3))
    site = np.arange(500)
    sim.add_grains(np.stack([site % 10, site // 10 % 10, site // 100], axis=1) * 1.5 + 3.0, 0.3)
    sim.run(1)
    assert sim.grains.n == 503
    assert_labelled(sim, 3)


@pytest.mark.parametrize(("width", "dtype"), [(1, bool), (4, np.float64), (4, np.float32), (7, np.float64), (9, np.int16)])
def test_user_fields_of_any_size_follow_their_grains_over_rebuilds(width, dtype):
    """As rows of the library's own fields do, and those that are larger than any of these."""
    sim = pile()
    sim.add_field("tag", width=width, dtype=dtype)
    numbers = (np.arange(40)[:, None] * 5 + np.arange(width)).astype(dtype)
    sim.grains.tag = (numbers[sim.grains.id] if width > 1 else numbers[sim.grains.id, 0]).astype(dtype)
    before = sim.grains.id.copy()
    for _ in range(3):
        sim.run(50)
        assert np.array_equal(sim.grains.sorted_by_id("tag"), numbers if width > 1 else numbers[:, 0])
        assert np.array_equal(sim.grains.sorted_by_id("radius"), pile().grains.sorted_by_id("radius"))
    assert sim.staleness.rebuilds >= 3 and not np.array_equal(before, sim.grains.id), "rows have moved"


def test_user_fields_migrate_with_their_grains():
    def program():
        sim = pile()
        label(sim, np.arange(40))
        sim.grains.velocity[:, 2] -= 5.0  # the ranks share the box along z
        before = set(sim.grains.id.tolist())
        sim.run(150)
        assert_labelled(sim, 40)
        return before, set(sim.grains.id.tolist())

    parts = virtual_ranks(2, program)
    assert sum(len(after - before) for before, after in parts) > 0, "some grains changed their rank"
    assert sorted(grain for _, after in parts for grain in after) == list(range(40))


def test_an_edit_on_one_rank_is_honoured_on_all():
    """Only the owner of a grain can write it; the others must join in to compute the forces anew."""

    def program():
        sim = pile()
        sim.run(10)
        mine = sim.grains.id == 3
        sim.grains.velocity[mine] = (0.5, 0.0, 2.0)
        sim.run(30)
        state = sim.comm.all_gather((sim.grains.view("id").copy(), sim.grains.view("position").copy()))
        ids, position = (np.concatenate(part) for part in zip(*state))
        return position[np.argsort(ids)].tobytes(), len(mine), world().size

    alone = program()
    for parts in (virtual_ranks(2, program), virtual_ranks(3, program)):
        assert {state for state, _, _ in parts} == {alone[0]}
        assert sum(own for _, own, _ in parts) == 40


@pytest.mark.parametrize("name", ["position", "n", "row_of", "two words", "_blocks", "_mine", "class", 3])
def test_a_user_field_needs_a_name_of_its_own(name):
    with pytest.raises(SceneError, match=f"field {name!r}: the name must be"):
        pile().add_field(name)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"width": 0}, "width = 0 must be a whole number >= 1"),
        ({"width": 1.5}, "width = 1.5 must be"),
        ({"width": "3"}, "width = '3' must be"),
        ({"width": True}, "width = True must be"),
        ({"dtype": "text"}, "dtype = 'text' must be a type of numbers"),
        ({"dtype": str}, "dtype = <class 'str'> must be"),
        ({"dtype": complex}, "dtype = <class 'complex'> must be"),
        ({"dtype": object}, "dtype = <class 'object'> must be"),
        ({"default": "hot"}, "default = 'hot' must be one finite number that fits float64"),
        ({"default": (1.0, 2.0)}, r"default = \(1.0, 2.0\) must be one"),
        ({"default": np.nan}, "default = nan must be one finite"),
        ({"default": 10**400}, "default = 1000.* must be one finite"),
        ({"dtype": np.int32, "default": 0.5}, "default = 0.5 must be one finite number that fits int32"),
        ({"dtype": np.uint8, "default": 300}, "default = 300 must be one finite number that fits uint8"),
        ({"dtype": np.float32, "default": 1e300}, "default = 1e[+]300 must be one finite number that fits float32"),
        ({"dimension": "temprature"}, "dimension 'temprature' has 'temprature' in it; did you mean 'temperature'"),
    ],
)
def test_what_is_no_field_is_refused_and_nothing_is_added(options, message):
    sim = pile(count=5)
    with pytest.raises(SceneError, match=f"^field 'heat': {message}"):
        sim.add_field("heat", **options)
    assert "heat" not in [field.name for field in sim.grains.table]
    sim.add_field("heat", width=np.int64(2), dtype="int16", default=-3, dimension="energy/temperature")
    assert sim.grains.heat.tolist() == [[-3, -3]] * 5


def test_inertia_follows_an_edit_of_radius_or_mass():
    """That of a solid sphere, for the grains that were edited; the others keep what they were given."""
    sim = simulation()
    sim.add_grains([[2, 2, 2], [5, 5, 5], [8, 8, 8]], 0.5, mass=1.0, inertia=0.2)
    sim.grains.radius[0] = 0.25
    sim.prepare()
    assert sim.grains.sorted_by_id("inertia").tolist() == [0.4 * 0.25**2, 0.2, 0.2]
    assert sim.grains.sorted_by_id("mass").tolist() == [1.0] * 3, "the mass stays"
    sim.grains.mass[sim.grains.row_of(1)] = 3.0
    sim.run(1)
    assert sim.grains.sorted_by_id("inertia").tolist() == [0.4 * 0.25**2, 0.4 * 3.0 * 0.25, 0.2]
    assert sim.grains.inverse_inertia == pytest.approx(1.0 / sim.grains.inertia)


def test_an_inertia_that_is_edited_beside_the_mass_is_kept():
    sim = simulation()
    sim.add_grains([[2, 2, 2], [5, 5, 5]], 0.5)
    sim.grains.mass = 2.0
    sim.grains.inertia[0] = 0.7
    sim.prepare()
    assert sim.grains.sorted_by_id("inertia").tolist() == [0.7, 0.4 * 2.0 * 0.25]
