"""Sheared in a periodic box, grains carry what the same grains carry in LAMMPS' benchmark chute, and between rough walls.

The contacts are those of the chute (Silbert et al. 2001): stiffness 2e5 m g/d, gamma_n 50 sqrt(g/d), density 1 (so e = 0.914),
friction 0.5; units of d, g and that density. The pressure is that in the middle of the chute.
"""

import warnings

import numpy as np
import pytest

import barchan as bc
from barchan.bench.cases import read_chute
from barchan.bench.peers.lammps import share_folder
from barchan.experiments.shear import SHEAR, Shear
from barchan.experiments.shear.results import steady_stages
from barchan.measure import solid_fraction, stress
from barchan.packing import scatter

CHUTE = bc.Material("grain", density=1.0, kn=2e5, kt=2e5 / 3.5, gamma_n=50.0, gamma_t=0.0, friction=0.5)
PRESSURE, DT = 9.8, 1e-4
SCENE = {"grains": 3000, "radius_min": 0.5, "radius_max": 0.5, "density": 1.0, "pressure": PRESSURE, "stiffness": 2e5,
         "restitution": 0.914, "inertial_number": 0.264, "rates": 2, "strain": 3.0, "settle": 1.0, "dt": DT}  # fmt: skip


def test_the_scene_has_the_contacts_of_the_chute():
    assert Shear.make(SCENE).dashpot == pytest.approx(50.0, rel=2e-3)


@pytest.fixture(scope="module")
def sheared(tmp_path_factory):
    """Inertial number, friction and solid fraction of grains in a periodic box, slow and fast, (3, 2)."""
    out, scene = tmp_path_factory.mktemp("sheared"), Shear.make(SCENE)
    sim = SHEAR.build(scene, threads=1)
    sim.writers = [one for one in SHEAR.instruments(scene, out) if getattr(one, "path", out).suffix == ".csv"][:2]
    sim.run(scene.ends[-1])
    found = steady_stages(scene, out)
    for one in found:
        print(f"I {one.inertial:.4f} mu {one.mu:.4f} +- {one.mu_error:.4f} phi {one.solid:.4f} +- {one.solid_error:.4f}")
    return np.array([(one.inertial, one.mu, one.solid) for one in reversed(found)]).T


class Bulk:
    """A writer: means over a layer of shear and normal stress, solid fraction and shear rate."""

    def __init__(self, due, low, high):
        self.due, self.low, self.high, self.seen = due, low, high, []

    def write(self, sim):
        brick = (*sim.box.low[:2], self.low), (*sim.box.high[:2], self.high)
        carried, grains = stress(sim, *brick).total, sim.grains
        height = grains.position[:, 2]
        inside = (grains.frozen == 0) & (height >= self.low) & (height < self.high)
        rate = np.polyfit(height[inside], grains.velocity[inside, 0], 1)[0]
        self.seen.append((-carried[0, 2], carried[2, 2], solid_fraction(sim, *brick), rate))

    @property
    def inertial_mu_phi(self):
        shear, normal, phi, rate = np.mean(self.seen, axis=0)
        return abs(rate) / np.sqrt(normal), shear / normal, phi


def compare(name, bulk, sheared):
    """By how much friction and solid fraction are off those of the periodic box at the same inertial number, interpolated."""
    inertial, *found = bulk.inertial_mu_phi
    expected = [np.interp(inertial, sheared[0], values) for values in sheared[1:]]
    assert sheared[0, 0] < 1.05 * inertial and inertial < sheared[0, 1]
    print(f"{name}: I {inertial:.4f}, mu and phi {found}; sheared {expected}")
    return [value / other - 1.0 for value, other in zip(found, expected)]


@pytest.mark.validate
def test_friction_and_solid_fraction_are_those_of_the_chute(sheared):
    """Within 3 % of what is measured in LAMMPS' ``data.chute`` (32,000 grains, 26 degrees) from 8 to 28 d above its base.

    It still speeds up, so its grains carry less than tan 26 degrees = 0.488: the stress itself is measured, as it flows on.
    """
    kind, diameter, _, position, velocity, omega = read_chute(share_folder() / "bench" / "data.chute")
    slope = np.radians(26.0)
    box = bc.Box((0, 0, -1), (40, 20, 60), (True, True, False))
    sim = bc.Simulation(box, bc.laws.linear_standard, CHUTE, DT, (np.sin(slope), 0.0, -np.cos(slope)))
    sim.add_grains(position, 0.5 * diameter, velocity=velocity, omega=omega, frozen=kind == 2)
    sim.start_at_full_step()
    bulk = Bulk(bc.Every(250, start=250), 8.0, 28.0)
    sim.writers.append(bulk)
    sim.run(15_000)
    off = compare("chute", bulk, sheared)
    assert max(map(abs, off)) < 0.03, off


class Lid:
    """An action: the frozen grains above move up and down so that they feel a pressure, and aside with a speed."""

    def __init__(self, above, below, area, speed):
        self.above, self.below, self.area, self.speed, self.due = above, below, area, speed, bc.Every(1)

    def apply(self, sim):
        velocity, force = sim.grains.view("velocity"), sim.grains.view("force")
        id = sim.grains.view("id")
        above, below = np.isin(id, self.above), np.isin(id, self.below)
        excess = force[above, 2].sum() / self.area / PRESSURE - 1.0
        velocity[above] = (self.speed, 0.0, np.clip(0.1 * self.speed * excess, -0.1 * self.speed, 0.1 * self.speed))
        velocity[below] = (-self.speed, 0.0, 0.0)


@pytest.mark.validate
def test_friction_and_solid_fraction_are_those_between_rough_walls(sheared):
    """Within 3 % of those in the middle between layers of glued grains that move past each other, one of which is pressed on."""
    across, deep, high, layer = 10.0, 8.0, 22.0, 2.0  # so thick that no grain finds a way through
    random = bc.Box((0, 0, 0), (across, deep, high), (True, True, True))
    radius = np.full(int(0.5 * across * deep * high / (np.pi / 6.0)), 0.5)
    place = scatter(random, radius, seed=1).position
    sim = bc.Simulation(bc.Box((0, 0, -2), (across, deep, high + 2), (True, True, False)), bc.laws.linear, CHUTE, DT, threads=1)
    glued = (place[:, 2] < layer) | (place[:, 2] >= high - layer)
    ids = np.array(sim.add_grains(place, radius, frozen=glued))
    above, below = ids[place[:, 2] >= high - layer], ids[place[:, 2] < layer]
    rate = 0.15 * np.sqrt(PRESSURE)
    sim.actions.append(Lid(above, below, across * deep, 0.5 * rate * 0.85 * high))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(round(4.0 / rate / DT))
    top = sim.grains.position[np.isin(sim.grains.id, above), 2].mean()
    bulk = Bulk(bc.Every(200), 0.3 * top, 0.7 * top)
    sim.writers.append(bulk)
    sim.run(round(5.0 / rate / DT))
    off = compare("walls", bulk, sheared)
    assert max(map(abs, off)) < 0.03, off
