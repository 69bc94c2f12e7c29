"""Strain from the displacements of grains: known motions, who counts, and the same bits everywhere."""

import numpy as np
import pytest
from clouds import cloud
from scenes import NOTHING, pile, simulation

import barchan as bc
from barchan.actions import mark_places
from barchan.checkpoint import restore, save
from barchan.errors import SceneError
from barchan.measure import strain
from barchan.packing import press
from barchan.parallel import virtual_ranks
from barchan.walls import Room

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

GRADIENT = np.array([[-0.1, 0.3, 0.0], [0.02, -0.2, 0.05], [0.0, -0.07, 0.15]])


def marked(count=60, periodic=(False, False, False), **where):
    sim = simulation(bc.Box((-20, -20, -20), (20, 20, 20), periodic), properties=NOTHING)
    sim.add_grains(np.random.default_rng(3).uniform(-9, 9, (count, 3)), 0.01)
    mark_places(sim, **where)
    return sim


def move(sim, deformation, shift=(1.0, -2.0, 0.5)):
    sim.grains.position = sim.grains.position @ np.transpose(deformation) + shift


def turned(angle, about=(1.0, 2.0, -0.5)):
    """Rodrigues' formula."""
    axis = np.array(about) / np.linalg.norm(about)
    K = np.cross(np.eye(3), axis)
    return np.eye(3) - np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


@pytest.mark.nojit
def test_an_affine_motion_is_found():
    sim = marked()
    move(sim, np.eye(3) + GRADIENT)
    found, F = strain(sim), np.eye(3) + GRADIENT
    assert found.gradient == pytest.approx(GRADIENT, abs=1e-13) and found.grains == 60
    assert found.small == pytest.approx(-0.5 * (GRADIENT + GRADIENT.T), abs=1e-13)
    assert found.green_lagrange == pytest.approx(-0.5 * (F.T @ F - np.eye(3)), abs=1e-13)
    assert found.volumetric_strain == pytest.approx(-np.log(np.linalg.det(F)), abs=1e-12)
    stretch = found.rotation.T @ F
    assert stretch == pytest.approx(stretch.T, abs=1e-12) and np.linalg.eigvalsh(stretch).min() > 0.0
    assert found.rotation @ found.rotation.T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.nojit
def test_a_rotation_is_no_strain():
    sim = marked()
    move(sim, turned(1.1))
    found = strain(sim)
    assert found.green_lagrange == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    assert found.logarithmic == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    assert found.rotation == pytest.approx(turned(1.1), abs=1e-12)
    assert np.abs(found.small).max() > 0.1, "the small strain takes it for one"
    assert found.deviatoric_strain == pytest.approx(0.0, abs=1e-12)


@pytest.mark.nojit
def test_compression_is_positive_and_logarithmic():
    """As in a triaxial test: axial e1, radial e3, then turned as a whole, which changes nothing."""
    sim, e1, e3 = marked(), 0.3, -0.1
    move(sim, turned(0.4) @ np.diag(np.exp([-e3, -e3, -e1])))
    found = strain(sim)
    assert found.logarithmic == pytest.approx(np.diag([e3, e3, e1]), abs=1e-12)
    assert found.volumetric_strain == pytest.approx(e1 + 2.0 * e3, abs=1e-12)
    assert found.deviatoric_strain == pytest.approx(2.0 / 3.0 * (e1 - e3), abs=1e-12)


@pytest.mark.nojit
def test_displacements_that_fit_no_affine_motion_are_fitted_best():
    """No gradient near that found has a smaller sum of squares: NumPy's least squares say the same."""
    sim = marked()
    place = sim.grains.sorted_by_id("position")
    move(sim, np.eye(3) + GRADIENT)
    sim.grains.position += np.random.default_rng(7).normal(scale=0.1, size=place.shape)
    moved = sim.grains.sorted_by_id("position") - place
    fit = np.linalg.lstsq(np.column_stack([place, np.ones(60)]), moved, rcond=None)[0]
    assert strain(sim).gradient == pytest.approx(fit[:3].T, abs=1e-12)


@pytest.mark.nojit
def test_grains_of_a_brick_are_those_that_were_in_it():
    sim = marked(200)
    upper = sim.grains.position[:, 2] > 1.0
    other = np.diag([0.1, 0.0, -0.05])
    sim.grains.position += np.where(upper[:, None], sim.grains.position @ other.T, sim.grains.position @ GRADIENT.T)
    found = strain(sim, low=(-20, -20, 1.0))
    assert found.gradient == pytest.approx(other, abs=1e-13) and found.grains == upper.sum()
    assert strain(sim, high=(20, 20, 1.0)).gradient == pytest.approx(GRADIENT, abs=1e-13)
    assert strain(sim).grains == 200


