"""A triaxial test in a rigid cylinder, that of ``examples/triaxial.py``: side and plates under control."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from barchan.measure import strain, stress, unbalanced_force
from barchan.packing import Preparation, press
from barchan.walls import Room

EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "triaxial.py"))
PRESSURE = 40e3

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


def of_grains(sim, room):
    """Stress of the grains over the room, (3, 3) [Pa]."""
    return stress(sim, volume=room.volume).total


def in_two_directions(stresses):
    """Mean radial and axial stress: a rigid cylinder holds the mean over its mantle, not that on each side."""
    xx, yy, zz = np.diag(stresses)
    return [0.5 * (xx + yy), zz]


def on_walls(sim, room):
    """Stress on the side, the floor and the top, (3,) [Pa]."""
    return np.array([room.stress(sim, wall) for wall in sim.walls])


@pytest.mark.validate
def test_a_rigid_triaxial_cell():
    sim = EXAMPLE["cloud"](8)
    room = Room(sim)
    press(sim, PRESSURE, Preparation(friction=0.1))
    for _ in range(5):  # it is held, with the friction of the sand
        sim.run(400)
        assert on_walls(sim, room) == pytest.approx([PRESSURE] * 3, rel=1e-2)
    before = room.size
    assert in_two_directions(of_grains(sim, room)) == pytest.approx([PRESSURE] * 2, rel=5e-3)

    rows = EXAMPLE["shear"](sim, shortening=0.08, steps=30_000)
    _, volumetric, axial, radial = rows.T
    angle = np.degrees(np.arcsin((axial - radial) / (axial + radial)))
    walls = np.log(before / room.size)
    assert radial == pytest.approx(np.full(10, PRESSURE), rel=1e-2), "the side holds its pressure while it is sheared"
    assert 20.0 < angle.max() < 40.0
    assert volumetric.max() > 0.0 and volumetric[-1] < volumetric.max() - 5e-3, "it contracts, then dilates, as dense sand does"
    assert walls[2] == pytest.approx(-np.log(0.92), rel=1e-9)
    assert np.diag(strain(sim).logarithmic) == pytest.approx(walls, abs=0.1 * walls[2])

    while unbalanced_force(sim) > 2e-4:
        sim.run(500)
    side, floor, top = on_walls(sim, room)
    assert in_two_directions(of_grains(sim, room)) == pytest.approx([side, 0.5 * (floor + top)], rel=5e-3)
    assert floor == pytest.approx(top, rel=5e-3) and side == pytest.approx(PRESSURE, rel=1e-2) and top > 1.5 * side
