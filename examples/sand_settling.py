"""Sand is dropped into a box and settles; the floor carries its weight."""

import numpy as np

import barchan as bc
from barchan.measure import KineticEnergy


def main(steps=20000):
    sand = bc.Material("sand", density=2650, youngs_modulus=5e6, poisson_ratio=0.3, friction=0.5, restitution=0.3)
    box = bc.Box((0, 0, 0), (0.02, 0.02, 0.06), periodic=(True, True, False))
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, sand, dt=1e-5, gravity=(0, 0, -9.81))
    sim.add_wall(bc.Plane(point=(0, 0, 0), normal=(0, 0, 1)))
    random = np.random.default_rng(1)
    corners = np.stack(np.meshgrid(np.arange(8), np.arange(8), np.arange(10), indexing="ij"), axis=-1).reshape(-1, 3)
    sim.add_grains(0.0025 * (corners + 0.5), radius=random.uniform(0.0008, 0.0012, len(corners)))
    sim.run(steps)
    weight = 9.81 * sim.grains.mass.sum()
    carried = -sim.walls[0].force[2]
    height = sim.grains.position[:, 2].max()
    print(f"{sim.n_grains} grains, {1000 * height:.1f} mm high, kinetic energy {KineticEnergy().compute(sim).total:.2g} J")
    print(f"the floor carries {carried:.5f} N, the sand weighs {weight:.5f} N")
    return carried / weight


if __name__ == "__main__":
    main()
