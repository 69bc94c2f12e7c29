"""Grains fall into a hopper of triangles, in which a blade turns; a picture of them, seen from the side and above."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection

import barchan as bc
from barchan.view.grains import draw_grains
from barchan.view.style import figure


def frustum(low, high, half_low, half_high):
    """Corners of a rectangle at height ``low`` and of one at ``high``, and triangles of the sides and of the bottom."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    rows = [np.column_stack([square * half, np.full(4, z)]) for z, half in ((low, half_low), (high, half_high))]
    sides = [(k, (k + 1) % 4, 4 + (k + 1) % 4) for k in range(4)] + [(k, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    return np.concatenate(rows), np.array([*sides, (0, 2, 1), (0, 3, 2)])


def hopper(turn=8.0):
    """The scene: an open hopper, and a closed blade that turns about z [1/s]."""
    glass = bc.Material("glass", density=2500, kn=2e4, kt=6e3, gamma_n=1000, friction=0.4)
    box = bc.Box((-0.04, -0.04, -0.01), (0.04, 0.04, 0.09))
    sim = bc.Simulation(box, bc.laws.linear, glass, dt=8e-6, gravity=(0, 0, -9.81), threads=1)
    sim.add_wall(bc.Mesh(*frustum(0.0, 0.05, 0.012, 0.033)))
    corners, triangles = frustum(0.007, 0.035, (0.005, 0.001), (0.011, 0.001))
    sim.add_wall(bc.Mesh(corners, np.concatenate([triangles, [(4, 5, 6), (4, 6, 7)]]), omega=(0, 0, turn), point=(0, 0, 0.02)))
    cells = np.stack(np.meshgrid(*map(np.arange, (8, 8, 8)), indexing="ij"), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(1)
    places = 0.005 * (cells - (3.5, 3.5, 0)) + (0, 0, 0.04) + random.uniform(-2e-4, 2e-4, cells.shape)
    sim.add_grains(places, radius=random.uniform(0.0017, 0.0023, len(cells)))
    return sim


def draw(sim, path):
    """Write a picture: grains by their speed, meshes in front of them transparent."""
    along, up = np.radians((25.0, 30.0))
    view = np.array([(np.cos(along), np.sin(along), 0), (-np.sin(along), np.cos(along), 0), (0, 0, 1)])
    view = np.array([(1, 0, 0), (0, np.cos(up), -np.sin(up)), (0, np.sin(up), np.cos(up))]) @ view
    with figure(Path(path), size=(5.0, 3.4)) as (drawing, axes):
        for mesh, colour in zip(sim.walls, ("#888888", "#D55E00")):
            corners = 1e3 * (mesh.places @ view.T)
            behind = corners[:, :, 1].mean(axis=1) > 1e3 * (mesh.point @ view.T)[1]
            for some, order, share in ((behind, 0, 0.5), (~behind, 3, 0.2)):
                axes.add_collection(
                    PolyCollection(corners[some][:, :, (0, 2)], facecolors=colour, edgecolors="k", alpha=share, zorder=order)
                )
        speed = np.sqrt((sim.grains.velocity**2).sum(axis=1))
        discs = draw_grains(axes, sim.grains.position @ view.T, sim.grains.radius, speed, (0.0, 0.15))
        axes.set(xlim=(-48, 48), ylim=(-10, 69), aspect="equal")
        axes.set_axis_off()
        drawing.colorbar(discs, label="speed [m/s]", shrink=0.6)


def main(duration=0.36, picture=None):
    sim = hopper()
    sim.run(round(duration / sim.dt))
    bowl, blade = sim.walls
    carried, weight = -(bowl.force + blade.force)[2], 9.81 * sim.grains.mass.sum()
    print(f"{sim.n_grains} grains weigh {weight:.3f} N, hopper and blade carry {carried:.3f} N")
    print(f"{blade.contacts} grains touch the blade, and turn it with {1e3 * blade.torque[2]:.3f} mN m")
    if picture:
        draw(sim, picture)
    return carried / weight, blade.torque[2]


if __name__ == "__main__":
    main(picture=sys.argv[1] if len(sys.argv) > 1 else None)
