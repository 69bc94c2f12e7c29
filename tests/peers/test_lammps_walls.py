"""Walls of every shape against LAMMPS' ``fix wall/gran granular``: a dozen grains at each, which move and spin at random.

Law: ``hertz_mindlin_standard``, elastic, against `hertz/material` with `mindlin/force`; both codes have arms R at a wall. Both
give a cylinder the mean curvature 1/(2 R), a sphere 1/R, negative from inside, so Hertz' forces agree as those of a linear spring
do. At a cone LAMMPS takes 1/(2 R), R its radius at the height of the grain's *centre*, barchan cos(slope)/(2 R), R that at the
contact: there only ``linear_standard`` agrees.
"""

from copy import copy
from math import cos, sin, tau

import numpy as np
import pytest
from lammps_peer import HEAD, SNAPSHOTS, TOLERANCE, deviations, largest_contact_force, run_lammps, start_like_lammps

import barchan as bc
from barchan.bench.peers.lammps import write_data

MODULUS, POISSON, FRICTION, DENSITY, DT, COUNT = 1e5, 0.3, 0.2, 1.5, 2e-4, 12
SHEAR_STIFFNESS = 8.0 * MODULUS / (4.0 * (2.0 - POISSON) * (1.0 + POISSON))
KN, KT = 3000.0, 1000.0
OVERLAP, RADIUS, EDGE = 0.004, 4.0, 8.0
LOW, HIGH, LENGTH = 2.0, 5.0, 4.0

LAWS = {
    "hertz": (
        bc.laws.hertz_mindlin_standard,
        {"youngs_modulus": MODULUS, "poisson_ratio": POISSON},
        f"granular hertz/material {MODULUS} 0.0 {POISSON} tangential mindlin/force {SHEAR_STIFFNESS:.17g} 1.0 {FRICTION} "
        "damping velocity",
    ),
    "linear": (
        bc.laws.linear_standard,
        {"kn": KN, "kt": KT},
        f"granular hooke {KN} 0.0 tangential linear_history {KT} 0.0 {FRICTION} damping velocity",
    ),
}

#: Name -> wall of barchan, that of LAMMPS, and a function (angle, radius of a grain) -> its centre, OVERLAP deep in the wall.
WALLS = {
    "plane": (
        bc.Plane((0, 0, 0), (0, 0, 1)),
        "zplane 0.0 NULL",
        lambda angle, r: (RADIUS * cos(angle), RADIUS * sin(angle), r - OVERLAP),
    ),
    "leaning plane": (
        bc.Plane((0, 0, 0), (0.6, 0, 0.8)),
        "region plane 0 0 0 0.6 0 0.8",
        lambda angle, r: (
            0.8 * RADIUS * cos(angle) + 0.6 * (r - OVERLAP),
            RADIUS * sin(angle),
            -0.6 * RADIUS * cos(angle) + 0.8 * (r - OVERLAP),
        ),
    ),
    "in a cylinder": (
        bc.Cylinder((0, 0, 0), (0, 0, 1), RADIUS),
        f"zcylinder {RADIUS}",
        lambda angle, r: round_about(angle, RADIUS - r + OVERLAP, cos(3.0 * angle)),
    ),
    "around a cylinder": (
        bc.Cylinder((0, 0, 0), (0, 0, 1), RADIUS, inside=False),
        f"region cylinder z 0 0 {RADIUS} -7 7 side out",
        lambda angle, r: round_about(angle, RADIUS + r - OVERLAP, cos(3.0 * angle)),
    ),
    "in a sphere": (
        bc.Sphere((0, 0, 0), RADIUS),
        f"region sphere 0 0 0 {RADIUS}",
        lambda angle, r: on_sphere(angle, RADIUS - r + OVERLAP),
    ),
    "around a sphere": (
        bc.Sphere((0, 0, 0), RADIUS, inside=False),
        f"region sphere 0 0 0 {RADIUS} side out",
        lambda angle, r: on_sphere(angle, RADIUS + r - OVERLAP),
    ),
    "in a cone": (
        bc.Cone((0, 0, 0), (0, 0, 1), LOW, HIGH, LENGTH),
        f"region cone z 0 0 {LOW} {HIGH} 0 {LENGTH}",
        lambda angle, r: round_about(angle, 0.5 * (LOW + HIGH) - 0.8 * (r - OVERLAP), 0.5 * LENGTH + 0.6 * (r - OVERLAP)),
    ),
}


