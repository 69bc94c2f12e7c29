"""The parallel bond against LAMMPS' `bond_style bpm/rotational`, on pairs that move a little, each in its own way.

LAMMPS has Wang's (2009) beam: forces from the present places and orientations, relative to those at the start, with Kr and Ks in
force by length, Kt and Kb in force times length by angle. With Kr = kn A, Ks = ks A, Kt = ks J and Kb = kn I it has the same
loads for small motions. What differs:

- it takes the whole way from the start at once, along straight lines and by one rotation; barchan adds up steps. The difference
  is of the order of the square of the way;
- the ends of a bond meet in the middle of the centres, in barchan where the distance is divided as the radii are. So the radii of
  a pair are equal here;
- it breaks where sums of loads over their own strengths reach 1, barchan where a stress at the edge does, so nothing breaks here.
"""

import numpy as np
import pytest
from lammps_peer import run_lammps

import barchan as bc
from barchan.measure import bond_table

KN, KS, FACTOR, DT, STEPS, LOT, HEAVY = 3e4, 1e4, 0.8, 1e-3, 50, 3.0, 1e30
KINDS, EACH = ("pull", "push", "shear", "twist", "bend", "all"), 4
PAIRS = len(KINDS) * EACH

SCRIPT = """
units lj
atom_style bpm/sphere
newton on off
comm_modify vel yes
boundary f f f
special_bonds lj 0.0 1.0 1.0 coul 1.0 1.0 1.0
read_data pairs.data
pair_style zero 2.0
pair_coeff * *
bond_style bpm/rotational
{coefficients}
{motions}
timestep {dt}
fix 1 all nve/bpm/sphere
run {steps}
snapshot end
"""


class Moving:
    """Pairs of equal grains that just touch, in lots of their own, at random orientations, that move by about ``size`` radii."""

    def __init__(self, size):
        rng = np.random.default_rng(9)
        self.radius, number = rng.uniform(0.4, 0.6, PAIRS), np.arange(PAIRS)
        normal, across = rng.normal(size=(2, PAIRS, 3))
        normal /= np.sqrt((normal**2).sum(axis=1, keepdims=True))
        across = np.cross(normal, across)
        across /= np.sqrt((across**2).sum(axis=1, keepdims=True))
        lots = LOT * np.stack([number % 3, number // 3 % 3, number // 9], axis=1)
        half = self.radius[:, None] * normal
        self.position = np.stack([lots + half, lots - half], axis=1).reshape(-1, 3)
        speed = size / (STEPS * DT) * rng.uniform(0.3, 1.0, (PAIRS, 2, 1)) * [[[1.0], [-1.0]]]
        kind, none = np.repeat(KINDS, EACH)[:, None, None], np.zeros((PAIRS, 2, 3))
        along, aside = normal[:, None] * speed, across[:, None] * speed
        anything = size / (STEPS * DT) * rng.uniform(-1.0, 1.0, (2, PAIRS, 2, 3))
        kinds = [kind == name for name in KINDS]
        self.velocity = np.select(kinds, [along, -along, aside, none, none, anything[0]]).reshape(-1, 3)
        self.omega = np.select(kinds, [none, none, none, along, aside, anything[1]]).reshape(-1, 3)

    def lammps(self, folder):
        """Forces and torques of LAMMPS."""
        bond = FACTOR * self.radius
        area, inertia = np.pi * bond**2, 0.25 * np.pi * bond**4
        stiffness = np.stack([KN * area, KS * area, 2.0 * KS * inertia, KN * inertia], axis=1)
        grains = [
            f"{k + 1} 1 1 {2.0 * self.radius[k // 2]:.17g} {HEAVY} {x:.17g} {y:.17g} {z:.17g}"
            for k, (x, y, z) in enumerate(self.position)
        ]
        bonds = [f"{k + 1} {k + 1} {2 * k + 1} {2 * k + 2}" for k in range(PAIRS)]
        counts = [f"{2 * PAIRS} atoms", "1 atom types", f"{PAIRS} bonds", f"{PAIRS} bond types", "2 extra bond per atom"]
        box = [f"-3 12 {axis}lo {axis}hi" for axis in "xyz"]
        parts = ["pairs", "", *counts, *box, "", "Atoms # bpm/sphere", "", *grains, "", "Bonds", "", *bonds, ""]
        (folder / "pairs.data").write_text("\n".join(parts))
        coefficients = [
            f"bond_coeff {k} " + " ".join(f"{value:.17g}" for value in row) + 4 * " 1e30" + 4 * " 0.0"
            for k, row in enumerate(stiffness, start=1)
        ]
        moves = "set atom {} vx {:.17g} vy {:.17g} vz {:.17g} omega {:.17g} {:.17g} {:.17g}"
        motions = [moves.format(k, *v, *w) for k, (v, w) in enumerate(zip(self.velocity, self.omega), start=1)]
        lines = {"coefficients": "\n".join(coefficients), "motions": "\n".join(motions)}
        end = run_lammps(SCRIPT.format(dt=DT, steps=STEPS, **lines), folder)["end"]
        return end["f"], end["torque"]

    def barchan(self):
        """Those of barchan."""
        strong = {"tensile_strength": 1e30, "shear_strength": 1e30}
        kind = bc.Bond(bc.laws.parallel_bond, kn=KN, ks=KS, radius_factor=FACTOR, **strong)
        grain = bc.Material("m", density=1.0, kn=1e-200, kt=1e-200, friction=0.0)
        sim = bc.Simulation(bc.Box((-3,) * 3, (12,) * 3), bc.laws.linear, grain, DT, bonds=kind)
        ids = sim.add_grains(self.position, np.repeat(self.radius, 2), mass=HEAVY, velocity=self.velocity, omega=self.omega)
        assert sim.install_bonds(overlap=-1e-6) == PAIRS
        sim.run(STEPS)
        rows = sim.grains.row_of(ids)
        assert len(bond_table(sim)["first"]) == PAIRS
        return sim.grains.view("force")[rows], sim.grains.view("torque")[rows]


@pytest.fixture(scope="module")
def differences(tmp_path_factory):
    """Largest difference of forces and torques by kind of motion, relative to its loads: size of the motions -> (6, 2)."""
    found = {}
    for size in (1e-3, 1e-4):
        pairs = Moving(size)
        theirs, ours = pairs.lammps(tmp_path_factory.mktemp("bond")), pairs.barchan()
        gaps, loads = (
            [np.abs(part).reshape(len(KINDS), -1).max(axis=1) for part in parts]
            for parts in ([a - b for a, b in zip(ours, theirs)], theirs)
        )
        lever = 0.5  # of a force: in some motions there are forces only, in others couples
        load = np.maximum(loads[0] * lever, loads[1])
        found[size] = np.stack([gaps[0] * lever / load, gaps[1] / load], axis=1)
    return found


def test_loads_equal_those_of_lammps_but_for_the_square_of_the_way(differences):
    for size, difference in differences.items():
        assert (difference < 0.5 * size).all(), (size, dict(zip(KINDS, difference.tolist())))


def test_the_difference_falls_with_the_size_of_the_motion(differences):
    """So it is no error of a factor in any of the loads. Where it is rounding (LAMMPS takes angles from cosines) it need not."""
    large, small = differences[1e-3], differences[1e-4]
    assert (small < np.maximum(0.2 * large, 1e-6)).all()
