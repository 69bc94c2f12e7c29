"""A triaxial test in a rigid cylinder: pressed from all sides, then shortened while the pressure on the side is held."""

import numpy as np

import barchan as bc
from barchan.actions import mark_places
from barchan.measure import strain
from barchan.packing import Preparation, press
from barchan.walls import Room

RADIUS, GAP = 1e-3, 1.35


def cloud(across, friction=0.5):
    """Grains at loose places in an upright cylinder, half as high again as it is wide, between two plates; walls are smooth."""
    elastic = {"youngs_modulus": 1e8, "poisson_ratio": 0.2, "restitution": 0.3}
    sand = bc.Material("sand", density=2650, friction=friction, **elastic)
    smooth = bc.Material("smooth", friction=0.0, **elastic)
    random, edge, high = np.random.default_rng(1), 2.0 * RADIUS * GAP, across * 3 // 2
    wide, height = across * edge, high * edge
    box = bc.Box((-wide, -wide, -height), (wide, wide, 2.0 * height))
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, [sand, smooth], dt=1.5e-6)
    sim.add_wall(bc.Cylinder((0, 0, 0), (0, 0, 1), 0.5 * wide, material="smooth"))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1), "smooth"))
    sim.add_wall(bc.Plane((0, 0, height), (0, 0, -1), "smooth"))
    corners = np.stack(np.meshgrid(*map(np.arange, (across, across, high)), indexing="ij"), axis=-1).reshape(-1, 3)
    place = (corners - (0.5 * (across - 1), 0.5 * (across - 1), -0.5)) * edge
    place += random.uniform(-0.5, 0.5, place.shape) * (edge - 2.0 * RADIUS)
    place = place[np.hypot(place[:, 0], place[:, 1]) < 0.5 * wide - RADIUS]
    sim.add_grains(place, random.uniform(0.8, 1.0, len(place)) * RADIUS, "sand")
    sim.damping = bc.Damping(local=0.3)
    return sim


def shear(sim, shortening, steps, rows=10):
    """Let the plates come closer with a steady speed, while the side goes on holding its pressure; rows of axial strain of the
    plates, volumetric strain of the grains, axial and radial stress on the walls [Pa]."""
    side, floor, top = sim.walls
    room, told = Room(sim), []
    height = room.size[2]
    mark_places(sim)
    for plate in (floor, top):
        plate.control = None
        plate.velocity = 0.5 * shortening * height / (steps * sim.dt) * plate.normal
    for _ in range(rows):
        sim.run(steps // rows)
        axial = 0.5 * (room.stress(sim, floor) + room.stress(sim, top))
        told.append((np.log(height / room.size[2]), strain(sim).volumetric_strain, axial, room.stress(sim, side)))
    for plate in (floor, top):
        plate.velocity = (0, 0, 0)
    return np.array(told)


def main(across=7, pressure=30e3):
    sim = cloud(across)
    sample = press(sim, pressure, Preparation(friction=0.1))  # the side and both plates hold the pressure from here on
    print(f"{sim.n_grains} grains, e = {sample.void_ratio:.3f} at {sample.pressure / 1e3:.2f} kPa")
    rows = shear(sim, shortening=0.1, steps=30_000)
    angle = np.degrees(np.arcsin((rows[:, 2] - rows[:, 3]) / (rows[:, 2] + rows[:, 3])))
    for row, degrees in zip(rows, angle):
        print(
            "axial strain {:.4f}, volumetric {:+.4f}; stress axial {:6.0f} Pa, radial {:.0f} Pa;".format(*row),
            f"{degrees:.1f} deg",
        )
    print(f"friction angle {angle.max():.1f} deg at the peak")
    return angle.max()


if __name__ == "__main__":
    main()
