"""Two glass beads collide head-on; they part with the restitution that their material asks for."""

import barchan as bc


def main():
    glass = bc.Material("glass", density=2500, youngs_modulus=5e7, poisson_ratio=0.25, friction=0.5, restitution=0.8)
    box = bc.Box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, glass, dt=2e-6)
    left, right = sim.add_grains(
        [(-0.0101, 0, 0), (0.0101, 0, 0)], radius=0.01, material="glass", velocity=[(1, 0, 0), (-1, 0, 0)]
    )
    sim.run(1000)
    velocity = sim.grains.velocity[:, 0]
    parting = velocity[sim.grains.row_of(right)] - velocity[sim.grains.row_of(left)]
    print(f"met at 2 m/s, parted at {parting:.4f} m/s: restitution {parting / 2:.4f}")
    return parting / 2


if __name__ == "__main__":
    main()
