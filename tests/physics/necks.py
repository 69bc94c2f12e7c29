"""Small grains on the neck between two large ones: the three-grain test of Vyas et al. 2025, many size ratios in one box.

Two touching, immobile spheres of 10 mm lie along x. A small sphere, 10 mm / R across, is released at rest, just touching both,
1 degree off the top of the neck. It rolls down around the neck, slides, and must fall.
"""

from math import cos, log, pi, radians, sin, sqrt

import numpy as np

import barchan as bc

RATIOS = np.array([1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0])
LARGE, DENSITY, GRAVITY, FRICTION, RESTITUTION, TILT = 0.005, 2500.0, 9.81, 0.5, 0.5, radians(1.0)

#: k_n / m of the small grain's contact [1/s^2] as published: 1e4 N/m for 0.5 mm; and k_t / k_n.
HARD, SHEAR = 1e4 / (4.0 / 3.0 * pi * 0.00025**3 * DENSITY), 0.8235

#: A hundred times softer, for ten times the time step. The overlap under the grain's weight is g / 6e8 = 1.6e-8 m.
SOFT = 0.01 * HARD


def elastic(law, radius, rigidity):
    """Material properties for which the small grain's contact has the stiffness ``rigidity`` m under its own weight."""
    mass = 4.0 / 3.0 * pi * radius**3 * DENSITY
    stiffness, radius_eff = rigidity * mass, radius * LARGE / (radius + LARGE)
    depth = GRAVITY / rigidity
    if law.name.startswith("hertz_mindlin"):
        modulus_eff = stiffness / (2.0 * sqrt(radius_eff * 1.5 * depth))
        return {"youngs_modulus": 2.0 * (1.0 - 0.3**2) * modulus_eff, "poisson_ratio": 0.3, "restitution": RESTITUTION}
    factor = {"silbert": sqrt(depth / (radius + LARGE)), "hertz": sqrt(depth * radius_eff)}.get(law.name.split("_")[0], 1.0)
    damping = -log(RESTITUTION) / sqrt(pi**2 + log(RESTITUTION) ** 2)
    rate = 2.0 * damping * sqrt(rigidity)
    return {"kn": stiffness / factor, "kt": SHEAR * stiffness / factor, "gamma_n": rate / factor}


class Necks:
    """One neck for each size ratio, far apart along y, in one simulation.

    Attributes: ``reach``: distance of the small grains from the axis through both large ones while they touch.
    """

    def __init__(self, law, dt, rigidity, ratios=RATIOS):
        self.radius = LARGE / np.asarray(ratios, dtype=float)
        self.reach = np.sqrt((LARGE + self.radius) ** 2 - LARGE**2)
        self.lots = 0.03 * np.arange(len(self.radius))
        materials = [
            bc.Material(f"ratio {ratio:g}", density=DENSITY, friction=FRICTION, **elastic(law, radius, rigidity))
            for ratio, radius in zip(ratios, self.radius)
        ]
        box = bc.Box((-0.02, -0.02, -1.0), (0.02, self.lots[-1] + 0.02, 0.03))
        self.sim = bc.Simulation(box, law, materials, dt, gravity=(0.0, 0.0, -GRAVITY), threads=1)
        self.sim.check_dt = False  # it looks at overlaps of 5 %
        self.sim.skin = 0.001
        small = []
        for m, lot, radius, reach in zip(materials, self.lots, self.radius, self.reach):
            self.sim.add_grains([(-LARGE, lot, 0.0), (LARGE, lot, 0.0)], LARGE, material=m.name, frozen=True)
            top = (0.0, lot + reach * sin(TILT), reach * cos(TILT))
            small.extend(self.sim.add_grains([top], radius, material=m.name))
        self.small = np.array(small)

    def place(self):
        """Distance from the axis in units of ``reach``, and angle from the top, of the small grains now."""
        y, z = (self.sim.grains.sorted_by_id("position")[self.small, 1:] - np.outer(self.lots, (1.0, 0.0))).T
        return np.hypot(y, z) / self.reach, np.arctan2(y, z)

    def follow(self, duration, every):
        """Times, distances and angles, (records,) and (records, ratios)."""
        steps = round(every / self.sim.dt)
        times, distances, angles = [], [], []
        self.sim.prepare()
        for _ in range(round(duration / every)):
            self.sim.run(steps)
            distance, angle = self.place()
            times.append(self.sim.time)
            distances.append(distance)
            angles.append(angle)
        return np.array(times), np.array(distances), np.array(angles)


def leaving_times(times, distances):
    """When each grain is half as far again from the axis as it was on the neck, by linear interpolation; inf if never."""
    left = distances > 1.5
    after, columns = np.argmax(left, axis=0), np.arange(distances.shape[1])
    low, high = distances[after - 1, columns], distances[after, columns]
    moment = times[after - 1] + (times[after] - times[after - 1]) * (1.5 - low) / (high - low)
    return np.where(left.any(axis=0), moment, np.inf)
