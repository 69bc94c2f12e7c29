"""Laws that come with barchan against LAMMPS' ``pair granular`` on the same state: 60 grains with about four contacts each.

| law             | LAMMPS                                                                          |
|-----------------|---------------------------------------------------------------------------------|
| `shm`           | `hertz/material`, `mindlin/force`, `damping velocity` with 0                    |
| `hertz_mindlin` | the same, `damping coeff_restitution`, `limit_damping`                          |
| `dmt`           | `dmt` with cohesion w / 2, as its pull is 4 pi R* cohesion, and the rest of `shm` |

k_t = 8 G* in numbers. Two things differ, and are taken out:

- Arms. LAMMPS has R_i in the slip velocity and R_i - overlap / 2 in the torque, barchan reaches to the plane of the lens in
  both. Here the laws get arms R_i, and their torques are made anew with LAMMPS' arms (``same_state.py``).
- The half step. barchan turns only the memory through the plane of the half-step normal; LAMMPS with `synchronized_verlet`
  lets the normal force act along the half-step normal, too: a difference of first order in dt. To rounding, laws are compared
  that get the full-step normal in place of the half-step one, with LAMMPS' default scheme.

``hertz_mindlin_standard`` with two materials, dashpot and wall, to rounding: test_lammps_hertz_mindlin.
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from lammps_peer import TOLERANCE, contacts_of
from same_state import SameState, with_arms_of_radius

import barchan as bc
from barchan.laws.dmt import ADHESION, dmt
from barchan.laws.hertz_mindlin import PROPERTIES, mix_with, restitution_of
from barchan.laws.shm import ELASTIC as ELASTIC_PROPERTIES
from barchan.laws.shm import mix_elastic, shm

MODULUS, POISSON, DT = 1e5, 0.3, 2e-4
SHEAR_STIFFNESS = 8.0 * MODULUS / (4.0 * (2.0 - POISSON) * (1.0 + POISSON))
ELASTIC = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON}
WORK = 4.0


@bc.law(properties=ELASTIC_PROPERTIES, history={"shear": 3}, lever="radius", mix=mix_elastic)
def shm_at_full_step(
    overlap, normal, normal_velocity, tangential_velocity, radius_eff, mass_eff, dt, E_eff, G_eff, friction, alpha, shear
):
    """`shm` with full-step normals and arms R_i."""
    velocities = normal_velocity, tangential_velocity, tangential_velocity
    return shm(overlap, normal, normal, *velocities, radius_eff, mass_eff, dt, E_eff, G_eff, friction, alpha, shear)


@bc.law(properties=PROPERTIES | ADHESION, history={"shear": 3}, lever="radius", mix=mix_with(ADHESION), adhesive=True)
def dmt_at_full_step(
    overlap,
    normal,
    normal_velocity,
    tangential_velocity,
    radius_eff,
    mass_eff,
    dt,
    E_eff,
    G_eff,
    friction,
    alpha,
    work_of_adhesion,
    shear,
):
    """`dmt` with full-step normals and arms R_i."""
    velocities = normal_velocity, tangential_velocity, tangential_velocity
    pair = E_eff, G_eff, friction, alpha, work_of_adhesion
    return dmt(overlap, normal, normal, *velocities, radius_eff, mass_eff, dt, *pair, shear)


def state(folder, name, law, friction, dt=DT, scheme="", grains=None):
    """The state with LAMMPS' form of the law ``name``, and with ``law`` in barchan."""
    more, normal, damping = {}, f"hertz/material {MODULUS} 0.0 {POISSON}", "velocity"
    if name == "dmt":
        more, normal = {"work_of_adhesion": WORK}, f"dmt {MODULUS} 0.0 {POISSON} {0.5 * WORK}"
    if name == "hertz_mindlin":  # LAMMPS' dashpot has z = -ln e / sqrt(pi^2 + ln^2 e), for e = 0.7 here
        more = {"restitution": restitution_of(-log(0.7) / sqrt(pi**2 + log(0.7) ** 2))}
        normal, damping = f"hertz/material {MODULUS} 0.7 {POISSON}", "coeff_restitution limit_damping"
    constants = f"{normal} tangential mindlin/force {SHEAR_STIFFNESS:.17g} 1.0 {friction} damping {damping} {scheme}"
    return SameState(folder, law, ELASTIC | {"friction": friction} | more, constants, dt, grains)


