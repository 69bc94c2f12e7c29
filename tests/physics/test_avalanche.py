"""The avalanche against what must hold whatever the grains do: similarity, weight on the floor, energy, speed of fall."""

import subprocess
import sys

import numpy as np
import pytest

from barchan.actions import Outlet
from barchan.experiments.avalanche import Avalanche, build, stages
from barchan.experiments.avalanche.observe import time_row
from barchan.experiments.avalanche.parameters import FIGURE_3, PAPER, Outline
from barchan.experiments.avalanche.results import arrival, results, time_series
from barchan.experiments.avalanche.setup import RIGHT_WALL
from barchan.measure import EnergyBudget
from barchan.triggers import At

OUTLINE = {"length": 0.04, "height": 0.012, "floor": 0.08, "end_wall": 0.02, "width": 8e-3}


def small(scale, **changes):
    """A small avalanche, all lengths of the outline ``scale`` times those of ``OUTLINE``, and its grains with them."""
    lengths = {name: value * (scale if name != "width" else 1.0) for name, value in OUTLINE.items()}
    return Avalanche.make(lengths | {"coarse_graining": scale} | changes)


def run(scene, steps, after_release):
    """``steps`` steps in the horizontal position, then some after the release."""
    sim = build(scene, threads=1)
    equilibrate, flow = stages(scene)
    equilibrate.begin(sim)
    sim.run(steps)
    flow.begin(sim)
    sim.run(after_release)
    return sim


def test_coarse_grained_flow_is_similar():
    """k_n d/(m g) and gamma sqrt(d/g) are kept: lengths grow as s, speeds as sqrt(s), forces as s^3, step by step."""
    fine, coarse = run(small(1.0), 1500, 1500), run(small(4.0), 1500, 1500)
    assert fine.grains.n == coarse.grains.n
    assert coarse.time == pytest.approx(2.0 * fine.time)
    size = np.abs(fine.grains.view("position")).max()
    for name, factor, scale in (
        ("position", 4.0, size),
        ("velocity", 2.0, np.abs(fine.grains.view("velocity")).max()),
        ("force", 64.0, np.abs(fine.grains.view("force")).max()),
    ):
        a, b = fine.grains.sorted_by_id(name), coarse.grains.sorted_by_id(name)
        assert np.abs(b / factor - a).max() < 1e-6 * scale, name


def test_walls_carry_the_weight_at_rest():
    """Mean over a while, in which the last tremor averages out."""
    scene = small(1.0, equilibrate=0.25)
    sim = build(scene, threads=1)
    stages(scene)[0].begin(sim)
    sim.run(scene.release_step)
    carried = []
    for _ in range(60):
        sim.run(50)
        frozen = sim.grains.view("frozen") == 1
        carried.append(-(sim.grains.view("force")[frozen, 2] + scene.gravity * sim.grains.view("mass")[frozen]).sum())
    weight = scene.gravity * sim.grains.view("mass")[~frozen].sum()
    assert np.mean(carried) == pytest.approx(weight, rel=5e-3)


def test_the_release_tilts_gravity_by_the_angle_and_starts_the_budget():
    """30 degrees: g/2 down the floor, which runs along +x, and -sqrt(3)/2 g onto it."""
    scene = small(1.0, angle=30.0)
    sim = run(scene, 50, 0)
    assert sim.present_gravity == pytest.approx((0.5 * scene.gravity, 0.0, -np.sqrt(0.75) * scene.gravity), rel=1e-14)
    budget = EnergyBudget(sim.notes["energy_at_start"]).compute(sim)
    assert budget.dissipated == 0.0 and budget.potential != 0.0
    sim.run(1)
    assert sim.grains.view("velocity")[sim.grains.view("frozen") == 0, 0].mean() > 0.0


def test_radii_are_uniform_between_their_bounds_and_drawn_from_the_seed():
    """Mean (a + b)/2 and standard deviation (b - a)/sqrt(12), within four times what chance makes of them."""

    def radii(seed):
        return build(small(1.0, radius_min=1.0e-3, radius_max=1.12e-3, seed=seed), threads=1).grains.sorted_by_id("radius")

    radius, chance = radii(1), 4.0 / np.sqrt(len(radii(1)))
    width = 0.12e-3
    assert 1.0e-3 <= radius.min() < 1.0e-3 + 0.01 * width and 1.12e-3 - 0.01 * width < radius.max() <= 1.12e-3
    assert radius.mean() == pytest.approx(1.06e-3, abs=chance * width / np.sqrt(12.0))
    assert radius.std() == pytest.approx(width / np.sqrt(12.0), rel=chance)
    assert np.abs(np.corrcoef(radius, radii(2))[0, 1]) < chance, "another seed draws others"
    assert np.array_equal(radius, radii(1))


def test_the_lattice_goes_on_across_the_periodic_faces():
    """The period is a whole number of cells: each grain of a row has its next one an edge away, over the face too."""
    sim, outline = build(small(1.0), threads=1), Outline.of(small(1.0))
    x, y, z = sim.grains.view("position").T
    row = np.sort(y[(x == x.max()) & (z == z[x == x.max()].min())])
    assert np.diff([*row, row[0] + sim.box.length[1]]) == pytest.approx(outline.edge, rel=1e-12)
    assert tuple(sim.box.periodic) == (False, True, False)


