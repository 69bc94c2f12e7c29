"""Hertz-Mindlin in the standard scheme against LAMMPS ``pair granular hertz/material``.

In all cases: 200 grains of two materials (radii 0.3 to 0.9) in a random packing (four to five contacts a grain) on a plane,
moving and spinning at random. Forces *and* torques of every grain after 1 and after 20 steps, to 1e-10 of the largest
contact force.

Torque arms: LAMMPS uses R - overlap/2 between grains (R at a wall), ``hertz_mindlin_standard`` R_i throughout; both take R_i
for the slip velocity. So torques cannot be equal as they stand. They are compared exactly all the same: the torque is made
anew from barchan's contact forces with LAMMPS' arms, compared with LAMMPS' torque, and written into ``grains.torque``
before the next step, so that spins follow LAMMPS' arms in both codes for all 20 steps. (That barchan's own torques are right
with arms R_i, test_lammps_dense.py shows against ``gran/hertz/history``, whose arms are R_i.)

Mixing: LAMMPS and barchan combine E* by contact mechanics and take geometric means of friction. They differ in G*: LAMMPS
with k_t = NULL computes it from E* as if that were a Young's modulus, barchan combines both materials' compliances; so k_t =
8 G* is given in numbers. LAMMPS takes the geometric mean of e and makes Tsuji's alpha from that by a polynomial; barchan
makes alpha from e by its own map, so each pair gets the restitution for which barchan's alpha is LAMMPS'.
"""

from math import sqrt

import numpy as np
import pytest
from lammps_peer import (
    HEAD,
    SNAPSHOTS,
    TOLERANCE,
    contacts_of,
    dense_packing,
    deviations,
    layer,
    run_lammps,
    start_like_lammps,
    torque_with_half_overlap_arms,
)

import barchan as bc
from barchan.bench.peers.lammps import write_data
from barchan.laws.friction import sliding_ratio
from barchan.laws.hertz_mindlin import PROPERTIES, mix, restitution_of
from barchan.laws.vector import add, scale, turn

COUNT, SIDE, DENSITY, DT = 200, 8.0, 1.5, 2e-4
FRICTION = (0.5, 0.2)
RESTITUTION = (0.9, 0.6)
POISSON = (0.2, 0.4)
SOFT = 1e5


def shear_compliance(modulus, poisson):
    """Compliance whose sum over both grains is 1/G*."""
    return 2.0 * (2.0 - poisson) * (1.0 + poisson) / modulus


def compliance(modulus, poisson):
    """Compliance whose sum over both grains is 1/E*."""
    return (1.0 - poisson**2) / modulus


def tsuji_polynomial(e):
    """Tsuji's alpha as a function of restitution: LAMMPS manual, pair granular."""
    return 1.2728 - 4.2783 * e + 11.087 * e**2 - 22.348 * e**3 + 27.467 * e**4 - 18.022 * e**5 + 4.8218 * e**6


