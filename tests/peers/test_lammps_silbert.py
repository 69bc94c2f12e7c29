"""The paper's law in the standard scheme, ``silbert_standard``, against LAMMPS ``gran/hertz/history``."""

import numpy as np
from lammps_peer import HEAD, SNAPSHOTS, TOLERANCE, dense_packing, deviations, layer, run_lammps, start_like_lammps

import barchan as bc
from barchan.bench.peers.lammps import write_data

KN, KT, GAMMA_N, GAMMA_T, FRICTION, DT = 2e4, 2.0 / 7.0 * 2e4, 20.0, 8.0, 0.4, 2e-4
DIAMETER, SIDE, DENSITY = 1.3, 8.0, 1.7


def test_silbert_equals_scaled_hertz_history_for_equal_grains(tmp_path):
    """200 equal grains (diameter 1.3) in a random packing on a plane, 20 steps, every force and torque to 1e-10.

    The laws differ in their factor only: sqrt(overlap / d) against sqrt(overlap R_eff). With R_eff = d/4 between grains the
    second is d/2 times the first, with R_eff = d/2 at a plane d/sqrt(2) times; LAMMPS gets constants divided by that. So
    this also holds barchan's rule that a plane counts as an immobile grain of equal radius against a peer.
    Sources: Walther & Sbalzarini 2009, equations (5) to (8); LAMMPS `gran/hertz/history`; for the spelling of the wall see
    test_lammps_dense.py.
    """
    rng = np.random.default_rng(11)
    radius = np.full(200, 0.5 * DIAMETER)
    position = dense_packing(radius, SIDE, seed=3)
    radius *= 1.012
    diameter = 2.0 * radius[0]
    velocity, omega = rng.normal(0.0, 0.3, (200, 3)), rng.normal(0.0, 0.6, (200, 3))
    write_data(tmp_path / "equal.data", (0, 0, -1), (SIDE, SIDE, 30), position, radius, DENSITY, velocity, omega)
    pair, wall = 2.0 / diameter, np.sqrt(2.0) / diameter
    lammps = run_lammps(
        f"""{HEAD}
boundary p p f
read_data equal.data
pair_style gran/hertz/history {pair * KN:.17g} {pair * KT:.17g} {pair * GAMMA_N:.17g} {pair * GAMMA_T:.17g} {FRICTION} 1
pair_coeff * *
neighbor 0.3 bin
neigh_modify every 1 delay 0
timestep {DT}
fix 1 all gravity 1.0 vector 0 0 -1
fix 2 all wall/gran granular hertz {wall * KN:.17g} {wall * GAMMA_N:.17g} &
 tangential mindlin {wall * KT:.17g} {GAMMA_T / GAMMA_N} {FRICTION} damping viscoelastic zplane 0.0 NULL
fix 3 all nve/sphere
{SNAPSHOTS}""",
        tmp_path,
    )

    material = bc.Material("grain", density=DENSITY, kn=KN, kt=KT, gamma_n=GAMMA_N, gamma_t=GAMMA_T, friction=FRICTION)
    sim = layer(bc.laws.silbert_standard, material, DT, (0.0, 0.0, -1.0), (SIDE, SIDE, 30))
    ids = sim.add_grains(position, radius, velocity=velocity, omega=omega)
    start_like_lammps(sim, ids, lammps["start"])
    sim.run(1)
    assert sim.touching > 400 and abs(sim.walls[0].force[2]) > 0.0
    assert max(deviations(sim, ids, lammps["one"])) < TOLERANCE
    sim.run(19)
    assert max(deviations(sim, ids, lammps["twenty"])) < TOLERANCE
