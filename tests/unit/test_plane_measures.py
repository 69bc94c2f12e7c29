"""What is measured, prepared, written and drawn of two dimensions: areas, and stresses as forces by length."""

from math import pi, sqrt

import matplotlib
import numpy as np
import pytest
from scenes import SOFT, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.measure import coarse_grain, contact_table, fabric, solid_fraction, strain, stress, void_ratio
from barchan.packing import Preparation, compact, press, read_packing, scatter
from barchan.packing.scatter import _cloud
from barchan.view.grains import draw_plane
from barchan.view.style import figure
from barchan.walls import Room
from barchan.writers import LammpsDump


def plane(low=(0, 0), high=(6, 6), periodic=(False, False), **options):
    return simulation(bc.Box(low, high, periodic), **options)


def hexagonal(across=6, rows=6, overlap=0.0, **options):
    """Equal grains of radius 0.5 on a triangular lattice, periodic both ways, at rest."""
    edge, rise = 1.0 - overlap, 0.5 * sqrt(3.0) * (1.0 - overlap)
    sim = plane(high=(across * edge, rows * rise), periodic=(True, True), **options)
    x, y = np.meshgrid(np.arange(across), np.arange(rows))
    place = np.stack([(x + 0.5 * (y % 2)) * edge, y * rise, 0.0 * x], axis=-1).reshape(-1, 3)
    sim.add_grains(place, 0.5)
    return sim


@pytest.mark.parametrize("shape", ["sphere", "disc"])
def test_a_hexagonal_packing_fills_its_share_of_the_area(shape):
    """pi / (2 sqrt 3), whole and in any rectangle that the lattice repeats; a cut through centres and one beside them."""
    sim, filled = hexagonal(shape=shape), pi / (2.0 * sqrt(3.0))
    assert solid_fraction(sim) == pytest.approx(filled, rel=1e-12)
    assert void_ratio(sim) == pytest.approx(1.0 / filled - 1.0)
    for low in ((0.0, 0.0, 0.0), (0.25, 0.1, 0.0), (0.4, 0.33, 0.0)):
        assert solid_fraction(sim, low, np.add(low, (2.0, 2.0 * sqrt(3.0), 0.0))) == pytest.approx(filled, rel=1e-12)


CUTS = [((2.2, 2.7), (5, 5)), ((3.3, 3.4), (6, 6)), ((1, 3.9), (3.1, 4.5)), ((2.9, 2.5), (3.1, 3.4)), ((3.8, 3.8), (5, 5))]


@pytest.mark.parametrize(("low", "high"), CUTS, ids=["most", "corner", "cap", "inside", "outside"])
def test_a_disc_is_cut_by_lines(low, high):
    """By the sum of thin strips; lines beside, through and beyond the centre."""
    sim = plane()
    sim.add_grains([(3, 3, 0)], 1.0)
    x = low[0] + (np.arange(200_000) + 0.5) * (high[0] - low[0]) / 200_000
    half = np.sqrt(np.maximum(1.0 - (x - 3.0) ** 2, 0.0))
    summed = np.maximum(np.minimum(3.0 + half, high[1]) - np.maximum(3.0 - half, low[1]), 0.0).mean() * (high[0] - low[0])
    area = np.prod(np.subtract(high, low))
    assert solid_fraction(sim, (*low, 0), (*high, 0)) * area == pytest.approx(summed, abs=1e-6)


def test_the_stress_of_a_pressed_hexagonal_packing():
    """Contact forces f along three directions at 60 degrees, a contact 3 to a grain: p = sqrt(3) f / (d) with d the distance."""
    sim = hexagonal(overlap=0.01)
    sim.prepare()
    force = SOFT["kn"] * 0.01
    found = stress(sim)
    assert found.contact.shape == found.kinetic.shape == (2, 2)
    assert found.contact == pytest.approx(np.eye(2) * sqrt(3.0) * force / 0.99, abs=1e-9)
    assert found.mean_stress == pytest.approx(sqrt(3.0) * force / 0.99) and found.deviatoric_stress == pytest.approx(
        0.0, abs=1e-9
    )
    assert fabric(sim).tensor == pytest.approx(0.5 * np.eye(2)) and fabric(sim).anisotropy == pytest.approx(0.0, abs=1e-9)
    fields = coarse_grain(sim, (4, 4, 1), width=2.0)
    assert fields.contact_stress.mean(axis=(0, 1, 2))[:2, :2] == pytest.approx(found.contact, abs=1e-6)
    assert fields.density.mean() == pytest.approx(sim.grains.mass.sum() / np.prod(sim.box.length[:2]))
    assert not fields.contact_stress[..., 2].any()


