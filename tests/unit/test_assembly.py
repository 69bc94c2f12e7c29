"""Grains and walls put in, taken out, frozen and released between runs."""

import warnings

import numpy as np
import pytest
from scenes import NOTHING, fingerprint, pile, simulation

import barchan as bc
from barchan.errors import MaterialError, SceneError
from barchan.measure import contact_table
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]


def test_mass_and_inertia_are_those_of_a_sphere_of_the_material():
    sim = simulation()
    sim.add_grains([[1, 1, 1], [4, 4, 4]], [0.5, 1.0])
    assert sim.grains.mass.tolist() == pytest.approx([np.pi / 6.0, 4.0 * np.pi / 3.0])
    assert sim.grains.inertia.tolist() == pytest.approx([0.4 * np.pi / 6.0 * 0.25, 0.4 * 4.0 * np.pi / 3.0])
    sim.add_grains([[7, 7, 7]], 1.0, mass=10.0)
    assert (sim.grains.mass[2], sim.grains.inertia[2]) == (10.0, 4.0)


def test_ids_count_up_and_are_never_used_again():
    sim = simulation()
    assert sim.add_grains([[1, 1, 1], [4, 4, 4]], 0.5).tolist() == [0, 1]
    sim.remove([1])
    assert sim.add_grains([[7, 7, 7]], 0.5).tolist() == [2]
    sim.run(2)
    sim.remove([0, 2])
    sim.run(1)
    assert sim.add_grains(np.zeros((0, 3)), 0.5).tolist() == []
    assert sim.add_grains([1.0, 1.0, 1.0], 0.5).tolist() == [3], "one point may be given as three numbers"
    assert sim.grains.id.tolist() == [3]


def test_ids_are_the_same_for_any_number_of_ranks():
    def program():
        sim = simulation(bc.Box((0, 0, 0), (8, 8, 8)))
        first = sim.add_grains([[1, 1, 1], [7, 7, 7], [1, 7, 1]], 0.5)
        sim.remove([1])
        second = sim.add_grains([[7, 1, 7], [4.1, 4.1, 4.1]], 0.5)
        sim.run(1)
        return first.tolist(), second.tolist(), sorted(sim.grains.id.tolist())

    parts = virtual_ranks(3, program)
    assert all(part[:2] == ([0, 1, 2], [3, 4]) for part in parts)
    assert sorted(grain for *_, own in parts for grain in own) == [0, 2, 3, 4], "each grain lives on one rank"


def test_positions_beyond_a_periodic_face_are_folded_and_their_image_kept():
    sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True, False, False)))
    sim.add_grains([[17.0, 1, 1], [-1.0, 4, 4]], 0.5)
    assert sim.grains.position[:, 0].tolist() == [1.0, 7.0]
    assert sim.grains.image[:, 0].tolist() == [2, -1]


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_a_position_that_is_not_finite_is_told_as_it_was_given(value):
    sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True, False, False)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.add_grains([[value, 1, 1]], 0.5)
    assert repr(float(sim.grains.position[0, 0])) == repr(float(value))


def test_a_grain_added_between_runs_is_felt_in_the_next_step():
    sim = simulation()
    sim.add_grains([[5, 5, 5]], 0.5)
    sim.run(5)
    sim.add_grains([[5.98, 5, 5]], 0.5)
    sim.run(1)  # v <- v + dt F(n)/m with the force of the new contact
    assert sim.grains.velocity[sim.grains.row_of(0), 0] == pytest.approx(-1000.0 * 0.02 * 1e-3 / (np.pi / 6.0), rel=1e-9)


def test_removing_a_grain_ends_its_contacts_and_no_others():
    sim = simulation()
    sim.add_grains([[5, 5, 5], [5.98, 5, 5], [6.96, 5, 5]], 0.5, velocity=[[0, 1.0, 0], [0, 0, 0], [0, 2.0, 0]])
    sim.run(4)
    before = contact_table(sim)
    sim.remove([0])
    sim.prepare()
    after = contact_table(sim)
    assert list(zip(before["first"], before["second"])) == [(0, 1), (1, 2)]
    assert list(zip(after["first"], after["second"])) == [(1, 2)]
    assert after["memory"][0].tolist() == before["memory"][1].tolist() != [0.0, 0.0, 0.0]


def test_all_that_stays_survives_adding_and_removing():
    sim = pile()
    sim.run(30)
    kept = {name: sim.grains.sorted_by_id(name) for name in ("position", "velocity", "omega", "radius", "image")}
    memory = contact_table(sim)["memory"]
    ids = sim.add_grains([[3.0, 3.0, 5.4], [1.0, 1.0, 5.4]], 0.3)
    sim.remove(ids)
    sim.prepare()
    assert all((sim.grains.sorted_by_id(name) == values).all() for name, values in kept.items())
    assert contact_table(sim)["memory"] == pytest.approx(memory, rel=1e-12, abs=1e-15)