def round_about(angle, distance, height):
    """A point at a distance from the z axis."""
    return distance * cos(angle), distance * sin(angle), height


def on_sphere(angle, distance):
    """A point at a distance from the origin, above and below the equator."""
    up = 0.4 * cos(3.0 * angle)
    return round_about(angle, distance * cos(up), distance * sin(up))


def lammps_script(constants, wall):
    """The scene for LAMMPS; a file tells the sum of the forces that the wall's fix has stored."""
    region = ""
    if wall.startswith("region"):
        region, wall = wall.replace("region", "region wall", 1), "region wall"
    style = "wall/gran/region" if region else "wall/gran"
    sums = " ".join(f"$(c_sums[{axis}]:%.17g)" for axis in (1, 2, 3))
    return f"""{HEAD}
boundary f f f
read_data grains.data
pair_style gran/hooke/history {KN} {KT} 0.0 0.0 {FRICTION} 0
pair_coeff * *
neighbor 0.3 bin
neigh_modify every 1 delay 0
timestep {DT}
{region}
fix wall all {style} {constants} {wall} contacts
fix 1 all nve/sphere
compute sums all reduce sum f_wall[2] f_wall[3] f_wall[4]
thermo_style custom step c_sums[1] c_sums[2] c_sums[3]
{SNAPSHOTS}print "{sums}" file sums.txt
"""


class Scene:
    """Grains at a wall in both codes."""

    def __init__(self, folder, law, shape):
        law, properties, constants = LAWS[law]
        wall, region, place = WALLS[shape]
        rng = np.random.default_rng(2)
        radius = rng.uniform(0.2, 0.35, COUNT)
        position = np.array([place(angle, r) for angle, r in zip(np.linspace(0.1, tau + 0.1, COUNT, endpoint=False), radius)])
        velocity, omega = rng.normal(0.0, 0.1, (COUNT, 3)), rng.normal(0.0, 0.6, (COUNT, 3))
        write_data(folder / "grains.data", (-EDGE,) * 3, (EDGE,) * 3, position, radius, DENSITY, velocity, omega)
        self.lammps = run_lammps(lammps_script(constants, region), folder)
        self.stored = np.loadtxt(folder / "sums.txt")
        material = bc.Material("m", density=DENSITY, friction=FRICTION, **properties)
        self.sim = bc.Simulation(bc.Box((-EDGE,) * 3, (EDGE,) * 3), law, material, DT)
        self.wall = self.sim.add_wall(copy(wall))
        self.ids = self.sim.add_grains(position, radius, velocity=velocity, omega=omega)
        start_like_lammps(self.sim, self.ids, self.lammps["start"])

    def deviation(self, name):
        return max(deviations(self.sim, self.ids, self.lammps[name]))


@pytest.mark.parametrize(("law", "shape"), [("hertz", s) for s in WALLS if s != "in a cone"] + [("linear", s) for s in WALLS])
def test_forces_at_a_wall_equal_those_of_lammps(tmp_path, law, shape):
    """Forces and torques of the grains at the start to 1e-12, after 1 and 20 steps to 1e-10 of the largest; the wall's load.

    ``wall.force`` is that of the grains on the wall; the fix of LAMMPS stores that of the wall on the grains.
    """
    scene = Scene(tmp_path, law, shape)
    assert scene.sim.touching == scene.wall.contacts == COUNT
    assert scene.deviation("start") < 1e-12
    scene.sim.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.sim.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    allowed = {"rtol": 0.0, "atol": COUNT * TOLERANCE * largest_contact_force(scene.sim)}
    np.testing.assert_allclose(scene.wall.force, -scene.stored, **allowed)
    np.testing.assert_allclose(scene.stored, scene.lammps["twenty"]["f"].sum(axis=0), **allowed)
