"""Laws that come with barchan against LAMMPS' ``pair granular`` on the same state: 60 grains with about four contacts each.

| law             | LAMMPS                                                                          |
|-----------------|---------------------------------------------------------------------------------|
| `shm`           | `hertz/material`, `mindlin/force`, `damping velocity` with 0                    |
| `hertz_mindlin` | the same, `damping coeff_restitution`, `limit_damping`                          |
| `dmt`           | `dmt` with cohesion w / 2, as its pull is 4 pi R* cohesion, and the rest of `shm` |
| `jkr`           | `jkr` with cohesion w / 2, and the rest of `shm`                                |

k_t = 8 G* in numbers, with `synchronized_verlet`, LAMMPS' name for the memory that is turned through the plane of the half-step
normal. Two things differ, and are taken out of the comparison (``same_state.py``):

- Arms. LAMMPS has R_i in the slip velocity and R_i - overlap / 2 in the torque, barchan reaches to the plane of the lens in
  both. Here the laws get arms R_i, and torques are made anew with LAMMPS' arms.
- Directions. LAMMPS lets normal forces act along the half-step normal, too, and takes it for the torque; barchan only turns the
  memory by it. Forces are made anew along it: the same numbers in another direction, 4e-4 of them apart here.

The dashpot of `hertz_mindlin` differs in one more: LAMMPS takes the normal velocity along the half-step normal.

``hertz_mindlin_standard`` with two materials, dashpot and wall, to rounding: test_lammps_hertz_mindlin.
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from lammps_peer import TOLERANCE, contacts_of
from same_state import SameState, with_arms_of_radius

import barchan as bc
from barchan.laws.hertz_mindlin import restitution_of

MODULUS, POISSON, DT = 1e5, 0.3, 2e-4
SHEAR_STIFFNESS = 8.0 * MODULUS / (4.0 * (2.0 - POISSON) * (1.0 + POISSON))
ELASTIC = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON}
WORK = 4.0


def state(folder, name, friction, dt=DT, work=WORK, **more_of_it):
    """The state with one of the laws, in both codes."""
    more, normal, damping = {}, f"hertz/material {MODULUS} 0.0 {POISSON}", "velocity"
    if name == "dmt":
        more, normal = {"work_of_adhesion": WORK}, f"dmt {MODULUS} 0.0 {POISSON} {0.5 * WORK}"
    if name == "jkr":
        more, normal = {"work_of_adhesion": work}, f"jkr {MODULUS} 0.0 {POISSON} {0.5 * work}"
    if name == "hertz_mindlin":  # LAMMPS' dashpot has z = -ln e / sqrt(pi^2 + ln^2 e), for e = 0.7 here
        more = {"restitution": restitution_of(-log(0.7) / sqrt(pi**2 + log(0.7) ** 2))}
        normal, damping = f"hertz/material {MODULUS} 0.7 {POISSON}", "coeff_restitution limit_damping"
    constants = f"{normal} tangential mindlin/force {SHEAR_STIFFNESS:.17g} 1.0 {friction} damping {damping}"
    law = with_arms_of_radius(bc.laws.SHIPPED[name])
    return SameState(folder, law, ELASTIC | {"friction": friction} | more, constants, dt, **more_of_it)


@pytest.mark.parametrize(
    "name", [*(pytest.param(name, marks=pytest.mark.validate) for name in ("shm", "dmt")), "hertz_mindlin", "jkr"]
)
def test_forces_of_a_state_without_a_past(tmp_path, name):
    """Normal forces, and those of the dashpots: 1e-12 of the largest. Friction 1e4, so that no contact slides: where one does
    without a memory, LAMMPS leaves out friction (``start_like_lammps``)."""
    scene = state(tmp_path, name, friction=1e4, synchronized=name != "hertz_mindlin")
    assert scene.sim.touching > 100
    assert scene.deviation("start") < 1e-12
    pressing = contacts_of(scene.sim)["pressing"]
    assert (pressing.min() < 0.0) == bc.laws.SHIPPED[name].adhesive and pressing.max() > 0.0


def test_shm_with_a_memory_of_one_step_and_of_twenty(tmp_path):
    """To 1e-10, friction 0.05: a part of the contacts slides."""
    scene = state(tmp_path, "shm", friction=0.05)
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    contacts = contacts_of(scene.sim)
    slides = np.mean(contacts["tangential"] > (1.0 - 1e-9) * 0.05 * contacts["pressing"])
    assert 0.01 < slides < 0.99


def pairs(overlap=8e-3):
    """Grains of radius 0.4 that touch by twos."""
    rng = np.random.default_rng(8)
    number = np.arange(24)
    normal = rng.normal(size=(24, 3))
    normal *= (0.4 - 0.5 * overlap) / np.sqrt((normal**2).sum(axis=1))[:, None]
    lots = 2.0 * np.stack([number % 2, number // 2 % 2, number // 4], axis=1) + [1.0, 1.0, 0.5]
    position = np.stack([lots - normal, lots + normal], axis=1).reshape(-1, 3)
    return position, np.full(48, 0.4), rng.normal(0.0, 0.1, (48, 3)), rng.normal(0.0, 0.1, (48, 3))


def test_dmt_with_a_memory_of_one_step_and_of_twenty(tmp_path):
    """To 1e-10, pairs that neither slide nor part: the limits of friction differ, see the next test."""
    scene = state(tmp_path, "dmt", friction=0.5, grains=pairs())
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    assert contacts_of(scene.sim)["tangential"].max() > 1.0


def test_jkr_with_contacts_that_last_beyond_touching(tmp_path):
    """To 1e-10 over twenty steps, after which some pairs are apart and held; both codes limit friction alike. (LAMMPS lets go at
    the largest pull; here a contact lasts as long as the curve goes on, to 5/9 of that pull. No pair comes so far.)"""
    position, radius, velocity, omega = pairs(overlap=1e-4)
    scene = state(tmp_path, "jkr", friction=0.5, grains=(position, radius, 5.0 * velocity, omega), work=40.0)
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    contacts, effective, modulus = contacts_of(scene.sim), 0.2, MODULUS / (2.0 * (1.0 - POISSON**2))
    largest_pull_at = -((9.0 * pi * 40.0 * effective**2 / (8.0 * modulus)) ** (2.0 / 3.0)) / (3.0 * effective)
    assert 5 < (contacts["overlap"] < 0.0).sum() < 24 and contacts["overlap"].min() > largest_pull_at
    assert contacts["tangential"].max() > 1.0


def test_friction_of_dmt_has_another_limit(tmp_path):
    """Two grains that slide: at most mu times the elastic part in barchan (Derjaguin), that and the pull in LAMMPS (Thornton)."""
    radius, overlap = 0.4, 0.01
    position = np.array([[0.0, 0.0, 0.0], [2.0 * radius - overlap, 0.0, 0.0]])
    velocity = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    grains = position, np.full(2, radius), velocity, 0.0 * velocity
    scene = state(tmp_path, "dmt", friction=0.1, synchronized=False, grains=grains)
    scene.run(20)
    pull, modulus = 2.0 * pi * WORK * 0.5 * radius, MODULUS / (2.0 * (1.0 - POISSON**2))
    elastic = 4.0 / 3.0 * modulus * sqrt(0.5 * radius) * contacts_of(scene.sim)["overlap"][0] ** 1.5
    assert contacts_of(scene.sim)["tangential"][0] == pytest.approx(0.1 * elastic, rel=1e-9)
    normal, theirs = contacts_of(scene.sim)["normal"][0], scene.lammps["twenty"]["f"][0]
    assert np.linalg.norm(theirs - (theirs @ normal) * normal) == pytest.approx(0.1 * (elastic + pull), rel=1e-3)


def test_the_dashpot_differs_in_first_order_of_the_step(tmp_path):
    """`hertz_mindlin` with a dashpot, one step: 1e-3 of the largest force, and half as much with half the step."""
    found = []
    for number, dt in enumerate((DT, 0.5 * DT)):
        folder = tmp_path / str(number)
        folder.mkdir()
        scene = state(folder, "hertz_mindlin", friction=10.0, dt=dt)
        scene.run(1)
        found.append(scene.deviation("one"))
    assert found[0] < 1e-3
    assert found[1] == pytest.approx(0.5 * found[0], rel=0.1)
