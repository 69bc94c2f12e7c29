"""Loose clouds of a few soft grains in rooms of all kinds, for samples that are made of them."""

import numpy as np
from scenes import SOFT

import barchan as bc


def cloud(kind, friction=0.4, across=4, **options):
    """Grains of two sizes, moving, in a "brick" of six walls, a "cylinder", a "periodic" box, or one with two "plates"."""
    stuff = [
        bc.Material(name, density=1.0, **{**SOFT, "friction": mu, "gamma_n": 20.0})
        for name, mu in (("a", friction), ("wall", 0.0))
    ]
    gap, random = 1.3, np.random.default_rng(1)
    size = across * gap
    around = {"periodic": (True,) * 3, "plates": (True, True, False)}.get(kind, (False,) * 3)
    beyond = 1.0 - np.array(around)
    box = bc.Box(-beyond, size + beyond, around)
    sim = bc.Simulation(box, bc.laws.linear, stuff, dt=2e-3, **options)
    cells = np.stack(np.meshgrid(*3 * [np.arange(across)], indexing="ij"), axis=-1).reshape(-1, 3)
    place = (cells + 0.5) * gap + random.uniform(-0.14, 0.14, cells.shape)
    if kind == "cylinder":
        place = place[np.hypot(*(place[:, :2] - 0.5 * size).T) < 0.5 * size - 0.5]
        sim.add_wall(bc.Cylinder((0.5 * size, 0.5 * size, 0), (0, 0, 1), 0.5 * size, material="wall"))
    for axis in {"brick": (0, 1, 2), "cylinder": (2,), "plates": (2,), "periodic": ()}[kind]:
        normal = np.eye(3)[axis]
        sim.add_wall(bc.Plane(0.0 * normal, normal, "wall"))
        sim.add_wall(bc.Plane(size * normal, -normal, "wall"))
    sim.add_grains(place, random.choice([0.45, 0.5], len(place)), velocity=random.normal(scale=0.1, size=place.shape))
    return sim
