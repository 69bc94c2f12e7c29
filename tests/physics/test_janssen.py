"""Janssen's law: the wall of a silo carries what friction lets it carry, and the floor feels a weight that saturates.

p = rho g l (1 - exp(-h / l)) with l = R / (2 K mu_w), K the ratio of horizontal to vertical stress (Janssen 1895). In weights,
with W of the grains: the floor carries W_s (1 - exp(-W / W_s)), W_s = rho g l pi R^2. The wall slides up along the grains slowly,
so that its friction points one way (Bertho, Giorgiutti-Dauphine & Hulin, Phys. Rev. Lett. 90, 144301, 2003). mu_w is then
friction over pressing force as measured: 0.59 to 0.81 of the coefficient of friction here, not all of it.
"""

from math import exp, pi, sqrt
from typing import NamedTuple

import numpy as np
import pytest

import barchan as bc

pytestmark = pytest.mark.filterwarnings("ignore:.*overlap by more than")  # where grains fall, at the start

RADIUS, KN, GRAIN_FRICTION, GRAVITY = 3.0, 2000.0, 0.5, 1.0
MASS = 4.0 / 3.0 * pi * 0.5**3
DT = 0.1 * sqrt(0.5 * MASS / KN)


class Silo(NamedTuple):
    """What a silo came to: weight of its grains, mean force on the floor, mean friction and pressing force on the wall, height of
    the grains, and the largest error of the balance of forces, relative to the weight."""

    weight: float
    floor: float
    friction: float
    pressing: float
    height: float
    unbalanced: float


def silo(count, wall_friction, radius=RADIUS, settle=14.0, measure=8.0, speed=0.04, seed=1):
    """Grains of diameter 0.8 to 1 in a cylinder whose wall slides up along them; forces are means over the time ``measure``."""
    elastic = {"kn": KN, "kt": 2.0 / 7.0 * KN, "gamma_n": 20.0, "gamma_t": 10.0, "friction": GRAIN_FRICTION}
    materials = [bc.Material("grain", density=1.0, **elastic), bc.Material("wall", **elastic)]
    edge = radius + 1.0
    box = bc.Box((-edge, -edge, -2.0), (edge, edge, 4.0 + 2.0 * count / radius**2))
    sim = bc.Simulation(box, bc.laws.linear, materials, DT, gravity=(0.0, 0.0, -GRAVITY), threads=1)
    sim.materials.set_pair("grain", "wall", friction=wall_friction)
    wall = sim.add_wall(bc.Cylinder((0, 0, 0), (0, 0, 1), radius, material="wall", velocity=(0, 0, speed)))
    floor = sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains(*loose(count, radius, np.random.default_rng(seed)))
    weight = sim.grains.view("mass").sum() * GRAVITY
    sim.run(round(settle / DT))
    seen = []
    for _ in range(25):
        sim.run(round(measure / DT / 25.0))
        resultant = sim.grains.view("force")[:, 2].sum()
        error = abs(floor.force[2] + wall.force[2] + weight + resultant)
        seen.append((-floor.force[2], -wall.force[2], wall.pressing, 2.0 * sim.grains.view("position")[:, 2].mean(), error))
    seen = np.array(seen)
    return Silo(weight, *seen[:, :4].mean(axis=0), seen[:, 4].max() / weight)


def loose(count, radius, rng):
    """Positions in layers within the cylinder, and radii."""
    lines = 1.02 * np.arange(-int(radius), int(radius) + 1)
    x, y = (a.ravel() for a in np.meshgrid(lines, lines))
    within = np.hypot(x, y) < radius - 0.52
    number = np.arange(count)
    place, layer = number % within.sum(), number // within.sum()
    position = np.stack([x[within][place], y[within][place], 0.52 + 1.02 * layer], axis=1)
    return position + rng.uniform(-0.01, 0.01, position.shape), rng.uniform(0.4, 0.5, count)


def saturation(silos):
    """The W_s that fits best: least squares of the relative errors of the forces on the floor."""
    tries = np.geomspace(0.05, 5.0, 2000) * max(s.weight for s in silos)
    errors = sum((w * (1.0 - np.exp(-s.weight / w)) / s.floor - 1.0) ** 2 for s in silos for w in [tries])
    return tries[np.argmin(errors)]


def check_janssen(silos, wall_friction, radius, tolerance):
    """Balance of forces, mobilised friction, Janssen's curve from nearly all the weight to its saturation, and K."""
    for s in silos:
        assert s.unbalanced < 1e-9
        assert s.floor + s.friction == pytest.approx(s.weight, rel=0.02)
        assert 0.5 * wall_friction < s.friction / s.pressing < wall_friction
    most, (shortest, *_, tallest) = saturation(silos), silos
    for s in silos:
        assert s.floor == pytest.approx(most * (1.0 - exp(-s.weight / most)), rel=tolerance)
    assert shortest.floor > 0.8 * shortest.weight and tallest.floor < 0.4 * tallest.weight
    length = most / tallest.weight * tallest.height
    ratio = radius * tallest.pressing / (2.0 * tallest.friction * length)
    assert 0.6 < ratio < 1.2, f"l = {length:.2f}, K = {ratio:.2f}"


@pytest.mark.validate
def test_the_floor_of_a_silo_carries_what_janssen_says():
    """Silos of 6 diameters with 100 to 800 grains, wall friction 0.3: within 10 % of one curve.

    The balance of forces holds to 1e-9 of the weight at any time, with what accelerates the grains counted.
    """
    check_janssen([silo(count, 0.3) for count in (100, 200, 400, 800)], 0.3, RADIUS, 0.10)


@pytest.mark.validate
def test_janssen_in_a_wider_silo():
    """Silos of 10 diameters with 400 to 5,000 grains, wall friction 0.4: within 10 % of one curve."""
    silos = [silo(count, 0.4, radius=5.0, settle=40.0, measure=15.0) for count in (400, 1000, 2200, 5000)]
    check_janssen(silos, 0.4, 5.0, 0.10)
