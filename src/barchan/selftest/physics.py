"""Checks of the physics: closed forms of one contact, conservation, and a plain evaluation of all pairs.

Sources: Hertz 1882 and K. L. Johnson, Contact Mechanics, 1985 (sections 4.2 and 11.4); Schwager & Poeschel, Granular Matter
9, 465 (2007). All use ``hertz_mindlin`` with one material, so that a single loop has to be compiled.
"""

from math import pi, sqrt

import numpy as np

from barchan.domain import Box
from barchan.laws import hertz_mindlin
from barchan.materials import Material
from barchan.measure import contact_table
from barchan.parallel import Serial
from barchan.selftest.finding import Finding, at_most
from barchan.simulation import Simulation
from barchan.walls import Plane

RADIUS, DENSITY, SPEED, MODULUS, POISSON, FRICTION, GRAVITY = 0.01, 2500.0, 2.0, 5e7, 0.25, 0.5, 9.81
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY


def scene(box, dt, modulus=MODULUS, friction=FRICTION, restitution=1.0, gravity=(0.0, 0.0, 0.0)):
    """A box without grains, of one material."""
    glass = Material(
        "glass",
        density=DENSITY,
        youngs_modulus=modulus,
        poisson_ratio=POISSON,
        friction=friction,
        restitution=restitution,
    )
    return Simulation(box, hertz_mindlin, glass, dt, gravity, threads=1, comm=Serial())


def modulus_eff(modulus):
    """E* of two equal materials: 1/E* = 2 (1 - nu^2) / E."""
    return modulus / (2.0 * (1.0 - POISSON**2))


# -- one contact -------------------------------------------------------------------------------------------------------


def impact(degrees=0.0, **options):
    """Two equal spheres that just touch; they approach with ``SPEED`` along the line of centres, and across it with as much as
    makes that angle."""
    sim = scene(Box((-0.5,) * 3, (0.5,) * 3), 1e-6, **options)
    velocity = 0.5 * SPEED * np.array([1.0, np.tan(np.radians(degrees)), 0.0])
    sim.add_grains([(-RADIUS, 0.0, 0.0), (RADIUS, 0.0, 0.0)], RADIUS, velocity=[velocity, -velocity])
    sim.prepare()
    return sim


def forces_until_apart(sim):
    """Step until the spheres have parted; the largest component of the force between them in each step, (steps,)."""
    forces = []
    while not forces or sim.touching:
        sim.step()
        forces.append(float(np.abs(sim.grains.view("force")).max()))
    return np.array(forces)


def largest_overlap():
    """Of an elastic head-on impact: (15 m* v^2 / (16 E* sqrt(R*)))^(2/5), the energy balance of Hertz' force."""
    return (15.0 * 0.5 * MASS * SPEED**2 / (16.0 * modulus_eff(MODULUS) * sqrt(0.5 * RADIUS))) ** 0.4


def restitution():
    """Two grains part with the restitution that their material asks for (the dashpot's: Schwager & Poeschel 2007)."""
    sim = impact(friction=0.0, restitution=0.7)
    forces_until_apart(sim)
    left, right = sim.grains.sorted_by_id("velocity")[:, 0]
    return at_most(abs((right - left) / SPEED - 0.7), 1e-3)


def peak_force():
    """The largest force of an elastic impact is Hertz' 4/3 E* sqrt(R*) d^(3/2) at the largest overlap d."""
    expected = 4.0 / 3.0 * modulus_eff(MODULUS) * sqrt(0.5 * RADIUS) * largest_overlap() ** 1.5
    return at_most(abs(forces_until_apart(impact(friction=0.0)).max() / expected - 1.0), 1e-4)


def duration():
    """An elastic impact lasts 2.943275 d / v, the number being 2 int_0^1 (1 - x^(5/2))^(-1/2) dx. Allowed: one step."""
    sim = impact(friction=0.0)
    steps = np.count_nonzero(forces_until_apart(sim))
    return at_most(abs(steps * sim.dt / (2.943275 * largest_overlap() / SPEED) - 1.0), 2e-3)


def energy():
    """Kinetic energy never grows in an impact: elastic, with friction, at 0 to 75 degrees. (``hertz_mindlin`` promises that from
    a Poisson's ratio of 0.25 on.)"""
    growth = []
    for degrees in (0.0, 15.0, 30.0, 45.0, 60.0, 75.0):
        sim = impact(degrees)
        before = kinetic_energy(sim)
        forces_until_apart(sim)
        growth.append(kinetic_energy(sim) / before - 1.0)
    return at_most(max(growth), 1e-5)


def kinetic_energy(sim):
    """Of translation and rotation, while nothing touches."""
    mass, inertia, velocity, omega = (sim.grains.view(name) for name in ("mass", "inertia", "velocity", "omega"))
    return 0.5 * float((mass * (velocity**2).sum(axis=1) + inertia * (omega**2).sum(axis=1)).sum())


# -- falling and rolling -----------------------------------------------------------------------------------------------