@pytest.fixture(scope="module")
def tsuji_alpha(tmp_path_factory):
    """LAMMPS' alpha as a function of e. Later versions multiply the polynomial by sqrt(2); a contact of two grains tells."""
    radius, overlap, speed, poisson, e = 0.5, 0.01, 1.0, 0.3, 0.5
    folder = tmp_path_factory.mktemp("alpha")
    write_data(
        folder / "two.data",
        (-2, -2, -2),
        (2, 2, 2),
        np.array([[0.0, 0.0, 0.0], [2.0 * radius - overlap, 0.0, 0.0]]),
        np.full(2, radius),
        DENSITY,
        np.array([[speed, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        np.zeros((2, 3)),
    )
    lammps = run_lammps(
        f"""{HEAD}
boundary f f f
read_data two.data
pair_style granular
pair_coeff * * hertz/material {SOFT} {e} {poisson} tangential mindlin/force NULL 1.0 0.5 damping tsuji
fix 1 all nve/sphere
run 0
snapshot start
""",
        folder,
    )
    a = sqrt(0.5 * radius * overlap)
    stiffness = 4.0 / 3.0 * a / (2.0 * compliance(SOFT, poisson))
    mass = 4.0 / 3.0 * np.pi * radius**3 * DENSITY
    force = -lammps["start"]["f"][0, 0]
    alpha = (force - stiffness * overlap) / (speed * sqrt(0.5 * mass * stiffness))
    factor = alpha / tsuji_polynomial(e)
    known = min((1.0, sqrt(2.0)), key=lambda value: abs(value - factor))
    assert factor == pytest.approx(known, rel=1e-9)
    return lambda e: known * tsuji_polynomial(e)


def moduli(mixing):
    """Young's moduli of both materials: equal G* (so that LAMMPS' own mixing fits), or quite different ones."""
    if mixing == "own rules":
        return SOFT, SOFT * shear_compliance(1.0, POISSON[1]) / shear_compliance(1.0, POISSON[0])
    return SOFT, 4.0 * SOFT


def lammps_script(mixing, tangential, damped):
    """The scene for LAMMPS; the wall has the constants of material 1 for grains of both materials."""
    young = moduli(mixing)

    def constants(modulus, e, poisson, shear, friction):
        damping = f"{e:.17g} {poisson}", "tsuji limit_damping"
        if not damped:
            damping = f"0.0 {poisson}", "velocity"
        return (
            f"hertz/material {modulus:.17g} {damping[0]} tangential {tangential} {8.0 / shear:.17g} 1.0 {friction:.17g} "
            f"damping {damping[1]}"
        )

    own = [
        constants(young[m], RESTITUTION[m], POISSON[m], 2.0 * shear_compliance(young[m], POISSON[m]), FRICTION[m]) for m in (0, 1)
    ]
    lines = [f"pair_coeff {m + 1} {m + 1} {own[m]}" for m in (0, 1)]
    if mixing == "given":
        together = sum(compliance(*material) for material in zip(young, POISSON))
        poisson = 0.3
        lines.append(
            "pair_coeff 1 2 "
            + constants(
                2.0 * (1.0 - poisson**2) / together,
                sqrt(RESTITUTION[0] * RESTITUTION[1]),
                poisson,
                sum(shear_compliance(*material) for material in zip(young, POISSON)),
                sqrt(FRICTION[0] * FRICTION[1]),
            )
        )
    return "\n".join(
        [
            HEAD,
            "boundary p p f",
            "read_data two.data",
            "pair_style granular",
            *lines,
            f"""
neighbor 0.3 bin
neigh_modify every 1 delay 0
timestep {DT}
fix 1 all gravity 1.0 vector 0 0 -1
fix 2 all wall/gran granular {own[0]} zplane 0.0 NULL
fix 3 all nve/sphere
{SNAPSHOTS}""",
        ]
    )


class Scene:
    """The same packing in both codes; ``lammps`` holds the snapshots, ``sim`` is started."""

    def __init__(self, folder, law, mixing, tangential, alpha):
        rng = np.random.default_rng(1)
        radius = rng.uniform(0.3, 0.9, COUNT)
        position = dense_packing(radius, SIDE, seed=5)
        radius *= 1.012
        kind = rng.integers(0, 2, COUNT)
        velocity, omega = rng.normal(0.0, 0.5, (COUNT, 3)), rng.normal(0.0, 1.0, (COUNT, 3))
        write_data(folder / "two.data", (0, 0, -1), (SIDE, SIDE, 20), position, radius, DENSITY, velocity, omega, kind + 1)
        self.lammps = run_lammps(lammps_script(mixing, tangential, alpha is not None), folder)
        self.sim = layer(law, self.materials(mixing, alpha), DT, (0.0, 0.0, -1.0), (SIDE, SIDE, 20), floor="floor")
        self.set_pairs(mixing, alpha)
        self.ids = self.sim.add_grains(position, radius, kind, velocity, omega)
        start_like_lammps(self.sim, self.ids, self.lammps["start"])

    @staticmethod
    def restitution(alpha, e):
        """The restitution for which barchan's alpha is that of LAMMPS for ``e``."""
        return 1.0 if alpha is None else restitution_of(alpha(e) / sqrt(5.0))

    def properties(self, mixing, alpha, m):
        return {
            "youngs_modulus": moduli(mixing)[m],
            "poisson_ratio": POISSON[m],
            "friction": FRICTION[m],
            "restitution": self.restitution(alpha, RESTITUTION[m]),
        }

    def materials(self, mixing, alpha):
        first, second = (self.properties(mixing, alpha, m) for m in (0, 1))
        return [
            bc.Material("soft", density=DENSITY, **first),
            bc.Material("stiff", density=DENSITY, **second),
            bc.Material("floor", **first),
        ]

    def set_pairs(self, mixing, alpha):
        mixed = self.restitution(alpha, sqrt(RESTITUTION[0] * RESTITUTION[1]))
        self.sim.materials.set_pair("soft", "stiff", restitution=mixed)
        self.sim.materials.set_pair("stiff", "floor", **self.properties(mixing, alpha, 0))

    def run(self, steps):
        """Advance with LAMMPS' torque arms."""
        for _ in range(steps):
            self.sim.run(1)
            self.sim.grains.torque = torque_with_half_overlap_arms(self.sim)

    def deviation(self, name):
        """Larger of the relative differences of force and torque."""
        return max(deviations(self.sim, self.ids, self.lammps[name], torque_with_half_overlap_arms(self.sim)))

    def sliding_share(self):
        """Share of contacts at Coulomb's limit."""
        contacts = contacts_of(self.sim)
        friction = np.array([*FRICTION, FRICTION[0]])
        kind = self.sim.grains.view("material")
        first = friction[kind[contacts["i"]]]
        limit = np.where(contacts["wall"], FRICTION[0], np.sqrt(first * friction[kind[contacts["j"]]]))
        return np.mean(contacts["tangential"] > (1.0 - 1e-9) * limit * contacts["pressing"])


@pytest.mark.parametrize("mixing", ["own rules", "given"])
@pytest.mark.parametrize("damped", [False, True], ids=["elastic", "tsuji"])
def test_force_memory_equals_lammps_mindlin_force(tmp_path, tsuji_alpha, mixing, damped):
    """``hertz_mindlin_standard`` against `hertz/material` with `mindlin/force`, elastic and with `tsuji` damping.

    Young's modulus 1e5, nu 0.2 and 0.4, mu 0.5 and 0.2; damped: e 0.9 and 0.6, LAMMPS with `limit_damping`, which is
    barchan's rule that a normal force is never tensile. Mixing by both codes' own rules where these coincide (materials of
    equal G*), or with LAMMPS' values of the pair given in numbers (moduli 1 : 4). Source: LAMMPS manual, pair granular.
    """
    scene = Scene(tmp_path, bc.laws.hertz_mindlin_standard, mixing, "mindlin/force", tsuji_alpha if damped else None)
    scene.run(1)
    assert scene.sim.touching > 2 * COUNT and (contacts_of(scene.sim)["wall"]).any()
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    assert 0.01 < scene.sliding_share() < 0.99


def test_first_step_equals_lammps_mindlin(tmp_path, tsuji_alpha):
    """``hertz_mindlin_standard`` against `mindlin` (memory of displacement) with `tsuji`, after 1 step.

    In the first step of a contact both memories say the same, k_t a dt v_t, since the contact radius has not changed yet.
    """
    scene = Scene(tmp_path, bc.laws.hertz_mindlin_standard, "own rules", "mindlin", tsuji_alpha)
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE


@bc.law(properties=PROPERTIES, history={"slip": 3}, mix=mix)
def mindlin_of_displacement(
    overlap, normal, normal_velocity, tangential_velocity, radius_eff, mass_eff, dt, E_eff, G_eff, friction, alpha, slip
):
    """A user's law: F_t = -8 G* a slip - eta v_t, the slip turned with the contact; Tsuji's eta in both directions."""
    a = sqrt(radius_eff * overlap)
    stiffness = 4.0 / 3.0 * E_eff * a
    shear_stiffness = 8.0 * G_eff * a
    eta = alpha * sqrt(mass_eff * stiffness)
    normal_force = max(stiffness * overlap - eta * normal_velocity, 0.0)
    slip = add(turn(slip, normal), scale(dt, tangential_velocity))
    viscous = scale(eta, tangential_velocity)
    trial = scale(-1.0, add(scale(shear_stiffness, slip), viscous))
    ratio = sliding_ratio(trial, friction * normal_force)
    force = scale(ratio, trial)
    if ratio < 1.0:
        slip = scale(-1.0 / shear_stiffness, add(force, viscous))
    return normal_force, force, slip


def test_users_law_equals_lammps_mindlin(tmp_path, tsuji_alpha):
    """A law written in this file with ``@law``, against `mindlin` with `tsuji` and `limit_damping`, for 20 steps.

    barchan ships the form that remembers the force; the one that remembers the displacement (it does not conserve energy in
    sticking contacts: numbers.md A4) is twenty lines of a user's file.
    """
    scene = Scene(tmp_path, mindlin_of_displacement, "given", "mindlin", tsuji_alpha)
    scene.run(1)
    assert scene.deviation("one") < TOLERANCE
    scene.run(19)
    assert scene.deviation("twenty") < TOLERANCE
    assert 0.01 < scene.sliding_share() < 0.99
