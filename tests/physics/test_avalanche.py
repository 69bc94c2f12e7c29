"""The avalanche against what must hold whatever the grains do: similarity, weight on the floor, energy, speed of fall."""

import subprocess
import sys

import numpy as np
import pytest

from barchan.experiments.avalanche import Avalanche, build, stages
from barchan.experiments.avalanche.parameters import PAPER, Outline
from barchan.experiments.avalanche.results import arrival, results, time_series
from barchan.experiments.avalanche.setup import RIGHT_WALL
from barchan.measure import EnergyBudget

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
    scene = Avalanche.make({"coarse_graining": 1.0})
    outline = Outline.of(scene)
    assert outline.flowing == pytest.approx(120_000, rel=2e-3)
    assert outline.length * outline.edge == pytest.approx(0.740, rel=2e-3)
    assert outline.across * outline.edge == pytest.approx(8e-3, rel=3e-3)
    for name, value in scene.simulated._asdict().items():
        assert value == PAPER[name] or name == "dt"
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
    command = [sys.executable, "-m", "barchan.cli", "run", "avalanche", "--out", str(out)]
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
