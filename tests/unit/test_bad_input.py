"""Bad input is one clear error that names what, its value and what is allowed; never a traceback from deep inside."""

import numpy as np
import pytest

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.errors import BarchanError, CheckpointError, SceneError
from barchan.parallel import Serial, virtual_ranks
from barchan.preflight import check_memory, stable_time_step

SAND = bc.Material("sand", density=1.0, kn=1e3, kt=3e2, friction=0.5)


def simulation(**options):
    return bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, SAND, dt=1e-3, **options)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: bc.Box("abc", (1, 1, 1)), "low"),
        (lambda: bc.Box((0, 0, 0), (1, [2], 1)), "high"),
        (lambda: bc.Box((0, 0, 0), (1, 1, 1), periodic="xyz"), "periodic"),
        (lambda: bc.Box((0, 0, 0), (1, 1, 1), periodic=True), "periodic"),
        (lambda: bc.Box((0, 0, 0), (1, 1, 1), periodic=(np.nan, 0, 1)), "periodic"),
        (lambda: bc.Box((-1e308,) * 3, (1e308,) * 3), "finite"),
        (lambda: bc.Plane("abc", (0, 0, 1)), "point"),
        (lambda: bc.Plane((0, 0, 0), (0, 0, 1), velocity="fast"), "velocity"),
        (lambda: bc.Simulation(bc.Box((0, 0, 0), (1, 1, 1)), bc.laws.linear, "sand", 1e-3), "materials"),
        (lambda: bc.Material("m", density=10**400), "density"),
        (lambda: simulation(gravity=(1, 2)), "gravity"),
        (lambda: simulation(gravity=None), "gravity"),
        (lambda: simulation(threads=0), "threads"),
        (lambda: simulation(threads="two"), "threads"),
        (lambda: simulation().add_grains("abc", 1.0), "position"),
        (lambda: simulation().add_grains([(1, 1, 1)], "abc"), "radius"),
        (lambda: simulation().add_grains([(1, 1, 1)], 1.0, frozen=256), "frozen"),
        (lambda: simulation().add_wall("floor"), "wall"),
        (lambda: simulation().run(-5), "steps"),
        (lambda: simulation().run(2.7), "steps"),
    ],
)
def test_it_is_named(call, word):
    with pytest.raises(SceneError, match=word):
        call()


def test_a_mask_in_place_of_ids_is_refused():
    sim = simulation()
    sim.add_grains([(2, 2, 2), (5, 5, 5)], 1.0)
    with pytest.raises(SceneError, match=r"grains\.id\[mask\]"):
        sim.remove(np.array([False, True]))


def test_frozen_is_zero_or_one():
    sim = simulation()
    sim.add_grains([(2, 2, 2), (3.9, 2, 2)], 1.0, frozen=True)
    sim.grains.frozen[0] = 2
    with pytest.raises(SceneError, match="frozen = 2"):
        sim.run(1)


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e200])
def test_a_normal_may_have_any_length(size):
    assert bc.Plane((0, 0, 0), (0, 3 * size, 4 * size)).normal == pytest.approx([0.0, 0.6, 0.8], rel=1e-15)


def test_a_wall_of_another_material_or_a_field_of_another_width_is_not_restored(tmp_path):
    def scene(material="a", width=1):
        pair = [bc.Material(n, density=1.0, kn=1e3, kt=3e2, friction=0.5) for n in "ab"]
        sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, pair, dt=1e-3)
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1), material=material))
        sim.add_field("heat", width=width)
        return sim

    sim = scene()
    sim.add_grains([(2, 2, 2)], 1.0, "a")
    save(sim, tmp_path / "c.h5")
    restore(scene(), tmp_path / "c.h5")
    for other in (scene(material="b"), scene(width=3)):
        with pytest.raises(CheckpointError, match=r"walls|heat"):
            restore(other, tmp_path / "c.h5")


