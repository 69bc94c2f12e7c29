"""The friction during preparation sets how dense a sample becomes: random close packing without, random loose packing with much.

Scott & Kilgour 1969, J. Phys. D 2, 863: 0.637 is the densest random packing of spheres; Onoda & Liniger 1990, Phys. Rev. Lett.
64, 2727: 0.555 the loosest; Silbert 2010, Soft Matter 6, 2918: between them friction decides.
"""

import numpy as np
import pytest

import barchan as bc
from barchan.measure import coordination, solid_fraction
from barchan.packing import Preparation, compact, press
from barchan.walls import Room

RADIUS = 1e-3

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


def cloud(across, with_walls, gap=1.4):
    """Nearly equal spheres at loose places in a cube, with smooth walls or periodic faces."""
    elastic = {"youngs_modulus": 1e8, "poisson_ratio": 0.2, "restitution": 0.3}
    stuff = [bc.Material("grain", density=2500, friction=0.5, **elastic), bc.Material("wall", friction=0.0, **elastic)]
    random, edge = np.random.default_rng(1), 2.0 * RADIUS * gap
    size = across * edge
    box = bc.Box((-size,) * 3, (2.0 * size,) * 3) if with_walls else bc.Box((0,) * 3, (size,) * 3, (True,) * 3)
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, stuff, dt=1.5e-6)
    cells = np.stack(np.meshgrid(*3 * [np.arange(across)], indexing="ij"), axis=-1).reshape(-1, 3)
    place = (cells + 0.5) * edge + random.uniform(-0.5, 0.5, cells.shape) * (gap - 1.0) * 2.0 * RADIUS
    for axis in range(3 * with_walls):
        normal = np.eye(3)[axis]
        sim.add_wall(bc.Plane(0.0 * normal, normal, "wall"))
        sim.add_wall(bc.Plane(size * normal, -normal, "wall"))
    sim.add_grains(place, random.uniform(0.9, 1.0, len(cells)) * RADIUS, velocity=random.normal(scale=0.05, size=place.shape))
    sim.damping = bc.Damping(local=0.5)
    return sim


@pytest.mark.parametrize(("friction", "loose", "dense"), [(0.0, 0.62, 0.65), (0.6, 0.535, 0.60)])
def test_grains_bear_from_random_close_packing_on_without_friction_and_from_looser_with_it(friction, loose, dense):
    """In a box without walls: at the looser solid fraction nothing bears, at the denser one pressure remains; both are random
    close packing, 0.64, but for 2 %, and within 0.535 to 0.60 with friction."""
    bearing = []
    for wanted in (loose, dense):
        sim = cloud(8, with_walls=False)
        found = compact(sim, wanted, "growth", Preparation(friction=friction), steps=10_000)
        assert found.solid_fraction == pytest.approx(wanted, rel=1e-9)
        bearing.append((found.pressure, coordination(sim).mechanical))
    (nothing, few), (pressure, many) = bearing
    assert nothing < 1.0 < 1e4 < pressure and few < 4.0 < many


@pytest.mark.validate
def test_the_void_ratio_falls_with_the_friction_during_preparation():
    """Pressed alike, by smooth walls: each within 0.5 % of the pressure. In the core without friction it is random close packing
    less a little, as walls are near."""
    ratios, core = [], []
    for friction in (0.6, 0.2, 0.0):
        sim = cloud(8, with_walls=True)
        found = press(sim, 3e4, Preparation(friction=friction))
        room = Room(sim)
        assert found.pressure == pytest.approx(3e4, rel=5e-3) and found.unbalanced < 1e-3
        sim.prepare()
        assert [room.stress(sim, wall) for wall in room.walls] == pytest.approx([3e4] * 6, rel=5e-3)
        low, high = np.array([[wall.point[axis] for wall in pair] for axis, pair in enumerate(room.ends)]).T
        core.append(solid_fraction(sim, low + 3.0 * RADIUS, high - 3.0 * RADIUS))
        ratios.append(found.void_ratio)
    assert ratios[0] > ratios[1] + 0.03 and ratios[1] > ratios[2] + 0.03
    assert 0.54 < core[0] < 0.60 and 0.61 < core[2] < 0.65