def test_a_frozen_grain_stays_where_it_is_and_counts_as_infinitely_heavy():
    sim = simulation(gravity=(0, 0, -5.0))
    sim.add_grains([[5, 5, 5], [5.98, 5, 5], [9, 9, 9]], 0.5, velocity=(0, 0, 1.0), omega=(1.0, 0, 0))
    sim.run(2)
    place = sim.grains.position[sim.grains.row_of([1, 2])].copy()
    sim.freeze([1, 2])
    sim.run(50)
    rows = sim.grains.row_of([1, 2])
    assert (sim.grains.position[rows] == place).all()
    assert not sim.grains.velocity[rows].any() and not sim.grains.omega[rows].any()
    assert not sim.grains.inverse_mass[rows].any() and (sim.grains.mass[rows] > 0.0).all()
    assert sim.grains.velocity[sim.grains.row_of(0), 0] < 0.0, "the other one is pushed away"


def test_two_frozen_grains_feel_nothing_of_each_other():
    sim = simulation()
    sim.add_grains([[5, 5, 5], [5.9, 5, 5]], 0.5, frozen=True)
    sim.run(1)
    assert not sim.grains.force.any() and len(contact_table(sim)["first"]) == 0


def test_a_frozen_grain_with_a_velocity_moves_as_told():
    sim = simulation(gravity=(0, 0, -5.0))
    sim.add_grains([[5, 5, 5], [5, 5, 5.98]], 0.5, frozen=[True, False], velocity=[[1.0, 0, 0], [0, 0, 0]])
    sim.run(40)
    row = sim.grains.row_of(0)
    assert sim.grains.position[row] == pytest.approx([5.04, 5, 5], rel=1e-12)
    assert sim.grains.velocity[row].tolist() == [1.0, 0.0, 0.0]


def test_a_released_grain_falls_again():
    sim = simulation(gravity=(0, 0, -5.0))
    ids = sim.add_grains([[5, 5, 5], [8, 8, 8]], 0.5, frozen=True)
    sim.run(5)
    sim.release(ids[:1])
    sim.run(5)
    fell, stayed = sim.grains.velocity[sim.grains.row_of([0, 1])]
    assert fell == pytest.approx([0, 0, -5 * 5.0e-3], rel=1e-12)
    assert not stayed.any()


@pytest.mark.parametrize("call", ["remove", "freeze", "release"])
def test_an_id_that_does_not_exist_is_an_error(call):
    """Nothing is silent: a typo in an id must not leave the scene as it was."""
    sim = pile(count=5)
    with pytest.raises(SceneError, match="77"):
        getattr(sim, call)([2, 77])
    assert sim.grains.n == 5 and not sim.grains.frozen.any(), "nothing was done by halves"


def test_ids_that_are_refused_are_refused_on_all_ranks_only_if_no_rank_has_them():
    def program():
        sim = pile()
        sim.freeze([0, 39])  # they live on different ranks; each rank has only some of the ids
        sim.run(1)
        return sim.grains.id[sim.grains.frozen == 1].tolist()

    assert sorted(grain for own in virtual_ranks(3, program) for grain in own) == [0, 39]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"position": [[1, 1]]}, r"position has shape \(1, 2\); it must be \(grains, 3\)"),
        ({"position": [[[1, 1, 1]]]}, r"position has shape \(1, 1, 3\)"),
        ({"radius": [0.5, 0.4, 0.3]}, r"radius = \[0.5, 0.4, 0.3\] does not fit 2 grains"),
        ({"velocity": [1.0, 2.0]}, r"velocity = \[1.0, 2.0\] does not fit 2 grains"),
        ({"colour": 3}, "no field 'colour'; known are: position, "),
        ({"masss": 3}, r"no field 'masss'; did you mean 'mass'\?"),
        ({"radius": np.linspace(0.1, 0.2, 500)}, r"radius = array\(\[.{60,80}\.\.\. does not fit 2 grains"),
        ({"material": ["a", "b"]}, "no material 'b' in this scene; there are: a"),
        ({"material": ["a"] * 3}, r"material = \[0, 0, 0\] does not fit 2 grains"),
        ({"material": [["a", "a"]]}, r"material = \[\['a', 'a'\]\] must be a name, a number, or one for each grain"),
        ({"mass": "heavy"}, "mass = 'heavy' does not fit"),
        ({"id": [7, 7]}, "id"),
    ],
)
def test_grains_that_do_not_fit_are_refused_and_nothing_is_added(given, message):
    sim = simulation()
    sim.add_grains([[9, 9, 9]], 0.5)
    with pytest.raises(SceneError, match=message):
        sim.add_grains(**{"position": [[1, 1, 1], [3, 3, 3]], "radius": 0.5, **given})
    assert sim.grains.n == 1 and sim.next_id == 1


