"""Resistance to rolling and twisting of ``hertz_mindlin_rolling`` against LAMMPS' `rolling sds` and `twisting sds`.

LAMMPS writes rolling as a pseudo-force at the arm R*: displacement rate R* (omega x n), force -k_roll xi - gamma_roll xi' of
at most mu_roll F_n, couple R* n x force; twisting as a couple. barchan's couples are -k theta - c theta' of at most mu R* F_n,
with k = 9/4 k_n (mu R*)^2 and c = 2 zeta sqrt(I k), k_n = F_n / overlap of Hertz, I = 7/5 or 2/5 m* min(R_i, R_j)^2. So

    rolling:   k_roll = k / R*^2 = 9/4 mu^2 k_n,  gamma_roll = c / R*^2,  mu_roll = mu
    twisting:  k_twist = k,  gamma_twist = c,  mu_twist = mu R*

LAMMPS' stiffness is one number a pair of types, barchan's changes with the overlap. So each pair of grains has a type of its own,
and grains are so heavy that their overlap stays. They turn about all axes and do not slip along the contact: friction is 0.
One difference is left: where twisting slips while it turns back, LAMMPS gives the couple the sign against the present
rotation, barchan that of spring and dashpot; nothing turns back here.
"""

from math import pi

import numpy as np
import pytest
from lammps_peer import HEAD, SNAPSHOTS, TOLERANCE, run_lammps, start_like_lammps

import barchan as bc
from barchan.bench.peers.lammps import write_data

MODULUS, POISSON, DENSITY, DT, PAIRS, LOT = 1e5, 0.3, 1e9, 2e-4, 24, 3.0
ROLLING, TWISTING, DAMPING = 0.3, 0.2, 1e-5
MODULUS_EFF = MODULUS / (2.0 * (1.0 - POISSON**2))


class Pairs:
    """Pairs of grains that overlap by 0.1 to 1 % of their size, each pair alone in its lot, turning slowly or fast."""

    def __init__(self):
        rng = np.random.default_rng(6)
        self.radius = rng.uniform(0.3, 0.6, (PAIRS, 2))
        self.overlap = np.geomspace(0.001, 0.01, PAIRS) * self.radius.min(axis=1)
        normal = rng.normal(size=(PAIRS, 3))
        normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
        number = np.arange(PAIRS)
        lots = LOT * np.stack([number % 3, number // 3 % 3, number // 9], axis=1)
        apart = (self.radius.sum(axis=1) - self.overlap)[:, None]
        self.position = np.stack([lots, lots + apart * normal], axis=1).reshape(-1, 3)
        self.omega = (rng.normal(size=(PAIRS, 2, 3)) * np.geomspace(0.01, 30.0, PAIRS)[:, None, None]).reshape(-1, 3)

    def coefficients(self):
        """LAMMPS' six numbers of each pair: k, gamma and mu of rolling, the same of twisting."""
        radius_eff = self.radius.prod(axis=1) / self.radius.sum(axis=1)
        mass = 4.0 / 3.0 * pi * self.radius**3 * DENSITY
        heavy = mass.prod(axis=1) / mass.sum(axis=1) * self.radius.min(axis=1) ** 2
        stiffness_n = 4.0 / 3.0 * MODULUS_EFF * np.sqrt(radius_eff * self.overlap)
        roll, twist = (2.25 * stiffness_n * (mu * radius_eff) ** 2 for mu in (ROLLING, TWISTING))
        roll_damping, twist_damping = (2.0 * DAMPING * np.sqrt(i * heavy * k) for i, k in ((1.4, roll), (0.4, twist)))
        square = radius_eff**2
        mu_roll = np.full(PAIRS, ROLLING)
        return np.stack([roll / square, roll_damping / square, mu_roll, twist, twist_damping, TWISTING * radius_eff], axis=1)

    def lammps(self, folder):
        """Snapshots of LAMMPS."""
        radius, low, high, still = self.radius.ravel(), (-2.0,) * 3, (12.0,) * 3, 0.0 * self.position
        kind = np.repeat(np.arange(1, PAIRS + 1), 2)
        write_data(folder / "pairs.data", low, high, self.position, radius, DENSITY, still, self.omega, kind)
        lines = [
            f"pair_coeff {k} {k} hertz/material {MODULUS} 0.0 {POISSON} tangential linear_history 0.0 0.0 0.0 damping velocity "
            "rolling sds {:.17g} {:.17g} {:.17g} twisting sds {:.17g} {:.17g} {:.17g}".format(*row)
            for k, row in enumerate(self.coefficients(), start=1)
        ]
        return run_lammps(
            "\n".join(
                [
                    f"{HEAD}\nboundary f f f\nread_data pairs.data\npair_style granular",
                    *lines,
                    f"neighbor 0.3 bin\nneigh_modify every 1 delay 0\ntimestep {DT}\nfix 1 all nve/sphere\n{SNAPSHOTS}",
                ]
            ),
            folder,
        )

    def barchan(self):
        """The same in barchan, and the ids of the grains."""
        elastic = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "friction": 0.0, "restitution": 1.0}
        resistance = {"rolling_friction": ROLLING, "twisting_friction": TWISTING, "rolling_damping": DAMPING}
        material = bc.Material("m", density=DENSITY, **elastic, **resistance)
        sim = bc.Simulation(bc.Box((-2,) * 3, (12,) * 3), bc.laws.hertz_mindlin_rolling, material, DT)
        return sim, sim.add_grains(self.position, self.radius.ravel(), omega=self.omega)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Couples on the grains after 1 and after 20 steps, in barchan and in LAMMPS, and the limit of each pair."""
    pairs = Pairs()
    lammps = pairs.lammps(tmp_path_factory.mktemp("rolling"))
    sim, ids = pairs.barchan()
    start_like_lammps(sim, ids, lammps["start"])
    found = {}
    for name, steps in (("one", 1), ("twenty", 19)):
        sim.run(steps)
        found[name] = sim.grains.view("torque")[sim.grains.row_of(ids)], lammps[name]["torque"]
    radius_eff = pairs.radius.prod(axis=1) / pairs.radius.sum(axis=1)
    pressing = 4.0 / 3.0 * MODULUS_EFF * np.sqrt(radius_eff) * pairs.overlap**1.5
    normal = np.diff(pairs.position.reshape(PAIRS, 2, 3), axis=1)[:, 0]
    return found, radius_eff * pressing, normal / np.sqrt((normal**2).sum(axis=1))[:, None]


@pytest.mark.parametrize("name", ["one", "twenty"])
def test_couples_equal_those_of_lammps(both, name):
    """To 1e-10 of the limit of each pair; some pairs slip, some do not, in rolling and in twisting."""
    found, limit, normal = both
    ours, theirs = (torque.reshape(PAIRS, 2, 3) for torque in found[name])
    assert (np.abs(ours - theirs) / limit[:, None, None]).max() < TOLERANCE
    twisting = (ours[:, 0] * normal).sum(axis=1)
    rolling = np.sqrt((ours[:, 0] ** 2).sum(axis=1) - twisting**2)
    for couple, mu in ((np.abs(twisting), TWISTING), (rolling, ROLLING)):
        slips = couple > (1.0 - 1e-6) * mu * limit
        assert 0 < slips.sum() < PAIRS
