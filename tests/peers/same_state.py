"""Some dozen overlapping grains that move and spin at random: the same state in barchan and in LAMMPS' ``pair granular``."""

import numpy as np
from lammps_peer import HEAD, SNAPSHOTS, contacts_of, dense_packing, deviations, layer, run_lammps, start_like_lammps

import barchan as bc
from barchan.bench.peers.lammps import write_data

COUNT, SIDE, HIGH, DENSITY = 60, 4.0, 12.0, 1.5


def with_arms_of_radius(law):
    """The law with arms R_i in the slip velocity, as LAMMPS has them, in place of those to the lens."""
    return bc.laws.Law(law.function, law.properties, law.history, "radius", law.mix, law.couple, law.adhesive)


def torque_with_arms_of_lammps(sim):
    """Torques on all rows by a law with arms R_i, were they R_i - overlap / 2 between grains, as in ``pair granular``."""
    contacts = contacts_of(sim)
    pairs = ~contacts["wall"]
    change = (0.5 * contacts["overlap"][:, None] * np.cross(contacts["normal"], contacts["force"]))[pairs]
    torque = sim.grains.view("torque").copy()
    np.add.at(torque, contacts["i"][pairs], change)
    np.add.at(torque, contacts["j"][pairs], change)
    return torque


class SameState:
    """Grains of radii 0.3 to 0.5, periodic along x and y, overlapping by about 1 %.

    Args:
        law: with arms R_i.
        properties: of barchan's material.
        constants: what stands in LAMMPS' ``pair_coeff``.
        grains: position, radius, velocity and omega of other grains.
    """

    def __init__(self, folder, law, properties, constants, dt, grains=None):
        position, radius, velocity, omega = grains or self.packing()
        write_data(folder / "grains.data", (0, 0, -1), (SIDE, SIDE, HIGH), position, radius, DENSITY, velocity, omega)
        self.lammps = run_lammps(
            f"""{HEAD}
boundary p p f
read_data grains.data
pair_style granular
pair_coeff * * {constants}
neighbor 0.3 bin
neigh_modify every 1 delay 0
timestep {dt}
fix 1 all nve/sphere
{SNAPSHOTS}""",
            folder,
        )
        material = bc.Material("m", density=DENSITY, **properties)
        self.sim = layer(law, material, dt, (0.0, 0.0, 0.0), (SIDE, SIDE, HIGH), floor=None)
        self.ids = self.sim.add_grains(position, radius, velocity=velocity, omega=omega)
        self.sim.prepare()
        self.torque = torque_with_arms_of_lammps(self.sim)

    @staticmethod
    def packing():
        """Position, radius, velocity and omega of the grains."""
        rng = np.random.default_rng(3)
        radius = rng.uniform(0.3, 0.5, COUNT)
        position = dense_packing(radius, SIDE, seed=4)
        return position, 1.012 * radius, rng.normal(0.0, 0.3, (COUNT, 3)), rng.normal(0.0, 0.6, (COUNT, 3))

    def run(self, steps):
        """Advance with LAMMPS' torques; the first of them starts from LAMMPS' forces."""
        if self.sim.step_number == 0:
            start_like_lammps(self.sim, self.ids, self.lammps["start"])
        for _ in range(steps):
            self.sim.run(1)
            self.torque = torque_with_arms_of_lammps(self.sim)
            self.sim.grains.torque = self.torque

    def deviation(self, name):
        """Larger of the differences of force and torque to a snapshot, relative to the largest contact force."""
        return max(deviations(self.sim, self.ids, self.lammps[name], self.torque))