@pytest.mark.nojit
def test_grains_that_leave_or_come_or_are_frozen_do_not_count():
    sim = marked()
    sim.remove(np.arange(10, 20))
    move(sim, np.eye(3) + GRADIENT)
    sim.add_grains([(15.0, 3.0, 1.0)], 0.01)
    sim.freeze([5])
    sim.grains.position[sim.grains.row_of(5)] += 3.0
    found = strain(sim)
    assert found.gradient == pytest.approx(GRADIENT, abs=1e-13) and found.grains == 49


@pytest.mark.nojit
def test_some_grains_under_a_name_and_marked_anew():
    sim = marked(100, name="left", where=lambda p: p[:, 0] < 0.0)
    chosen = (sim.grains.position[:, 0] < 0.0).sum()
    move(sim, np.eye(3) + GRADIENT)
    assert strain(sim, "left").grains == chosen < 100 and strain(sim, "left").gradient == pytest.approx(GRADIENT, abs=1e-13)
    mark_places(sim, "left")
    mark_places(sim, "all")
    move(sim, np.eye(3) + 0.1 * GRADIENT)
    assert (strain(sim, "left").gradient == strain(sim, "all").gradient).all()
    assert strain(sim, "left").gradient == pytest.approx(0.1 * GRADIENT, abs=1e-13) and strain(sim, "left").grains == 100


@pytest.mark.parametrize("prepared", [False, True])
def test_grains_are_followed_across_periodic_faces(prepared):
    sim = marked(periodic=(True, True, True))
    move(sim, np.eye(3) + GRADIENT, shift=(33.0, -70.0, 15.0))
    if prepared:
        sim.prepare()
        assert np.abs(sim.grains.position).max() <= 20.0 and np.abs(sim.grains.image).max() > 1
    assert strain(sim).gradient == pytest.approx(GRADIENT, abs=1e-12)
    mark_places(sim)
    assert strain(sim).gradient == pytest.approx(np.zeros((3, 3)), abs=1e-15)


def strain_of_a_pile(path=None, **options):
    sim = pile(**options)
    sim.run(20)
    mark_places(sim, where=lambda p: p[:, 2] < 5.0)
    sim.run(30)
    if path is not None:
        save(sim, path)
        sim = pile(**options)
        restore(sim, path)
    sim.run(70)
    return [strain(sim).gradient.tobytes(), strain(sim, high=(4, 5, 6)).gradient.tobytes()]


@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_the_same_bits_on_ranks_and_after_a_resume(ranks, tmp_path):
    expected = strain_of_a_pile(threads=2)
    assert virtual_ranks(ranks, strain_of_a_pile, tmp_path / "c.h5") == [expected] * ranks


def test_the_strain_of_a_sample_is_that_of_its_walls():
    """A cube 13 grains across is shortened by 12 % along z while the pressure on its sides is held: within 6 % of that. What is
    left are the layers at the walls, which move otherwise: it was 9.6 % for 7 across, 7.3 % for 10, 4.3 % for 13."""
    sim = cloud("brick", across=13)
    press(sim, 4.0)
    room, before = Room(sim), Room(sim).size
    mark_places(sim)
    for wall in room.ends[2]:
        wall.control = None
        wall.velocity = 0.5 * 0.12 * before[2] / 16.0 * wall.normal
    sim.run(8000)
    walls = np.log(before / room.size)
    assert walls[2] == pytest.approx(-np.log(0.88), rel=1e-9) and walls[:2].max() < -0.02
    assert strain(sim).logarithmic == pytest.approx(np.diag(walls), abs=0.06 * walls[2])


def flat():
    sim = simulation()
    sim.add_grains([(x, y, 3.0) for x in (1, 4, 7) for y in (2, 6)], 0.5)
    mark_places(sim)
    return sim


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: strain(simulation()), r"no places were marked under the name 'reference'; call mark_places"),
        (lambda: strain(marked(), "radius"), "no places were marked under the name 'radius'"),
        (lambda: strain(flat()), "the 6 grains marked as 'reference' lie in a plane, or there are fewer than four"),
        (lambda: strain(marked(where=lambda p: p[:, 0] > 99.0)), "the 0 grains marked"),
        (lambda: strain(marked(), low=(3, 3, 3), high=(1, 9, 9)), "brick: "),
        (lambda: mark_places(simulation(), "velocity"), "name = 'velocity' is that of another field"),
        (lambda: mark_places(simulation(), "no name"), "the name must be a new Python identifier"),
        (lambda: mark_places(marked(), where=lambda p: p[:, 0]), r"where\(\) returned an array of float64 and shape \(60,\)"),
    ],
)
def test_what_has_no_strain_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()
