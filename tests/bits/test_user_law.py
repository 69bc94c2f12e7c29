"""A law in the user's own file, or notebook, goes the same way as a shipped one: the same bits, the same speed."""

import importlib.util
import linecache
import time
import warnings

import numpy as np
import pytest
import states

import barchan as bc
from barchan.bench.cases import DENSE_FLOW
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError
from barchan.testing import check_law

SOURCE = '''
"""Hertz, copied by a user who knows barchan.law and nothing else."""
from math import sqrt
import barchan as bc

def plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]

def minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]

def times(s, a):
    return s * a[0], s * a[1], s * a[2]

def laid_on(a, n):
    along = a[0] * n[0] + a[1] * n[1] + a[2] * n[2]
    x, y, z = a[0] - along * n[0], a[1] - along * n[1], a[2] - along * n[2]
    before = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    after = x * x + y * y + z * z
    stretch = sqrt(before / after) if after > 0.0 else 0.0
    return stretch * x, stretch * y, stretch * z

@bc.law(properties={"kn": bc.Property("force/length^2", above=True), "kt": bc.Property("force/length^2", above=True),
                    "gamma_n": "1/(length time)", "gamma_t": "1/(length time)", "friction": "1"}, history={"slip": 3})
def my_hertz(overlap, normal, normal_half, normal_velocity, tangential_velocity, slip_velocity_half, radius_eff, mass_eff, dt,
             kn, kt, gamma_n, gamma_t, friction, slip):
    f = sqrt(overlap * radius_eff)
    slip = laid_on(plus(laid_on(slip, normal_half), times(dt, slip_velocity_half)), normal)
    pressing = f * (kn * overlap - gamma_n * mass_eff * normal_velocity)
    viscous = times(gamma_t * mass_eff, tangential_velocity)
    pull = plus(times(kt, slip), viscous)
    trial = times(f, pull)
    size = sqrt(trial[0] * trial[0] + trial[1] * trial[1] + trial[2] * trial[2])
    limit = friction * abs(pressing)
    ratio = limit / size if size > limit else 1.0
    if ratio < 1.0:
        slip = times(1.0 / kt, minus(times(ratio, pull), viscous))
    return pressing, times(-f * ratio, pull), slip
'''


#: Nine numbers of memory, more than the six of a force: each vector sums up the one before.
MEMORIES = """
import barchan as bc

def summed(a, dt, b):
    return a[0] + dt * b[0], a[1] + dt * b[1], a[2] + dt * b[2]

@bc.law(properties={"kn": bc.Property("force/length", above=True)}, history={"slip": 3, "path": 3, "area": 3})
def my_hertz(overlap, normal_velocity, slip_velocity_half, dt, kn, slip, path, area):
    slip = summed(slip, dt, slip_velocity_half)
    path = summed(path, dt, slip)
    area = summed(area, dt, path)
    pull = -0.2 * kn
    force = (pull * (slip[0] + path[0] + area[0]), pull * (slip[1] + path[1] + area[1]), pull * (slip[2] + path[2] + area[2]))
    return kn * overlap - 1e-3 * kn * normal_velocity, force, slip, path, area
"""


def from_file(folder, source=SOURCE, name="user_laws"):
    path = folder / f"{name}.py"
    path.write_text(source)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.my_hertz


def final_state(law, steps=100):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = states.dense(law)
        sim.run(steps)
    return sim


def differences_but_name(first, second):
    """Differences of two states whose laws have different names."""
    return [line for line in differences(collect(first), collect(second)) if not line.startswith("law:")]


def test_a_law_in_a_file_gives_the_same_bits(tmp_path):
    assert differences_but_name(final_state(from_file(tmp_path)), final_state(bc.laws.hertz)) == []


def test_a_law_in_a_notebook_gives_the_same_bits():
    """Notebooks keep the source of a cell in linecache under a name in angle brackets; so does this test."""
    cell = "<ipython-input-1-barchan>"
    linecache.cache[cell] = (len(SOURCE), None, SOURCE.splitlines(True), cell)
    namespace = {"__name__": "__main__"}
    exec(compile(SOURCE, cell, "exec"), namespace)
    assert differences_but_name(final_state(namespace["my_hertz"]), final_state(bc.laws.hertz)) == []


def test_a_law_in_a_file_passes_the_kit(tmp_path):
    material = bc.Material("m", density=1.0, kn=1e4, kt=3e3, gamma_n=5.0, gamma_t=5.0, friction=0.5)
    assert len(check_law(from_file(tmp_path), material)) == 7


def test_a_law_with_many_memories_keeps_them_over_rebuilds_and_a_resume(tmp_path):
    """More rows than a force has, in whose room they are brought from list to list."""
    law = from_file(tmp_path, MEMORIES, "memories")
    undisturbed, rebuilt = states.dense(law), states.dense(law)
    rebuilt.staleness.also_when = lambda step: True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        undisturbed.run(60)
        rebuilt.run(30)
        save(rebuilt, tmp_path / "c.h5")
        resumed = states.empty(law)
        restore(resumed, tmp_path / "c.h5")
        resumed.run(30)
        rebuilt.run(30)
    area = collect(undisturbed).contacts.values[:, 6:]
    assert np.abs(area).max() > 0.0 and undisturbed.contacts.n_pairs > 1024
    assert differences(collect(undisturbed), collect(rebuilt)) == []
    assert differences(collect(undisturbed), collect(resumed)) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [("abs(pressing)", "max(pressing, 0.0)"), ('"friction": "1"', '"friction": bc.Property("1", maximum=2.0)')],
    ids=["formula", "declaration"],
)
def test_a_changed_law_cannot_continue_a_run(old, new, tmp_path):
    law, changed = from_file(tmp_path), from_file(tmp_path, SOURCE.replace(old, new), "changed_laws")
    save(final_state(law, 10), tmp_path / "c.h5")
    restore(states.empty(from_file(tmp_path, name="same_laws")), tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="law"):
        restore(states.empty(changed), tmp_path / "c.h5")


def test_a_law_in_a_file_has_the_speed_of_the_shipped_one(tmp_path):
    """At least 95 %, by the fastest of many force evaluations on the dense state of 32,000 grains: what else runs on the machine
    only ever adds time, and an evaluation of 2 ms finds a moment without it. They take turns until that moment has come."""
    data = np.load(DENSE_FLOW)
    side = float(data["L"])

    def dense(law):
        material = bc.Material(
            "g", density=float(data["rho"][0]), kn=2000.0, kt=4000.0 / 7.0, gamma_n=50.0, gamma_t=25.0, friction=0.5
        )
        sim = bc.Simulation(bc.Box((0, 0, -1), (side, side, 60), (True, True, False)), law, material, dt=5e-4, threads=1)
        sim.add_grains(data["x"], data["r"], velocity=data["v"], omega=data["w"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim.run(2)
        return sim

    def seconds(sim):
        begin = time.perf_counter()
        sim.compute_forces(0.0)
        return time.perf_counter() - begin

    shipped, own = dense(bc.laws.hertz), dense(from_file(tmp_path))
    fastest = {shipped: np.inf, own: np.inf}
    for turn in range(4000):
        for sim in fastest:
            fastest[sim] = min(fastest[sim], seconds(sim))
        if turn >= 200 and fastest[shipped] / fastest[own] >= 0.95:
            break
    assert fastest[shipped] / fastest[own] >= 0.95