@pytest.mark.parametrize("name", ["shm", "hertz_mindlin", "dmt"])
def test_forces_of_a_state_without_a_past(tmp_path, name):
    """Normal forces, and those of the dashpots: 1e-12 of the largest. Friction 1e4, so that no contact slides: where one does
    without a memory, LAMMPS leaves out friction (``start_like_lammps``)."""
    scene = state(tmp_path, name, with_arms_of_radius(bc.laws.SHIPPED[name]), friction=1e4)
    assert scene.sim.touching > 100
    assert scene.deviation("start") < 1e-12
    pressing = contacts_of(scene.sim)["pressing"]
    assert (pressing.min() < 0.0) == (name == "dmt") and pressing.max() > 0.0


def test_shm_with_a_memory_of_one_step_and_of_twenty(tmp_path):
    """To 1e-10, friction 0.05: a part of the contacts slides."""
    scene = state(tmp_path, "shm", shm_at_full_step, friction=0.05)
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    contacts = contacts_of(scene.sim)
    slides = np.mean(contacts["tangential"] > (1.0 - 1e-9) * 0.05 * contacts["pressing"])
    assert 0.01 < slides < 0.99


def pairs():
    """Grains that touch by twos, overlapping by 2 % of their radius."""
    rng = np.random.default_rng(8)
    number = np.arange(24)
    normal = rng.normal(size=(24, 3))
    normal *= 0.99 * 0.4 / np.sqrt((normal**2).sum(axis=1))[:, None]
    lots = 2.0 * np.stack([number % 2, number // 2 % 2, number // 4], axis=1) + [1.0, 1.0, 0.5]
    position = np.stack([lots - normal, lots + normal], axis=1).reshape(-1, 3)
    return position, np.full(48, 0.4), rng.normal(0.0, 0.1, (48, 3)), rng.normal(0.0, 0.1, (48, 3))


def test_dmt_with_a_memory_of_one_step_and_of_twenty(tmp_path):
    """To 1e-10, pairs that neither slide nor part: the limits of friction differ, see the next test."""
    scene = state(tmp_path, "dmt", dmt_at_full_step, friction=0.5, grains=pairs())
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    assert contacts_of(scene.sim)["tangential"].max() > 1.0


def test_friction_of_dmt_has_another_limit(tmp_path):
    """Two grains that slide: at most mu times the elastic part in barchan (Derjaguin), that and the pull in LAMMPS (Thornton)."""
    radius, overlap = 0.4, 0.01
    position = np.array([[0.0, 0.0, 0.0], [2.0 * radius - overlap, 0.0, 0.0]])
    velocity = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    grains = position, np.full(2, radius), velocity, 0.0 * velocity
    scene = state(tmp_path, "dmt", dmt_at_full_step, friction=0.1, grains=grains)
    scene.run(20)
    pull, modulus = 2.0 * pi * WORK * 0.5 * radius, MODULUS / (2.0 * (1.0 - POISSON**2))
    elastic = 4.0 / 3.0 * modulus * sqrt(0.5 * radius) * contacts_of(scene.sim)["overlap"][0] ** 1.5
    assert contacts_of(scene.sim)["tangential"][0] == pytest.approx(0.1 * elastic, rel=1e-9)
    normal, theirs = contacts_of(scene.sim)["normal"][0], scene.lammps["twenty"]["f"][0]
    assert np.linalg.norm(theirs - (theirs @ normal) * normal) == pytest.approx(0.1 * (elastic + pull), rel=1e-3)


@pytest.mark.parametrize("name", ["shm", "hertz_mindlin"])
def test_the_half_step_differs_in_first_order_of_the_step(tmp_path, name):
    """Shipped laws and `synchronized_verlet`, one step: 1e-3 of the largest force, and half as much with half the step."""
    found = []
    for number, dt in enumerate((DT, 0.5 * DT)):
        folder = tmp_path / str(number)
        folder.mkdir()
        law = with_arms_of_radius(bc.laws.SHIPPED[name])
        scene = state(folder, name, law, friction=10.0, dt=dt, scheme="synchronized_verlet")
        scene.run(1)
        found.append(scene.deviation("one"))
    assert found[0] < 1e-3
    assert found[1] == pytest.approx(0.5 * found[0], rel=0.1)
