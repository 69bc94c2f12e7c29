"""Grains flow down a rough incline at constant speed: faster towards the surface, after Bagnold.

Units of Silbert et al. 2001: mass, diameter and gravity are 1.
"""

import numpy as np

import barchan as bc


def main(layers=10, duration=30.0, angle=24.0):
    tilt = np.radians(angle)
    mass = np.pi / 6
    grain = bc.Material("grain", density=1 / mass, kn=2e5, kt=2 / 7 * 2e5, gamma_n=50, friction=0.5)
    box = bc.Box((0, 0, -1), (8, 6, 2.5 * layers), periodic=(True, True, False))
    sim = bc.Simulation(box, bc.laws.linear, grain, dt=1e-4, gravity=(np.sin(tilt), 0, -np.cos(tilt)))
    random = np.random.default_rng(1)
    floor = [(x + 0.5, y + 0.5, 0.0) for x in range(8) for y in range(6)]
    sim.add_grains(np.array(floor) + random.uniform(0, 0.2, (48, 1)) * (0, 0, 1), radius=0.5, frozen=True)
    above = [(x + 0.5, y + 0.5, 1.05 * z + 1.3) for z in range(layers) for x in range(8) for y in range(6)]
    sim.add_grains(above, radius=random.uniform(0.45, 0.5, len(above)), velocity=random.normal(0, 0.1, (len(above), 3)))
    sim.run(round(duration / sim.dt))
    flowing = sim.grains.frozen == 0
    height, speed = sim.grains.position[flowing, 2], sim.grains.velocity[flowing, 0]
    for low in range(0, layers, 2):
        inside = (height >= low) & (height < low + 2)
        if inside.any():
            print(f"z = {low:2d} to {low + 2:2d} d: speed {speed[inside].mean():6.3f} sqrt(g d)")
    return height, speed


if __name__ == "__main__":
    main()
