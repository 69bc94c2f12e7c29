"""The reference itself, on cases that can be worked out by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from reference_dem import LAWS, ReferenceDEM, alpha_of_restitution

SOFT = {"kn": 200.0, "kt": 100.0, "gamma_n": 3.0, "gamma_t": 2.0, "friction": 0.5}
ELASTIC = {"youngs_modulus": 5000.0, "poisson_ratio": 0.25, "friction": 0.5, "restitution": 1.0}


def properties_for(law):
    return ELASTIC if law.startswith("hertz_mindlin") else SOFT


AT_REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def two_grains(law, properties, dt=1e-3, velocity=AT_REST, omega=AT_REST, **more):
    """Radii 1 and 2, masses 3 and 6, overlapping by 0.12 along x."""
    grains = {
        "position": [[0.0, 0.0, 0.0], [2.88, 0.0, 0.0]],
        "velocity": velocity,
        "omega": omega,
        "radius": [1.0, 2.0],
        "mass": [3.0, 6.0],
        "inertia": [1.2, 9.6],
        "material": [0, 0],
        "frozen": [False, False],
        **more,
    }
    return ReferenceDEM(law, [properties], {}, (-50,) * 3, (50,) * 3, (False,) * 3, grains, [], dt, lambda time: (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("law", "force"),
    [
        ("linear", 200.0 * 0.12),
        ("silbert", 0.2 * 200.0 * 0.12),  # sqrt(0.12 / 3) = 0.2
        ("hertz", np.sqrt(0.08) * 200.0 * 0.12),  # R_eff = 2/3
        ("hertz_mindlin", 4.0 / 3.0 * 5000.0 / 1.875 * np.sqrt(0.08) * 0.12),  # E* = E / (2 (1 - 1/16))
    ],
)
def test_normal_force_at_rest(law, force):
    dem = two_grains(law, properties_for(law))
    assert dem.force[0] == pytest.approx([-force, 0.0, 0.0], rel=1e-12)
    assert dem.force[1] == pytest.approx([force, 0.0, 0.0], rel=1e-12)


def test_damping_and_spin_of_the_paper():
    """Equations (3), (5), (6), (10) by hand: m_eff = 2, f = 0.2, closing at 0.5 along x, surfaces slipping at 1 w + 2 w'."""
    dem = two_grains("silbert", {**SOFT, "friction": 100.0}, velocity=((0.5, 0, 0), (0, 0, 0)), omega=((0, 0, 0.3), (0, 0, 0.2)))
    # n = (-1, 0, 0); v_n = -0.5; (0.3 + 0.4) z x n = (0, -0.7, 0), so v_t = (0, 0.7, 0)
    normal, tangential = 0.2 * (200.0 * 0.12 + 3.0 * 2.0 * 0.5), -0.2 * 2.0 * 2.0 * 0.7
    assert dem.force[0] == pytest.approx([-normal, tangential, 0.0], rel=1e-12)
    assert dem.torque[0] == pytest.approx([0.0, 0.0, tangential], rel=1e-12)  # -R n x F = R x-hat x F
    assert dem.torque[1] == pytest.approx([0.0, 0.0, 2.0 * tangential], rel=1e-12)


def test_sliding_contact_obeys_coulomb_and_keeps_its_memory():
    dem = two_grains("linear", {**SOFT, "gamma_n": 0.0, "gamma_t": 0.0, "friction": 0.01}, velocity=((0, 1.0, 0), (0, 0, 0)))
    for _ in range(20):
        dem.step()
    contact = dem.contacts[0, 1]
    normal = dem.position[0] - dem.position[1]
    normal /= np.sqrt(normal @ normal)
    pressing = contact.force @ normal
    tangential = contact.force - pressing * normal
    assert contact.slides
    assert np.sqrt(tangential @ tangential) == pytest.approx(0.01 * pressing, rel=1e-12)
    assert dem.memory[0, 1] == pytest.approx(-tangential / 100.0, rel=1e-9, abs=1e-12)  # equation (8)


@pytest.mark.parametrize("law", LAWS)
def test_momentum_is_conserved_and_angular_momentum_with_lens_arms(law):
    rng = np.random.default_rng(1)
    dem = two_grains(law, properties_for(law), velocity=rng.normal(size=(2, 3)), omega=rng.normal(size=(2, 3)))
    for _ in range(5):  # let the memory of the elastic laws grow
        dem.step()
    scale = np.abs(dem.force).max()
    assert np.abs(dem.force.sum(axis=0)).max() <= 1e-14 * scale
    twist = np.cross(dem.position, dem.force).sum(axis=0) + dem.torque.sum(axis=0)
    if LAWS[law][2] == "lens":
        assert np.abs(twist).max() <= 1e-12 * np.abs(dem.torque).max()
    else:  # arms of length R_i miss each other by the overlap: the paper's equation (10) does not conserve it
        assert np.abs(twist).max() > 1e-3 * np.abs(dem.torque).max()


@pytest.mark.parametrize("restitution", [0.4, 0.8])
def test_restitution_that_is_asked_for_is_the_one_seen(restitution):
    properties = {**ELASTIC, "youngs_modulus": 5e5, "restitution": restitution}
    dem = two_grains(
        "hertz_mindlin", properties, dt=1e-4, velocity=((2.0, 0, 0), (-2.0, 0, 0)), position=[[0, 0, 0], [3.0001, 0, 0]]
    )
    while dem.velocity[1, 0] - dem.velocity[0, 0] < 0.0 or dem.contacts:
        dem.step()
    assert dem.velocity[1, 0] - dem.velocity[0, 0] == pytest.approx(4.0 * restitution, rel=2e-3)
    assert 0.0 < alpha_of_restitution(0.9) < alpha_of_restitution(0.5)


def test_wall_and_immobile_grains_count_as_infinitely_heavy():
    """A grain on a wall and on an immobile grain of its radius feels the same in the paper's law."""
    wall = SimpleNamespace(point=np.array([0.0, 0.0, 0.0]), normal=np.array([0.0, 0.0, 1.0]), material=0, velocity=np.zeros(3))
    one = {
        "velocity": [[0.3, 0.0, -0.4]],
        "omega": [[0.0, 1.0, 0.0]],
        "radius": [1.0],
        "mass": [3.0],
        "inertia": [1.2],
        "material": [0],
        "frozen": [False],
        "position": [[0.0, 0.0, 0.95]],
    }
    two = {
        "velocity": [[0.3, 0.0, -0.4], [0, 0, 0]],
        "omega": [[0.0, 1.0, 0.0], [0, 0, 0]],
        "radius": [1.0, 1.0],
        "mass": [3.0, 5.0],
        "inertia": [1.2, 2.0],
        "material": [0, 0],
        "frozen": [False, True],
        "position": [[0.0, 0.0, 1.95], [0, 0, 0]],
    }
    box = ((-5,) * 3, (5,) * 3, (False,) * 3)
    on_wall = ReferenceDEM("silbert", [SOFT], {}, *box, one, [wall], 1e-3, lambda time: (0, 0, 0))
    on_grain = ReferenceDEM("silbert", [SOFT], {}, *box, two, [], 1e-3, lambda time: (0, 0, 0))
    assert on_wall.force[0] == pytest.approx(on_grain.force[0], rel=1e-12)
    assert on_wall.torque[0] == pytest.approx(on_grain.torque[0], rel=1e-12)
    assert np.abs(on_wall.torque[0]).max() > 0.0
    before = on_grain.velocity[1].copy()
    on_grain.step()
    assert (on_grain.velocity[1] == before).all()
