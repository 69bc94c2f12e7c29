"""Some dozen overlapping grains that move and spin at random: the same state in barchan and in LAMMPS' ``pair granular``."""

import numpy as np
from lammps_peer import (
    HEAD,
    SNAPSHOTS,
    contacts_of,
    dense_packing,
    largest_contact_force,
    layer,
    run_lammps,
    start_like_lammps,
)

import barchan as bc
from barchan.bench.peers.lammps import write_data

COUNT, SIDE, HIGH, DENSITY = 60, 4.0, 12.0, 1.5


def with_arms_of_radius(law):
    """The law with arms R_i in the slip velocity, as LAMMPS has them, in place of those to the lens."""
    return bc.laws.Law(law.function, law.properties, law.history, "radius", law.mix, law.couple, law.adhesive, law.reach)


def as_lammps_has_them(sim, synchronized):
    """Forces and torques on all rows by a law with arms R_i, had it LAMMPS' arms R_i - overlap / 2 in the torque and, with
    `synchronized_verlet`, LAMMPS' direction of normal forces and of that torque: the half-step normal."""
    contacts, grains = contacts_of(sim), sim.grains
    i, j, normal = contacts["i"], contacts["j"], contacts["normal"]
    direction, radius, reduced = normal, grains.view("radius"), 0.5 * contacts["overlap"]
    if synchronized:
        position, velocity = grains.view("position"), grains.view("velocity")
        direction = sim.box.difference(position[i], position[j]) - 0.5 * sim.dt * (velocity[i] - velocity[j])
        direction /= np.sqrt((direction**2).sum(axis=1))[:, None]
    pressing = contacts["pressing"][:, None]
    tangential = contacts["force"] - pressing * normal
    force, torque = grains.view("force").copy(), grains.view("torque").copy()
    for rows, sign in ((i, 1.0), (j, -1.0)):
        np.add.at(force, rows, sign * pressing * (direction - normal))
        arm = radius[rows][:, None]
        change = arm * np.cross(normal, tangential) - (arm - reduced[:, None]) * np.cross(direction, tangential)
        np.add.at(torque, rows, change)
    return force, torque


class SameState:
    """Grains of radii 0.3 to 0.5, periodic along x and y, overlapping by about 1 %.

    Args:
        law: with arms R_i.
        properties: of barchan's material.
        constants: what stands in LAMMPS' ``pair_coeff``.
        synchronized: with LAMMPS' `synchronized_verlet`.
        grains: position, radius, velocity and omega of other grains.
    """

    def __init__(self, folder, law, properties, constants, dt, synchronized=True, grains=None):
        self.synchronized = synchronized
        position, radius, velocity, omega = grains or self.packing()
        write_data(folder / "grains.data", (0, 0, -1), (SIDE, SIDE, HIGH), position, radius, DENSITY, velocity, omega)
        self.lammps = run_lammps(
            f"""{HEAD}
boundary p p f
read_data grains.data
pair_style granular
pair_coeff * * {constants} {"synchronized_verlet" if synchronized else ""}
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
        self.force, self.torque = as_lammps_has_them(self.sim, synchronized)

    @staticmethod
    def packing():
        """Position, radius, velocity and omega of the grains."""
        rng = np.random.default_rng(3)
        radius = rng.uniform(0.3, 0.5, COUNT)
        position = dense_packing(radius, SIDE, seed=4)
        return position, 1.012 * radius, rng.normal(0.0, 0.3, (COUNT, 3)), rng.normal(0.0, 0.6, (COUNT, 3))

    def run(self, steps):
        """Advance with forces and torques as LAMMPS has them; the first step starts from LAMMPS' own."""
        if self.sim.step_number == 0:
            start_like_lammps(self.sim, self.ids, self.lammps["start"])
        for _ in range(steps):
            self.sim.run(1)
            self.force, self.torque = as_lammps_has_them(self.sim, self.synchronized)
            self.sim.grains.force, self.sim.grains.torque = self.force, self.torque

    def deviation(self, name):
        """Larger of the differences of force and torque to a snapshot, relative to the largest contact force."""
        rows, theirs = self.sim.grains.row_of(self.ids), self.lammps[name]
        found = (self.force[rows] - theirs["f"], self.torque[rows] - theirs["torque"])
        return max(float(np.abs(difference).max()) for difference in found) / largest_contact_force(self.sim)