def test_the_deviatoric_stress_is_the_difference_of_the_principal_ones():
    sim = hexagonal(overlap=-0.1)
    sim.grains.velocity[:, 0] = np.where(np.arange(36) % 2, 2.0, -2.0)
    sim.prepare()
    density = sim.grains.mass.sum() / np.prod(sim.box.length[:2])
    assert stress(sim).total == pytest.approx(np.diag([4.0 * density, 0.0]))
    assert stress(sim).deviatoric_stress == pytest.approx(4.0 * density)


def test_a_strain_in_the_plane():
    """Stretched by 10 %, 5 % shorter the other way, turned: the area changes by ln(1.1 x 0.95)."""
    sim = plane(low=(-6, -6))
    sim.add_grains([(x, y, 0) for x in range(-2, 3) for y in range(-2, 3)], 0.3)
    bc.actions.mark_places(sim, "start")
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    sim.grains.position[:, :2] = sim.grains.position[:, :2] @ (turn @ np.diag([1.1, 0.95])).T
    found = strain(sim, "start")
    assert found.deformation == pytest.approx(turn @ np.diag([1.1, 0.95])) and found.rotation == pytest.approx(turn)
    assert found.volumetric_strain == pytest.approx(-np.log(1.1 * 0.95))
    assert found.deviatoric_strain == pytest.approx(0.5 * np.log(1.1 / 0.95))


@pytest.mark.parametrize("measure", [bc.measure.Front, bc.measure.Profile, bc.measure.Jet])
def test_measures_of_three_dimensions_say_so(measure):
    arguments = {"Front": (0.0, 1.0), "Profile": (1.0, 2.0, 1.0), "Jet": (1.0, 1.0)}[measure.__name__]
    sim = plane()
    sim.add_grains([(1, 1, 0)], 0.5)
    sim.prepare()
    with pytest.raises(SceneError, match=f"{measure.__name__} measures in three dimensions only, and the box has two"):
        measure(*arguments).compute(sim)


@pytest.mark.parametrize(
    ("low", "high", "told"),
    [
        ((0, 0, 0), (2, 0, 0), "exceed low on x and y"),
        ((0, 0, -1), (2, 2, 1), "leaves the box"),
        ((0, 0), (1, 1), "three finite"),
    ],
)
def test_a_rectangle_to_measure_in_lies_in_the_plane(low, high, told):
    with pytest.raises(SceneError, match=told):
        solid_fraction(plane(), low, high)


# -- samples, files, figures --------------------------------------------------------------------------------------------------


def test_a_room_is_an_area_and_its_walls_have_lengths():
    sim = plane(low=(-1, -1), high=(7, 7))
    walls = [sim.add_wall(bc.Plane(*wall)) for wall in (((0, 0, 0), (1, 0, 0)), ((4, 0, 0), (-1, 0, 0)))]
    walls += [sim.add_wall(bc.Plane(*wall)) for wall in (((0, 0, 0), (0, 1, 0)), ((0, 3, 0), (0, -1, 0)))]
    room = Room(sim)
    assert room.volume == 12.0 and room.area(walls[0])(sim) == 3.0 and room.area(walls[3])(sim) == 4.0
    sim = plane()
    ring = sim.add_wall(bc.Cylinder((3, 3, 0), (0, 0, 1), 2.0))
    assert Room(sim).volume == pytest.approx(4.0 * pi) and Room(sim).area(ring)(sim) == pytest.approx(4.0 * pi)


@pytest.mark.parametrize("shape", ["sphere", "disc"])
def test_grains_grow_to_a_fraction_of_the_area(shape):
    sim = hexagonal(shape=shape)
    sim.grains.radius *= 0.9
    sim.grains.mass *= 0.9**sim.shape.dimension
    sample = compact(sim, 0.85, "growth", Preparation(friction=0.0, look=20), steps=200)
    assert sample.solid_fraction == pytest.approx(0.85) == solid_fraction(sim)
    size = 36 * sim.shape.mass(0.5 * sqrt(0.85 / (pi / (2.0 * sqrt(3.0)))), 1.0)
    assert sim.grains.mass.sum() == pytest.approx(size), "the density stays"


