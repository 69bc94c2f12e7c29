"""A scene of meshes for the tests of bits: at rest, moving, turning, pushed; across periodic faces."""

import meshes
import numpy as np

import barchan as bc
from barchan.walls import Servo

#: The step in which a servo begins to press.
PRESSED = 500


def meshed(with_grains=True, hills=0.3, **options):
    """Grains of two sizes on a hilly floor that fits the periods, around a block with edges and a ball that turns, under a lid
    that a servo presses on them from step ``PRESSED`` on: until then steps can be made many at a time."""
    sand = bc.Material("sand", density=1.0, kn=4e3, kt=1e3, gamma_n=20.0, gamma_t=5.0, friction=0.5)
    box = bc.Box((0, 0, 0), (6, 6, 6), (True, True, False))
    sim = bc.Simulation(box, bc.laws.linear, sand, 4e-4, (4.0, 1.0, -25.0), **options)
    line = np.linspace(0.0, 6.0, 13)
    x, y = np.meshgrid(line, line, indexing="ij")
    height = 1.0 + hills * np.sin(2 * np.pi * x / 6.0) * np.cos(2 * np.pi * y / 6.0)
    floor = meshes.sheet(np.stack([x, y, height], axis=-1))
    sim.add_wall(bc.Mesh(*floor))
    sim.add_wall(bc.Mesh(*meshes.box((4.9, 2.1, 1.2), (6.2, 3.4, 2.2)), velocity=(0.3, 0.0, 0.0)))
    sim.add_wall(bc.Mesh(meshes.ball(0.7, 1)[0] + (5.5, 5.5, 2.0), meshes.ball(0.7, 1)[1], omega=(1.0, 2.0, 0.5)))
    lid = sim.add_wall(bc.Mesh(np.stack([x, y, 0.0 * x + 4.5], axis=-1).reshape(-1, 3), floor[1], towards=(0, 0, -1)))
    lid.control = Servo(max_speed=5.0, force=600.0, start=PRESSED)
    rng = np.random.default_rng(8)
    places = np.stack(np.meshgrid(np.arange(8), np.arange(8), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 3)
    places = 0.75 * places + (0.3, 0.3, 1.65) + rng.uniform(-0.03, 0.03, places.shape)
    radius = rng.choice([0.2, 0.34], len(places))
    if with_grains:
        free = (sim.walls[0].distance(places) > radius) & (sim.walls[1].distance(places) > radius)
        free &= sim.walls[2].distance(places) > radius
        sim.add_grains(places[free], radius[free], velocity=rng.normal(size=(free.sum(), 3)))
    return sim