def test_numpy_numbers_are_saved_like_any_other(tmp_path):
    material = bc.Material("m", density=np.float32(1.0), kn=np.float32(1e3), kt=np.int64(300), friction=0.5)
    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, material, dt=np.float64(1e-3))
    sim.add_grains([(2, 2, 2)], 1.0)
    save(sim, tmp_path / "c.h5")
    sim.notes["array"] = np.arange(3)
    with pytest.raises(BarchanError, match="notes"):
        save(sim, tmp_path / "d.h5")


def test_a_law_that_returns_one_number_is_named():
    @bc.law(properties={"kn": "force/length"})
    def bare(overlap, kn):
        return kn * overlap

    sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bare, bc.Material("m", density=1.0, kn=1e3), dt=1e-3)
    sim.add_grains([(2, 2, 2)], 1.0)
    with pytest.raises(SceneError, match=r"law 'bare' must return normal_force, tangential_force; got"):
        sim.run(1)


@pytest.mark.parametrize(
    ("name", "near"),
    [("max_overlaps", "max_overlap"), ("gravitiy", "gravity"), ("writer", "writers"), ("stop", "known are: .*stop_requested")],
)
def test_a_misspelt_attribute_of_a_simulation_is_refused_with_the_nearest(name, near):
    """It would be kept and never read."""
    sim = simulation()
    with pytest.raises(SceneError, match=f"^a simulation has no attribute '{name}'; .*{near}") as caught:
        setattr(sim, name, 0.1)
    assert not hasattr(sim, name) and "\n" not in str(caught.value)


def test_every_attribute_that_exists_can_be_set():
    sim = simulation()
    sim.add_grains([(2, 2, 2)], 1.0)
    sim.max_overlap, sim.skin, sim.dt, sim.gravity, sim.check_dt, sim.notes = 0.3, 0.2, 5e-4, (0, 0, -1.0), False, {"run": 1}
    sim.actions, sim.writers, sim.threads = [], [], 1
    sim.run(1)
    assert (sim.time, sim.max_overlap, sim.notes) == (5e-4, 0.3, {"run": 1})
    assert sim.grains.velocity[0, 2] == pytest.approx(-0.5 * 5e-4 - 0.5 * 5e-4)


@pytest.mark.parametrize("call", [lambda sim: sim.step(), lambda sim: sim.rebuild(), lambda sim: sim.compute_forces(0.0)])
def test_a_part_of_a_step_needs_a_prepared_scene(call):
    sim = simulation()
    sim.add_grains([(2, 2, 2)], 1.0)
    with pytest.raises(SceneError, match=r"\(\): the scene is new or was changed; call prepare\(\) first"):
        call(sim)
    sim.prepare()
    call(sim)


def test_a_step_after_a_change_needs_prepare_again():
    """Its first kick would take the forces of before the change."""
    sim = simulation()
    sim.add_grains([(2, 2, 2)], 1.0)
    sim.run(1)
    sim.add_grains([(3.9, 2, 2)], 1.0)
    with pytest.raises(SceneError, match=r"step\(\): the scene is new or was changed"):
        sim.step()
    assert sim.step_number == 1


def test_more_grains_than_the_memory_holds_are_refused(monkeypatch):
    monkeypatch.setattr("os.sysconf", {"SC_PHYS_PAGES": 1_000_000, "SC_PAGE_SIZE": 4096}.__getitem__)
    check_memory(2_000_000, Serial())
    with pytest.raises(SceneError, match=r"3,000,000 grains need about 5 GB of memory; this machine has 4 GB"):
        check_memory(3_000_000, Serial())


def test_a_dashpot_too_strong_for_the_time_step_is_refused():
    """In one step m_eff/c the dashpot takes the whole relative velocity: F = -c v, c = gamma m_eff for the linear law."""

    def run(dt):
        tough = bc.Material("tough", density=1.0, kn=1e-3, kt=1e-3, gamma_n=50.0, friction=0.5)
        sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 9)), bc.laws.linear, tough, dt=dt)
        sim.add_grains([(3, 3, 3), (4.9, 3, 3)], 1.0)
        sim.prepare()
        return sim

    assert run(0.0199).stable_dt == pytest.approx(1.0 / 50.0, rel=1e-6)
    with pytest.raises(SceneError, match="m_eff/c"):
        run(0.0201)


