"""Impacts on every kind of wall, at all angles: energy is kept or lost, never gained, and momentum goes to the wall.

Grains touch a wall at places around its axis, each with an angle of its own between its approach and the wall's normal there, and
a direction of its own along the surface. Impacts on planes with all basic laws: test_impact_energy.
"""

from copy import copy
from math import pi, tau

import numpy as np
import pytest
from analytic import hertz_contact_time
from impacts import advance

import barchan as bc

ANGLES = np.radians(np.arange(0.0, 86.0, 5.0))
RADIUS, AROUND, DENSITY, SPEED, MODULUS, POISSON = 0.2, 5.0, 1000.0, 1.0, 1e8, 0.3
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY

#: Time that the slowest approach touches, at 85 degrees.
LONGEST = hertz_contact_time(SPEED * np.cos(ANGLES[-1]), MASS, MODULUS / (2.0 * (1.0 - POISSON**2)), RADIUS)

Z = np.array([0.0, 0.0, 1.0])


def plane(outwards):
    return 0.0 * outwards + Z


def cone(outwards):
    return (Z - outwards) / np.sqrt(2.0)


#: Name -> wall, and a function of the unit vectors away from the axis z -> normals towards the grains at the radius ``AROUND``.
WALLS = {
    "plane": (bc.Plane((0, 0, 0), Z), plane),
    "turning plane": (bc.Plane((0, 0, 0), Z, omega=(0.3, 0.1, 0.2)), plane),
    "in a cylinder": (bc.Cylinder((0, 0, 0), Z, AROUND), np.negative),
    "around a cylinder": (bc.Cylinder((0, 0, 0), Z, AROUND, inside=False), np.positive),
    "in a sphere": (bc.Sphere((0, 0, 0), AROUND), np.negative),
    "around a sphere": (bc.Sphere((0, 0, 0), AROUND, inside=False), np.positive),
    "in a cone": (bc.Cone((0, 0, -2), Z, AROUND - 2.0, AROUND + 2.0, 4.0), cone),
    "below a cone": (bc.Cone((0, 0, -2), Z, AROUND - 2.0, AROUND + 2.0, 4.0), lambda outwards: -cone(outwards)),
}


class Outcome:
    """Impacts on a wall, one for each angle and friction, run until all have ended.

    Attributes: ``gain`` of kinetic energy relative to that of the approach, of each grain; ``momentum`` that the grains lost and
    ``impulse`` on the wall (3,) [force time]; ``work`` of the wall on all grains, relative as ``gain``.
    """

    def __init__(self, name, frictions, steps):
        self.frictions, (wall, normals) = frictions, WALLS[name]
        count = len(ANGLES) * len(frictions)
        place = np.linspace(0.0, tau, count, endpoint=False)
        outwards = np.stack([np.cos(place), np.sin(place), 0.0 * place], axis=1)
        self.normal, self.dt = normals(outwards), LONGEST / steps
        self.sim = self._scene(copy(wall))
        position = AROUND * outwards + RADIUS * self.normal
        if name.endswith("plane"):
            position = AROUND * outwards + RADIUS * Z
        moves = np.cross(wall.omega, position - RADIUS * self.normal)  # how the wall moves at the contact
        self.ids = [
            self.sim.add_grains(position[rows], RADIUS, f"{mu}", velocity=(moves + self._approach())[rows])
            for mu, rows in zip(frictions, np.split(np.arange(count), len(frictions)))
        ]
        self.sim.prepare()
        self._run(2 * steps)

    def _scene(self, wall):
        elastic = {"youngs_modulus": MODULUS, "poisson_ratio": POISSON, "restitution": 1.0}
        materials = [bc.Material(f"{mu}", density=DENSITY, friction=mu, **elastic) for mu in self.frictions]
        edge = (-AROUND - 4.0,) * 3, (AROUND + 4.0,) * 3
        sim = bc.Simulation(
            bc.Box(*edge), bc.laws.hertz_mindlin, [*materials, bc.Material("wall", friction=0.0, **elastic)], self.dt
        )
        for mu in self.frictions:
            sim.materials.set_pair(f"{mu}", "wall", friction=mu)
        wall.material = "wall"
        self.wall = sim.add_wall(wall)
        return sim

    def _approach(self):
        """Velocities relative to the wall: angles from its normal, directions along it all around."""
        angle = np.tile(ANGLES, len(self.frictions))[:, None]
        across = np.cross(self.normal, self.normal[:, [2, 0, 1]] + np.array([0.3, 0.2, 0.1]))
        across /= np.sqrt((across**2).sum(axis=1))[:, None]
        turn = 2.4 * np.arange(len(angle))[:, None]
        along = np.cos(turn) * across + np.sin(turn) * np.cross(self.normal, across)
        return SPEED * (np.sin(angle) * along - np.cos(angle) * self.normal)

    def _run(self, steps):
        before, kinetic = self._momentum(), self._energy()
        self.impulse, work, unit = np.zeros(3), 0.0, 0.5 * MASS * SPEED**2
        for _ in range(steps):
            advance(self.sim, 1)
            self.impulse += self.dt * self.wall.force
            work -= self.dt * (self.wall.torque @ self.wall.omega)  # no wall but the turning one moves
        assert self.sim.touching == 0
        self.momentum, self.work = before - self._momentum(), work / unit
        self.gain = (self._energy() - kinetic).reshape(len(self.frictions), -1) / unit

    def _momentum(self):
        return MASS * self.sim.grains.view("velocity").sum(axis=0)

    def _energy(self):
        grains = self.sim.grains
        moving = MASS * (grains.sorted_by_id("velocity") ** 2).sum(axis=1)
        return 0.5 * (moving + grains.sorted_by_id("inertia") * (grains.sorted_by_id("omega") ** 2).sum(axis=1))


@pytest.mark.parametrize("name", WALLS)
def test_frictionless_impacts_keep_energy_to_the_order_of_the_step(name):
    """Each within 1e-4 with 100 steps a contact, and with half the step at least four times better: the order is 2.5, since
    Hertz' force starts as the power 1.5. A turning wall works, and gives all of it to the grains."""
    errors = []
    for steps in (100, 200):
        run = Outcome(name, (0.0,), steps)
        errors.append(abs(run.gain.sum() / run.work - 1.0) if run.work else np.abs(run.gain).max())
    assert errors[0] < 1e-4
    assert errors[1] < 0.25 * errors[0]
    assert (run.work > 1.0) == (name == "turning plane")


@pytest.mark.parametrize("name", WALLS)
def test_impacts_with_friction_gain_no_energy_and_give_their_momentum_to_the_wall(name):
    """Friction 0.1, 0.5 and 10, restitution 1, nu = 0.3, 400 steps a contact: the error of the leap-frog is 2e-6.

    Momentum to rounding: both are sums of the same forces.
    """
    run = Outcome(name, (0.1, 0.5, 10.0), 400)
    if name == "turning plane":
        assert run.gain.sum() < run.work - 1.0
    else:
        assert run.gain.max() < 3e-6
        assert (run.gain.min(axis=1) < -0.1).all(), "friction takes nothing"
    scale = MASS * SPEED * run.gain.size
    assert np.abs(run.momentum).max() > 0.05 * MASS * SPEED
    np.testing.assert_allclose(run.impulse, run.momentum, rtol=0.0, atol=1e-13 * scale)