def free_fall():
    """A thrown grain follows x0 + v0 t + g t^2 / 2, on which the leap-frog is exact. Allowed: rounding."""
    place, velocity, gravity = np.array([0.1, 0.2, 0.3]), np.array([3.0, 1.0, 4.0]), np.array([1.0, -2.0, -GRAVITY])
    sim = scene(Box((-9.0,) * 3, (9.0,) * 3), 2e-5, gravity=tuple(gravity))
    sim.add_grains([place], RADIUS, velocity=velocity)
    sim.start_at_full_step()
    sim.run(2000)
    expected = place + velocity * sim.time + 0.5 * gravity * sim.time**2
    return at_most(float(np.abs(sim.grains.view("position")[0] - expected).max()), 1e-12, " m")


def sliding_to_rolling():
    """A sphere set sliding without spin on a plane rolls from t = 2 u0 / (7 mu g) on, at 5/7 of its speed, with R omega = u."""
    depth = 1e-5 * RADIUS
    stiff = MASS * GRAVITY * 2.0 * (1.0 - POISSON**2) / (4.0 / 3.0 * sqrt(RADIUS) * depth**1.5)  # sinks in by ``depth``
    sim = scene(Box((-1.0,) * 3, (1.0,) * 3), 5e-6, stiff, restitution=0.3, gravity=(0.0, 0.0, -GRAVITY))
    sim.check_dt = False  # it looks at an overlap of 5 %; here it is 0.0005 %, and softer by far
    sim.add_wall(Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    sim.add_grains([(-0.5, 0.0, RADIUS - depth)], RADIUS, velocity=(1.0, 0.0, 0.0))
    sim.run(round(1.3 * 2.0 / (7.0 * FRICTION * GRAVITY) / sim.dt))
    speed, turning = sim.grains.view("velocity")[0, 0], RADIUS * sim.grains.view("omega")[0, 1]
    return at_most(max(abs(speed - 5.0 / 7.0), abs(turning - 5.0 / 7.0)), 1e-3, " u0")


# -- many grains -------------------------------------------------------------------------------------------------------


def cloud(grains=300):
    """Spheres of radii 0.3 to 0.5 at random in a box with periods of 6, so that many overlap, moving at random."""
    random = np.random.default_rng(3)
    sim = scene(Box((0.0,) * 3, (6.0,) * 3, (True,) * 3), 1e-3, modulus=1e6, restitution=0.8)
    sim.max_overlap = np.inf
    velocity = random.normal(0.0, 1.0, (grains, 3))
    sim.add_grains(random.uniform(0.0, 6.0, (grains, 3)), random.uniform(0.3, 0.5, grains), velocity=velocity)
    return sim


def momentum():
    """The momentum of a cloud of colliding grains stays what it was: forces act in pairs. Allowed: rounding."""
    sim = cloud()
    mass, velocity = sim.grains.sorted_by_id("mass")[:, None], sim.grains.sorted_by_id("velocity")
    sim.run(200)
    gained = (mass * (sim.grains.sorted_by_id("velocity") - velocity)).sum(axis=0)
    return at_most(float(np.abs(gained).max() / np.abs(mass * velocity).sum()), 1e-13)


def all_pairs(sim):
    """Overlap of all pairs of grains, (n, n), negative when apart; and their unit normals from the second to the first."""
    position, radius = sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("radius")
    branch = sim.box.difference(position[:, None], position[None, :])
    distance = np.sqrt((branch**2).sum(axis=-1))
    np.fill_diagonal(distance, np.inf)
    return radius[:, None] + radius - distance, branch / distance[..., None]


def neighbours():
    """The contacts of a random cloud are those that a search over all pairs finds, after 50 steps too."""
    sim, wrong, found = cloud(), 0, 0
    for steps in (0, 50):
        sim.run(steps)
        overlap, _ = all_pairs(sim)
        expected = set(zip(*(rows.tolist() for rows in np.nonzero(np.triu(overlap > 0.0)))))
        table = contact_table(sim)
        wrong += len(expected ^ set(zip(table["first"].tolist(), table["second"].tolist())))
        found += len(expected)
    return Finding(f"{wrong} wrong of {found}", "0", wrong == 0 and found > 300)


def forces():
    """Forces on a random cloud at rest are the sums of Hertz' 4/3 E* sqrt(R* overlap) overlap over all pairs."""
    sim = cloud()
    sim.grains.velocity = 0.0
    sim.prepare()
    overlap, normal = all_pairs(sim)
    radius = sim.grains.sorted_by_id("radius")
    radius_eff = radius[:, None] * radius / (radius[:, None] + radius)
    overlap = np.maximum(overlap, 0.0)
    pressing = 4.0 / 3.0 * modulus_eff(1e6) * np.sqrt(radius_eff * overlap) * overlap
    expected = (pressing[..., None] * normal).sum(axis=1)
    apart = np.abs(sim.grains.sorted_by_id("force") - expected).max() / np.abs(expected).max()
    return at_most(float(apart), 1e-12)
