"""A small dense state for the tests of bits: every grain touches many others, some slide, contacts form and break."""

import numpy as np

import barchan as bc
from barchan.packing.lattice import lattice

VALUES = {
    "kn": 2e4,
    "kt": 6e3,
    "gamma_n": 20.0,
    "gamma_t": 10.0,
    "friction": 0.4,
    "youngs_modulus": 2e5,
    "poisson_ratio": 0.25,
    "restitution": 0.6,
    "work_of_adhesion": 1.0,
    "rolling_friction": 0.2,
    "twisting_friction": 0.1,
}


def materials(law, count=2):
    """Materials that differ, with all properties of ``law``."""

    values = VALUES | ({"work_of_adhesion": 100.0} if law.reach else {})  # contacts last over 1 % of a radius

    def scaled(k):
        return {name: value * (1.0 + 0.2 * k) for name, value in values.items() if name in law.properties}

    return [bc.Material(f"m{k}", density=1.0 + 0.5 * k, **scaled(k)) for k in range(count)]


def tilting(time):
    """Gravity that turns."""
    return 5.0 * time, 0.3, -1.0


#: While gravity turns, steps are made singly; while it does not, many of them in one call.
GRAVITY = {"turning": tilting, "steady": (0.4, 0.3, -1.0)}


def empty(law, **options):
    """The scene without its grains: a periodic box with a floor and a lid that moves."""
    box = bc.Box((0.0, 0.0, -0.5), (8.0, 6.0, 12.0), periodic=(True, True, False))
    sim = bc.Simulation(box, law, materials(law), dt=5e-4, gravity=tilting, **options)
    sim.add_field("label", width=2, default=0.0)
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), material="m1"))
    sim.add_wall(bc.Plane((0.0, 0.0, 7.4), (0.0, 0.0, -1.0), material="m0", velocity=(0.3, 0.0, -0.05)))
    return sim


def dense(law, **options):
    """About 580 grains on a compressed face-centred lattice: coordination above 6, polydisperse, sheared, two materials."""
    sim = empty(law, **options)
    points = lattice("fcc", 4.0 / 3.0, (0.0, 0.0, 0.45), (6, 5, 5)) * (1.0, 0.9, 1.0)
    random = np.random.default_rng(7)
    points = points + random.uniform(-0.01, 0.01, points.shape)
    radius = random.uniform(0.45, 0.5, len(points))
    velocity = random.normal(0.0, 0.4, points.shape) + np.outer(points[:, 2], (0.3, 0.0, 0.0))
    bottom = points[:, 2] < 1.2
    left = points[:, 0] < 4.0
    for frozen, chosen, material in ((True, bottom, "m0"), (False, ~bottom & left, "m0"), (False, ~bottom & ~left, "m1")):
        ids = sim.add_grains(
            points[chosen],
            radius[chosen],
            material,
            velocity=0.0 if frozen else velocity[chosen],
            omega=0.0 if frozen else random.normal(0.0, 0.5, (chosen.sum(), 3)),
            frozen=frozen,
        )
        own = np.isin(sim.grains.id, ids)
        sim.grains.label[own] = np.stack([sim.grains.id[own], -sim.grains.id[own]], axis=1)
    return sim