def test_a_material_without_density_needs_a_mass():
    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, bc.Material("ghost", **NOTHING), 1e-3)
    with pytest.raises(SceneError, match="material 'ghost' has no density; give it one, or give mass"):
        sim.add_grains([[1, 1, 1]], 0.5)
    sim.add_grains([[1, 1, 1]], 0.5, mass=2.0)
    assert sim.grains.mass.tolist() == [2.0]
    with pytest.raises(MaterialError, match="no material 'wood' in this scene; there are: ghost"):
        sim.add_grains([[3, 3, 3]], 0.5, material="wood", mass=1.0)


def test_walls_have_keys_of_their_own_and_refuse_unknown_materials():
    sim = simulation()
    walls = [sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1))), sim.add_wall(bc.Plane((0, 0, 0), (1, 0, 0), material="a"))]
    assert [wall.key for wall in walls] == [-1, -2]
    with pytest.raises(MaterialError, match="no material 'wood'"):
        sim.add_wall(bc.Plane((0, 0, 0), (0, 1, 0), material="wood"))
    assert len(sim.walls) == 2


def test_a_wall_cannot_be_added_twice():
    """It would move twice in every step."""
    sim = simulation()
    wall = sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1), velocity=(0, 0, 1.0)))
    with pytest.raises(SceneError, match="wall"):
        sim.add_wall(wall)


def test_a_wall_that_leans_into_a_period_is_refused():
    sim = simulation(bc.Box((0, 0, 0), (9, 9, 9), (True, False, False)))
    with pytest.raises(SceneError, match=r"wall 0 \(plane\): its normal .* leans along x, where the box is periodic"):
        sim.add_wall(bc.Plane((0, 0, 0), (0.1, 0, 1)))


def test_a_wall_added_between_runs_is_felt_in_the_next_step():
    sim = simulation()
    sim.add_grains([[5, 5, 0.48]], 0.5)
    sim.run(5)
    assert not sim.grains.velocity.any()
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.run(1)
    assert sim.grains.velocity[0, 2] == pytest.approx(1000.0 * 0.02 * 1e-3 / (np.pi / 6.0), rel=1e-9)


def test_order_of_adding_does_not_matter_but_for_the_ids():
    """One call or several: the same ids, the same bits."""

    def scene(parts):
        rng = np.random.default_rng(2)
        position, velocity = rng.uniform(2, 5, (12, 3)), rng.normal(size=(12, 3))
        sim = simulation(properties=NOTHING)
        sim.max_overlap = 1e9
        for rows in np.split(np.arange(12), parts):
            sim.add_grains(position[rows], 0.5, velocity=velocity[rows])
        sim.run(20)
        return fingerprint(sim)

    assert scene([]) == scene([3, 4, 11])


@pytest.mark.parametrize(
    "material",
    [["heavy", "light", "heavy"], [1, 0, 1], np.array([1, 0, 1]), np.array(["heavy", "light", "heavy"]), (1, "light", 1)],
)
def test_each_grain_may_have_a_material_of_its_own(material):
    """By names or numbers; its mass follows from its own density, and one call gives the bits of three."""

    def scene():
        materials = [bc.Material(name, density=density, **NOTHING) for name, density in (("light", 1.0), ("heavy", 3.0))]
        return bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, materials, 1e-3)

    places, radii = [[1, 1, 1], [3, 3, 3], [5, 5, 5]], [0.5, 0.6, 0.7]
    together, apart = scene(), scene()
    together.add_grains(places, radii, material)
    for place, radius, name in zip(places, radii, ("heavy", "light", "heavy")):
        apart.add_grains([place], radius, name)
    assert together.grains.material.tolist() == [1, 0, 1]
    assert fingerprint(together) == fingerprint(apart)


def test_only_materials_that_are_used_need_a_density():
    materials = [bc.Material("grain", density=2.0, **NOTHING), bc.Material("wall", **NOTHING)]
    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, materials, 1e-3)
    sim.add_grains([[1, 1, 1], [3, 3, 3]], 0.5, ["grain", "grain"])
    with pytest.raises(SceneError, match="material 'wall' has no density"):
        sim.add_grains([[5, 5, 5], [7, 7, 7]], 0.5, ["grain", "wall"])
    assert sim.grains.n == 2


def test_a_wall_of_another_scene_is_refused():
    """Both would move it."""
    wall = simulation().add_wall(bc.Plane((0, 0, 0), (0, 0, 1), velocity=(0, 0, 1.0)))
    with pytest.raises(SceneError, match="add_wall: this plane is wall 0 of a scene already; make another one"):
        simulation().add_wall(wall)


def test_a_wall_that_was_refused_can_be_added_elsewhere():
    wall = bc.Plane((0, 0, 0), (0.1, 0, 1))
    with pytest.raises(SceneError, match="leans along x"):
        simulation(bc.Box((0, 0, 0), (9, 9, 9), (True, False, False))).add_wall(wall)
    assert simulation().add_wall(wall) is wall