def stable(law, *grains, pair=None, **properties):
    """The stable time step of ``grains``, each (radius, mass, material, frozen), of two materials of the same properties."""
    both = [bc.Material(name, density=1.0, friction=0.5, **properties) for name in "ab"]
    sim = bc.Simulation(bc.Box((0, 0, 0), (99, 9, 9)), law, both, dt=1e-9)
    if pair:
        sim.materials.set_pair("a", "b", **pair)
    for number, (radius, mass, material, frozen) in enumerate(grains):
        sim.add_grains((5.0 * number + 3.0, 4.0, 4.0), radius, material, mass=mass, frozen=frozen)
    return stable_time_step(law, sim.materials.table(law), sim.grains, 2)


def test_the_stable_time_step_is_that_of_the_lightest_grain_that_moves():
    """A spring: 0.17 sqrt(m/k) with k = k_n at any overlap."""
    heavy, frozen = (1.0, 9.0, "a", False), (1.0, 0.01, "a", True)
    light, other = (1.0, 4.0, "a", False), (1.0, 4.0, "b", False)
    for grains in ((heavy, light), (light, heavy), (heavy, other), (heavy, light, frozen)):
        assert stable(bc.laws.linear, *grains, kn=100.0, kt=1.0) == pytest.approx(0.17 * np.sqrt(4.0 / 100.0), rel=1e-6)
    assert stable(bc.laws.linear, frozen, kn=100.0, kt=1.0) == np.inf


def test_the_stable_time_step_looks_at_pairs_of_materials():
    """Two materials that are soft and smooth among themselves, but stiff, or damped, to one another."""
    grain, soft = (1.0, 1.0, "a", False), {"kn": 1e-3, "kt": 1e-3}
    assert stable(bc.laws.linear, grain, pair={"kn": 400.0}, **soft) == pytest.approx(0.17 / np.sqrt(400.0), rel=1e-6)
    assert stable(bc.laws.linear, grain, pair={"gamma_n": 50.0}, **soft) == pytest.approx(1.0 / 50.0, rel=1e-6)


def test_the_stable_time_step_is_taken_at_an_overlap_of_a_twentieth_of_the_diameter():
    """silbert: f = sqrt(overlap / 2r) there is sqrt(0.05), k = 3/2 f k_n and c = f gamma m_eff."""
    grain, f = (1.0, 1.0, "a", False), np.sqrt(0.05)
    stiff = stable(bc.laws.silbert, grain, kn=100.0, kt=1.0)
    assert stiff == pytest.approx(0.17 / np.sqrt(1.5 * f * 100.0), rel=1e-6)
    assert stable(bc.laws.silbert, grain, kn=1e-3, kt=1e-3, gamma_n=50.0) == pytest.approx(1.0 / (f * 50.0), rel=1e-6)


def test_the_stable_time_step_weighs_the_mass_of_a_grain_against_its_stiffness():
    """hertz: F = k_n sqrt(overlap R_eff) overlap, k = 3/2 k_n sqrt(0.1 r 0.5 r), so m/r is what counts, not m."""
    small, large = (0.5, 1.0, "a", False), (1.0, 1.5, "a", False)
    stiffness = 1.5 * 100.0 * np.sqrt(0.05) * 1.0
    assert stable(bc.laws.hertz, small, large, kn=100.0, kt=1.0) == pytest.approx(0.17 * np.sqrt(1.5 / stiffness), rel=1e-6)


def test_all_ranks_know_the_smallest_stable_time_step():
    """The light grain, on one rank, sets it for all of them."""

    def program():
        sim = bc.Simulation(bc.Box((0, 0, 0), (9, 9, 40)), bc.laws.linear, SAND, dt=1e-3)
        sim.add_grains([(4, 4, 4), (4, 4, 36)], 1.0, mass=[9.0, 4.0])
        sim.prepare()
        return sim.grains.n, sim.stable_dt

    for owned, bound in virtual_ranks(2, program):
        assert owned == 1 and bound == pytest.approx(0.17 * np.sqrt(4.0 / 1e3), rel=1e-6)
