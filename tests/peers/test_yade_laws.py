"""`shm` and `dmt` against YADE's law of Hertz and Mindlin: grains that move as they are told, so that both see the same contacts.

YADE turns its shear force by the mean of two normals and adds the slip of the whole step; both schemes agree to first order.
"""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import barchan as bc
from barchan.measure import contact_table

pytestmark = pytest.mark.skipif(shutil.which("yade") is None, reason="YADE is not installed (Debian: apt install yade)")

SCRIPT = Path(__file__).with_name("yade_script.py")
MODULUS, POISSON, WORK, DT = 1e5, 0.3, 4.0, 2e-4


def yade(folder, position, radius, velocity, friction, work, steps):
    """Forces on all grains after each step, (steps, grains, 3)."""
    elastic = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "friction": friction, "work_of_adhesion": work}
    np.savez(folder / "given.npz", position=position, radius=radius, velocity=velocity, dt=DT, steps=steps, **elastic)
    command = ["yade", "-n", "-x", str(SCRIPT), str(folder)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert (folder / "found.npz").exists(), done.stdout[-2000:] + done.stderr[-2000:]
    return np.load(folder / "found.npz")["force"]


def scene(law, position, radius, velocity, friction, work):
    """The same grains here; heavy, so that they move as told."""
    properties = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "friction": friction}
    properties |= {"restitution": 1.0, "work_of_adhesion": work} if law is bc.laws.dmt else {}
    sim = bc.Simulation(bc.Box((-9,) * 3, (9,) * 3), law, bc.Material("m", density=1e15, **properties), DT, threads=1)
    sim.check_dt = False
    sim.add_grains(position, radius, velocity=velocity)
    return sim


@pytest.mark.parametrize(("law", "work"), [(bc.laws.shm, 0.0), (bc.laws.dmt, WORK)], ids=["shm", "dmt"])
def test_normal_forces_of_a_cloud(law, work, tmp_path):
    """60 grains at rest that overlap as chance has it: to 1e-12 of the largest contact force."""
    random = np.random.default_rng(3)
    position, radius = random.uniform(0.0, 2.6, (60, 3)), random.uniform(0.3, 0.5, 60)
    sim = scene(law, position, radius, 0.0 * position, 0.5, work)
    sim.max_overlap = 2.0
    sim.prepare()
    theirs = yade(tmp_path, position, radius, 0.0 * position, 0.5, work, 1)[0]
    assert sim.touching > 100
    largest = np.sqrt((contact_table(sim)["force"] ** 2).sum(axis=1)).max()
    assert np.abs(sim.grains.sorted_by_id("force") - theirs).max() < 1e-12 * largest


@pytest.mark.parametrize("friction", [0.02, 10.0], ids=["sliding", "sticking"])
def test_shear_force_of_two_grains_that_pass(friction, tmp_path):
    """40 steps of slip across a growing overlap: to 1e-3 of the normal force."""
    position, radius = np.array([[0.0, 0.0, 0.0], [0.79, 0.0, 0.0]]), np.full(2, 0.4)
    velocity = np.array([[0.0, 0.0, 0.0], [-0.3, 0.5, -0.2]])
    sim, ours = scene(bc.laws.shm, position, radius, velocity, friction, 0.0), []
    for _ in range(40):
        sim.run(1)
        ours.append(sim.grains.sorted_by_id("force"))
    theirs = yade(tmp_path, position, radius, velocity, friction, 0.0, 40)
    normal = np.linalg.norm(theirs[:, 0], axis=1)[:, None, None]
    assert (np.abs(np.array(ours) - theirs) < 1e-3 * normal).all()
    tangent = np.abs(np.array(ours)[-1, 0, 1:]).max()
    assert tangent > 0.01 * normal[-1]