def test_a_row_of_the_table_is_the_state_and_keeps_account_of_what_leaves():
    """Energies from their definitions; then an outlet takes half of the flow away, and nothing counts as dissipated or lost."""
    scene = small(1.0)
    sim = run(scene, 500, 3000)
    row = time_row(sim, scene)
    moves = sim.grains.view("frozen") == 0
    mass, inertia, force, torque = (sim.grains.view(name)[moves] for name in ("mass", "inertia", "force", "torque"))
    v = sim.grains.view("velocity")[moves] + 0.5 * sim.dt * force / mass[:, None]
    w = sim.grains.view("omega")[moves] + 0.5 * sim.dt * torque / inertia[:, None]
    x, g = sim.grains.view("position")[moves], np.array(sim.present_gravity)
    assert row["kinetic energy [J]"] == pytest.approx((0.5 * mass * (v**2).sum(axis=1)).sum(), rel=1e-12)
    assert row["rotational energy [J]"] == pytest.approx((0.5 * inertia * (w**2).sum(axis=1)).sum(), rel=1e-12)
    assert row["potential energy [J]"] == pytest.approx(-(mass * (x @ g)).sum(), rel=1e-12)
    assert row["since release [s]"] == pytest.approx((sim.step_number - scene.release_step) * sim.dt, rel=1e-12)
    edge = Outline.of(scene).edge
    assert row["foremost grain [m]"] == pytest.approx(x[:, 0].max() - Outline.of(scene).length * edge, rel=1e-12)
    assert (row["grains"], row["left through outlets"]) == (Outline.of(scene).flowing, 0)
    middle = np.median(x[:, 0])
    sim.actions.append(Outlet("half way", (middle, 0, 0), (1, 0, 0), At(sim.step_number + 1)))
    sim.run(1)
    after = time_row(sim, scene)
    assert after["grains"] + after["left through outlets"] == row["grains"]
    assert after["left through outlets"] == pytest.approx(0.5 * row["grains"], rel=0.02)
    gone = sim.notes["outlets"]["half way"]["energy"]
    cut = row["elastic energy [J]"] - after["elastic energy [J]"]  # in contacts of grains that left
    assert after["dissipated energy [J]"] - cut == pytest.approx(row["dissipated energy [J]"], abs=5e-3 * abs(gone))


def test_energy_only_falls_and_no_grain_is_faster_than_a_falling_one():
    scene = small(1.0, equilibrate=0.1, duration=0.1)
    sim = run(scene, scene.release_step, 0)
    assert not (sim.grains.view("part") == RIGHT_WALL).any()
    start, before = sim.notes["energy_at_start"], 0.0
    for _ in range(20):
        sim.run(scene.steps(scene.duration) // 20)
        dissipated = EnergyBudget(start).compute(sim).dissipated
        assert dissipated > before - 1e-4 * abs(start)
        before = dissipated
    highest = scene.height + scene.floor * np.sin(np.radians(scene.angle))
    fastest = np.sqrt((sim.grains.view("velocity") ** 2).sum(axis=1).max())
    assert 0.1 < fastest < np.sqrt(2.0 * scene.gravity * highest)


def test_the_paper_s_figure_3():
    """120,000 grains of 740 x 8 mm at void fraction 0.468 with the paper's parameters."""
    scene = Avalanche.make(FIGURE_3)
    outline = Outline.of(scene)
    assert outline.flowing == pytest.approx(120_000, rel=2e-3)
    assert outline.length * outline.edge == pytest.approx(0.740, rel=2e-3)
    assert outline.across * outline.edge == pytest.approx(8e-3, rel=3e-3)
    here = scene.model_dump() | scene.simulated._asdict()
    assert [name for name, value in PAPER.items() if here[name] != value] == ["dt"]
    solid = outline.flowing * np.pi / 6.0 * 2.12e-3**3 / (0.740 * 8e-3 * outline.height * outline.edge)
    assert solid == pytest.approx(1.0 - 0.468, rel=1e-2)


@pytest.mark.parametrize("wanted", [300, 5_000, 120_000, 1_000_000])
def test_the_same_outline_in_any_number_of_grains(wanted):
    scene = Avalanche().with_grains(wanted)
    outline = Outline.of(scene)
    assert outline.flowing == pytest.approx(wanted, rel=0.15 if wanted < 1000 else 0.03)
    assert outline.length * outline.edge == pytest.approx(0.740, rel=0.05)


def test_more_than_one_layer_of_the_wall_is_hidden_behind_the_other():
    """Two layers of immobile grains: no flowing grain can pass between those of a wall."""
    sim = build(small(1.0), threads=1)
    floor = sim.grains.view("position")[(sim.grains.view("frozen") == 1) & (sim.grains.view("position")[:, 2] < 0.0)]
    assert len(np.unique(floor[:, 2].round(9))) == 2


@pytest.mark.validate
def test_the_default_avalanche_at_full_size(tmp_path):
    """The demo: all its checks pass, and front and jet are where they were when they were looked at."""
    out = tmp_path / "demo"
    command = [sys.executable, "-m", "barchan", "run", "avalanche", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print(done.stderr)
    scene = Avalanche()
    found = results(scene, out)
    assert [check.name for check in found.checks if not check.passed] == []
    flow = time_series(out)
    assert arrival(scene, flow) == pytest.approx(0.40, abs=0.03)
    assert 0.12 < flow["jet height [m]"].max() < 0.25
    assert 0.05 < flow["moving layer right wall [m]"][flow["since release [s]"] > 0.3].mean() < 0.12
