"""Outlets: what leaves is counted with its mass and energy, at the step it should, on any number of ranks, after a resume."""

import numpy as np
import pytest

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.measure import EnergyBudget
from barchan.parallel import virtual_ranks

SPEEDS = np.array([1.0, 2.0, 4.0, 0.1])


def scene(with_grains=True, period=10):
    """Four grains that fly towards an outlet at x = 0.9, 0.4 away, and a frozen one behind it."""
    sand = bc.Material("sand", density=1000.0, kn=1e3, kt=1e3, gamma_n=0.0, gamma_t=0.0, friction=0.5)
    box = bc.Box((0, 0, 0), (1, 1, 1), periodic=(False, True, False))
    sim = bc.Simulation(box, bc.laws.silbert, sand, dt=1e-4, gravity=(0.0, 0.0, -1.0), threads=1)
    sim.actions = [bc.Outlet("end", (0.9, 0, 0), (2.0, 0, 0), bc.Every(period))]
    if with_grains:
        places = [(0.5, 0.2 + 0.2 * k, 0.8) for k in range(4)]
        sim.add_grains(places, 0.01, velocity=np.outer(SPEEDS, (1.0, 0.0, 0.0)))
        sim.add_grains((0.95, 0.5, 0.5), 0.01, frozen=True)
    return sim


def test_grains_leave_at_the_first_look_after_they_have_crossed():
    sim = scene()
    for speed, step in ((4.0, 1000), (2.0, 2000), (1.0, 4000)):
        crossing = 0.4 / speed / 1e-4
        assert crossing == pytest.approx(step)
        sim.run(step - sim.step_number)
        before = sim.grains.n
        sim.run(9)
        assert sim.grains.n == before, "the next look is still to come"
        sim.run(1)
        assert sim.grains.n == before - 1
    assert sorted(sim.grains.sorted_by_id("id")) == [3, 4], "the slow one, and the frozen one behind the outlet, stay"


def test_count_mass_and_energy_of_what_left():
    sim = scene()
    sim.prepare()
    start = EnergyBudget().compute(sim).total
    sim.run(4100)
    left = sim.notes["outlets"]["end"]
    mass = 1000.0 * 4.0 / 3.0 * np.pi * 0.01**3
    assert left["grains"] == 3
    assert left["mass"] == pytest.approx(3 * mass, rel=1e-14)
    staying = EnergyBudget().compute(sim).total
    assert left["energy"] + staying == pytest.approx(start, rel=1e-3), "free flight keeps the energy (up to half a kick)"


def test_an_oblique_plane_lets_out_what_is_on_the_side_of_its_normal():
    """Through (0.5, 0, 0.5) with the normal (1, 0, -1): grains with x > z leave, those with x < z stay."""
    sim = scene(with_grains=False)
    sim.gravity = (0.0, 0.0, 0.0)
    sim.actions = [bc.Outlet("slope", (0.5, 0.0, 0.5), (1.0, 0.0, -1.0), bc.Every(1))]
    sim.add_grains([(x, 0.5, z) for x, z in ((0.3, 0.2), (0.2, 0.3), (0.8, 0.7), (0.7, 0.8))], 0.01)
    sim.run(1)
    assert sorted(sim.grains.sorted_by_id("id")) == [1, 3]


def test_the_energy_of_a_spinning_grain_leaves_with_it():
    """m v^2/2 + I w^2/2 + m g z with I = 2/5 m r^2, here all of the same order."""
    sim = scene(with_grains=False)
    sim.add_grains((0.91, 0.5, 0.5), 0.01, velocity=(0.6, 0.0, 0.8), omega=(0.0, 60.0, 80.0))
    sim.run(10)
    mass = 1000.0 * 4.0 / 3.0 * np.pi * 0.01**3
    energy = mass * (0.5 * 1.0**2 + 0.2 * 0.01**2 * 100.0**2 + 1.0 * 0.5)
    assert sim.notes["outlets"]["end"]["energy"] == pytest.approx(energy, rel=2e-3), "up to half a kick and ten steps of flight"


def test_the_energy_of_a_grain_that_crossed_a_periodic_face_is_that_of_its_whole_way():
    """Down a slope along the periodic axis, over the face at y = 1: the sum of what stays and what left is kept."""
    sim = scene(with_grains=False)
    sim.gravity = (0.0, 3.0, 0.0)
    sim.add_grains((0.5, 0.5, 0.5), 0.01, velocity=(1.0, 2.0, 0.0))
    sim.add_grains((0.5, 0.5, 0.8), 0.01, velocity=(0.1, 2.0, 0.0))
    sim.prepare()
    start = EnergyBudget().compute(sim).total
    sim.run(4100)
    assert sim.notes["outlets"]["end"]["grains"] == 1
    assert sim.notes["outlets"]["end"]["energy"] + EnergyBudget().compute(sim).total == pytest.approx(start, rel=1e-3)


def test_a_count_is_the_same_on_three_ranks_and_after_a_resume(tmp_path):
    def run():
        sim = scene()
        sim.run(1500)
        save(sim, tmp_path / "state.h5")
        sim.run(1500)
        return sim.notes["outlets"]

    alone = run()
    assert virtual_ranks(3, run) == [alone] * 3
    again = scene(with_grains=False)
    restore(again, tmp_path / "state.h5")
    again.run(1500)
    assert again.notes["outlets"] == alone


@pytest.mark.parametrize(
    "point, normal", [((0, 0), (1, 0, 0)), ((0, 0, 0), (0, 0, 0)), ((0, 0, float("nan")), (1, 0, 0)), ("x", (1, 0, 0))]
)
def test_a_plane_that_is_none_is_refused(point, normal):
    with pytest.raises(bc.BarchanError, match="outlet 'end'"):
        bc.Outlet("end", point, normal, bc.Every(1))