def test_a_sample_pressed_in_the_plane_has_the_pressure():
    sim = plane(low=(-1, -1), high=(6, 6), properties={**SOFT, "gamma_n": 20.0}, shape="disc")
    for normal in np.eye(3)[:2]:
        sim.add_wall(bc.Plane(0 * normal, normal))
        sim.add_wall(bc.Plane(5 * normal, -normal))
    sim.add_grains([(0.6 + 1.2 * x, 0.6 + 1.2 * y, 0) for x in range(4) for y in range(4)], np.linspace(0.4, 0.5, 16))
    sim.damping = bc.Damping(local=0.5)
    sample = press(sim, 10.0, Preparation(friction=0.2))
    assert [wall.pressing / Room(sim).area(wall)(sim) for wall in sim.walls] == pytest.approx([10.0] * 4, rel=2e-3)
    assert sample.pressure == pytest.approx(10.0, rel=0.02) and 0.7 < sample.solid_fraction < 0.95
    assert not sim.grains.position[:, 2].any() and not sim.grains.omega[:, :2].any()


@pytest.mark.parametrize("periodic", [(True, True), (False, False), (True, False)], ids=["periodic", "closed", "both"])
def test_scattered_grains_overlap_nobody_in_the_plane(periodic):
    radius = np.repeat([0.5, 3.0], [300, 3])
    edge = sqrt(pi * (radius**2).sum() / 0.6)
    box = bc.Box((-1, 2), (edge - 1, edge + 2), periodic)
    found = scatter(box, radius, seed=3)
    away = np.linalg.norm(box.difference(found.position[:, None], found.position[None]), axis=2)
    assert (away - radius[:, None] - radius + 1e9 * np.eye(len(radius))).min() >= 0.0
    room = np.where(box.periodic, 0.0, radius[:, None])[:, :2]
    assert (found.position[:, :2] >= box.low[:2] + room).all() and (found.position[:, :2] <= box.high[:2] - room).all()
    assert not found.position[:, 2].any()
    assert np.abs((found.position - box.low).mean(axis=0)[:2] / edge - 0.5).max() < 0.07, "they fill all of the box"


def test_thrown_grains_are_the_heavier_the_more_they_overlap():
    """A quarter of one for each that overlaps one of this size, on average, as it is counted among them."""
    radius = np.repeat([0.2, 1.0], [1500, 300])
    sim = _cloud(bc.Box((0, 0), (40, 40), (True, True)), radius, np.random.default_rng(2))
    position, mass = sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("mass")
    away = np.linalg.norm(sim.box.difference(position[:, None], position[None]), axis=2)
    overlapped = (away < radius[:, None] + radius).sum(axis=1) - 1
    for size in (0.2, 1.0):
        chosen = radius == size
        assert (mass[chosen].mean() - 1.0) / 0.25 == pytest.approx(overlapped[chosen].mean(), rel=0.1)


def test_too_many_discs_are_told_of_by_their_area():
    with pytest.raises(bc.BarchanError, match=r"still overlap by up to .*solid fraction is 0\.95"):
        scatter(bc.Box((0, 0), (sqrt(100 * pi / 0.95),) * 2, (True, True)), np.ones(100), most=60)


def test_a_dump_has_a_box_that_lammps_takes(tmp_path):
    sim = plane()
    sim.add_grains([(1, 1, 0), (3, 3, 0)], 0.5)
    sim.prepare()
    LammpsDump(tmp_path, bc.Every(1)).write(sim)
    found = read_packing(next(tmp_path.glob("*.dump")))
    assert found.position.tolist() == [[1, 1, 0], [3, 3, 0]]
    assert found.box.low.tolist() == [0, 0, -0.5] and found.box.high.tolist() == [6, 6, 0.5]


def test_a_figure_shows_the_box_in_one_scale(tmp_path):
    sim = plane(high=(6, 3))
    sim.add_grains([(1, 1, 0), (3, 2, 0)], [0.5, 0.25])
    with figure(tmp_path / "plane.png") as (_, axes):
        discs = draw_plane(axes, sim.box, sim.grains.position, sim.grains.radius, [1.0, 2.0], (0.0, 2.0))
        assert axes.get_xlim() == (0, 6000) and axes.get_ylim() == (0, 3000) and axes.get_aspect() == 1.0
        assert axes.get_xlabel() == "x [mm]" and axes.get_ylabel() == "y [mm]"
        assert sorted(map(tuple, discs.get_offsets())) == [(1000, 1000), (3000, 2000)]
    assert matplotlib.image.imread(tmp_path / "plane.png").shape[2] == 4


def test_contacts_of_the_plane_have_no_z():
    sim = hexagonal(overlap=0.01)
    sim.prepare()
    table = contact_table(sim)
    assert len(table["first"]) == 108 and not table["force"][:, 2].any() and not table["point"][:, 2].any()
