"""The three pairs, and how one grain of each moves."""

import numpy as np

from barchan import laws
from barchan.domain import Box
from barchan.experiments.bond.parameters import LONGEST_WAY
from barchan.experiments.experiment import Stage
from barchan.laws.bond import Bond
from barchan.materials import Material
from barchan.simulation import Simulation

#: What is done to the pairs, in the order of their ids: pair k is made of the grains 2 k, at rest, and 2 k + 1.
TESTS = ("pull", "shear", "spin")

#: So heavy that no force changes how a grain moves [kg].
_HEAVY = 1e30


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: three pairs that just touch along x, one above the other; nothing is bonded yet.

    Args:
        scene: a ``BondTest``.
        with_grains: False leaves the grains to a checkpoint.
    """
    radius, edge = scene.radius, (2.0 * LONGEST_WAY) * scene.radius
    contact = {"kn": scene.contact_normal_stiffness, "kt": scene.contact_shear_stiffness, "friction": scene.friction}
    glue = Bond(
        laws.parallel_bond,
        kn=scene.bond_normal_stiffness,
        ks=scene.bond_shear_stiffness,
        tensile_strength=scene.tensile_strength,
        shear_strength=scene.shear_strength,
        radius_factor=scene.radius_factor,
    )
    box, material = Box((-edge,) * 3, (edge,) * 3), Material("stone", **contact)
    sim = Simulation(box, laws.linear, material, scene.dt, threads=threads, comm=comm, bonds=glue)
    if with_grains:
        places = [(side * radius, 0.0, 6.0 * radius * level) for level in (1, 0, -1) for side in (-1, 1)]
        speed, spin = np.zeros((6, 3)), np.zeros((6, 3))
        speed[1, 0] = speed[3, 1] = scene.speed
        spin[5, 0] = scene.speed / scene.bond_radius
        sim.add_grains(places, radius, "stone", velocity=speed, omega=spin, mass=_HEAVY)
    return sim


def stages(scene):
    """One stage, at whose begin the pairs are bonded."""
    return [Stage("bonded", scene.steps, lambda sim: sim.install_bonds(overlap=-1e-6 * scene.radius))]
