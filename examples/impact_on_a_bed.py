"""A steel ball hits a bed of grains: the third case of Dosta et al. (2024, Comput. Phys. Commun. 109066).

Box, materials, ball and speed are those of the case as the public scripts of YADE and MercuryDPM give them: 25,000 (or 50,000, or
100,000) grains of 2 mm in a box of 100 by 60 mm, a ball of 20 mm whose centre is 150.2 mm above the bottom, 5 m/s, 0.1 s. Their
starting positions lie in files that are not published with the scripts: here the bed settles first, from a lattice. All of it
takes about ten minutes of one core: python examples/impact_on_a_bed.py 25000
"""

import sys

import numpy as np

import barchan as bc
from barchan.packing.lattice import lattice

RADIUS, BALL, SPEED, START = 1e-3, 10e-3, 5.0, 150.243e-3

#: Half the edges of the box across, and how high it is: grains that splash must not leave it within 0.1 s.
HALF, HEIGHT = np.array((0.05, 0.03)), 1.0


def bed(grains, half, modulus, dt, settle):
    """Grains that have settled in a box with half the edges ``half``, without the ball."""
    elastic = {"poisson_ratio": 0.2}
    glass = bc.Material("M1", density=2500, youngs_modulus=modulus, restitution=0.5, friction=0.3, **elastic)
    steel = bc.Material("steel", density=7200, youngs_modulus=210.0 * modulus, restitution=0.6, friction=0.5, **elastic)
    box = bc.Box((*(-half - 0.01), -0.01), (*(half + 0.01), HEIGHT + 0.01))
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, [glass, steel], dt, gravity=(0, 0, -9.81))
    sim.materials.set_pair("M1", "steel", restitution=0.4, friction=0.2)
    for point, normal in (
        ((0, 0, 0), (0, 0, 1)),
        ((-half[0], 0, 0), (1, 0, 0)),
        ((half[0], 0, 0), (-1, 0, 0)),
        ((0, -half[1], 0), (0, 1, 0)),
        ((0, half[1], 0), (0, -1, 0)),
    ):
        sim.add_wall(bc.Plane(point, normal, material="steel"))
    edge = 2.1 * RADIUS / (0.5 * 3.0**0.5)
    across = ((2.0 * (half - 1.05 * RADIUS)) / edge + 0.5).astype(int)
    layers = grains // (2 * across[0] * across[1]) + 1
    places = lattice("bcc", edge, (*(-0.5 * edge * across), RADIUS - 0.2 * edge), (*across, layers))
    places = places[np.argsort(places[:, 2], kind="stable")][:grains]
    places += np.random.default_rng(1).uniform(-0.02, 0.02, places.shape) * RADIUS
    sim.add_grains(places, radius=RADIUS, material="M1")
    sim.run(round(settle / dt))
    return sim


def main(grains=25_000, half=HALF, modulus=1e9, dt=5e-7, settle=0.1, duration=0.1, ball=BALL):
    """Let the ball fall in; returns times after its start [s], heights of its lowest point [m], and the height of the bed."""
    sim = bed(grains, np.asarray(half), modulus, dt, settle)
    top = float(np.quantile(sim.grains.position[:, 2], 0.99)) + RADIUS
    sim.add_grains([(0.0, 0.0, START)], radius=ball, material="steel", velocity=(0.0, 0.0, -SPEED))
    times, heights = np.linspace(0.0, duration, 21), [START - ball]
    for time in times[1:]:
        sim.run(round(duration / 20 / dt))
        heights.append(float(sim.grains.position[sim.grains.radius == ball][0, 2]) - ball)
        below = 1e3 * (top - heights[-1])
        print(f"{1e3 * time:6.1f} ms  {1e3 * heights[-1]:7.2f} mm above the bottom, {below:7.2f} mm into the bed", flush=True)
    return times, np.array(heights), top


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 25_000)
