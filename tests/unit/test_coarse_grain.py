"""Coarse-grained fields: totals, crystals, and a plain sum over all images."""

import math
from itertools import product

import numpy as np
import pytest
from scenes import fingerprint, pile, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.kernels import compiler
from barchan.measure import coarse_grain, contact_table, stress
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]

SIMPLE_CUBIC = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) + 0.5


def flow(steps=40, **options):
    """Grains that fall, roll and collide over a floor, some of them frozen."""
    sim = pile(110, **options)
    sim.freeze([7, 50])
    sim.run(steps)
    return sim


def moving(sim):
    """Place, mass and velocity at the full step of the grains that are not frozen."""
    grains = sim.grains
    rows = grains.frozen == 0
    velocity = grains.velocity + 0.5 * sim.dt * grains.force / grains.mass[:, None]
    return grains.position[rows], grains.mass[rows], velocity[rows]


@pytest.mark.parametrize(
    ("shape", "width", "periodic"),
    [
        ((6, 6, 6), 1.0, (True, True, False)),
        ((3, 7, 5), 2.3, (True, False, False)),
        ((6, 1, 6), 1.2, (True, True, False)),
        ((2, 2, 2), 9.0, (True, True, False)),
        ((1, 1, 1), 0.1, (False, True, False)),
    ],
)
def test_totals_are_those_of_the_grains_and_contacts(shape, width, periodic):
    """On grids coarse and fine, with a kernel longer than the box, with axes averaged over."""
    sim = flow(periodic=periodic)
    found, cell = coarse_grain(sim, shape, width), 216.0 / math.prod(shape)
    _, mass, velocity = moving(sim)
    momentum = mass[:, None] * velocity
    assert found.density.shape == shape and found.kinetic_stress.shape == (*shape, 3, 3)
    assert found.density.sum() * cell == pytest.approx(mass.sum(), rel=1e-13)
    assert found.momentum.sum(axis=(0, 1, 2)) * cell == pytest.approx(momentum.sum(axis=0), rel=1e-12)
    contact = stress(sim).contact
    assert found.contact_stress.mean(axis=(0, 1, 2)) == pytest.approx(contact, rel=1e-12, abs=1e-12 * np.abs(contact).max())
    of_mean = (
        found.momentum[..., :, None] * (found.momentum / np.where(found.density > 0, found.density, 1)[..., None])[..., None, :]
    )
    square = (found.kinetic_stress + of_mean).sum(axis=(0, 1, 2)) * cell
    assert square == pytest.approx(momentum.T @ velocity, rel=1e-12, abs=1e-12)


def plainly(points, amounts, box, shape, width):
    """The same by a sum over all cells and images."""
    cell, fields = box.length / shape, np.zeros((*shape, amounts.shape[1]))
    centre = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) * edge for n, edge in zip(shape, cell)], indexing="ij"), axis=-1)
    turns = [(-2, -1, 0, 1, 2) if around else (0,) for around in box.periodic]
    for point, amount in zip(points, amounts):
        weight = np.zeros(shape)
        for turn in product(*turns):
            q = np.sqrt(((centre - point + turn * box.length) ** 2).sum(axis=-1)) / width
            weight += np.where(q < 1.0, (1 + 3 * q) * np.maximum(1 - q, 0.0) ** 3, 0.0)
        fields += (weight / weight.sum())[..., None] * amount / np.prod(cell)
    return fields


def test_fields_agree_with_a_plain_sum_over_all_cells_and_images():
    sim, shape, width = flow(), (5, 4, 6), 1.6
    found = coarse_grain(sim, shape, width)
    place, mass, velocity = moving(sim)
    density, *momentum = np.moveaxis(
        plainly(place, mass[:, None] * np.insert(velocity, 0, 1.0, axis=1), sim.box, shape, width), -1, 0
    )
    momentum = np.stack(momentum, axis=-1)
    assert found.density == pytest.approx(density, rel=1e-11, abs=1e-13)
    assert found.momentum == pytest.approx(momentum, rel=1e-11, abs=1e-13)
    square = (mass[:, None, None] * velocity[:, :, None] * velocity[:, None, :]).reshape(-1, 9)
    kinetic = plainly(place, square, sim.box, shape, width).reshape(*shape, 3, 3)
    kinetic -= momentum[..., :, None] * momentum[..., None, :] / density[..., None, None]
    assert found.kinetic_stress == pytest.approx(kinetic, rel=1e-9, abs=1e-12)
    assert found.x == pytest.approx([0.6, 1.8, 3.0, 4.2, 5.4]) and found.z == pytest.approx(np.arange(6) + 0.5)


def test_contact_stress_agrees_with_points_along_the_branches():
    """Of grains and walls, by many points on each branch: the rest is the error of a few."""
    sim, shape, width = pile(110), (4, 4, 4), 2.5
    sim.run(40)
    found, table = coarse_grain(sim, shape, width).contact_stress, contact_table(sim)
    place, points, amounts = sim.grains.sorted_by_id("position"), [], []
    for first, second, force, point in zip(*(table[name] for name in ("first", "second", "force", "point"))):
        branch = sim.box.difference(place[first], place[second] if second >= 0 else point)
        for t in (np.arange(24) + 0.5) / 24:
            points.append(place[first] - t * branch)
            amounts.append(np.outer(force, branch).ravel() / 24)
    plain = plainly(np.array(points), np.array(amounts), sim.box, shape, width).reshape(*shape, 3, 3)
    assert found == pytest.approx(plain, abs=5e-3 * np.abs(plain).max())


@pytest.mark.parametrize(("shape", "width"), [((4, 4, 4), 1.5), ((8, 8, 8), 0.7), ((4, 1, 8), 1.0)])
def test_a_crystal_looks_alike_in_all_its_cells(shape, width):
    """One grid point, or 2^3 mirror images of one, for each grain: density and stress are uniform; a rigid motion has no
    fluctuations."""
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, True)))
    sim.add_grains(SIMPLE_CUBIC, 0.51, velocity=(3.0, 0.0, -2.0))
    sim.prepare()
    found, mass = coarse_grain(sim, shape, width), math.pi / 6.0 * 1.02**3
    assert found.density == pytest.approx(np.full(shape, mass), rel=1e-12)
    assert found.momentum == pytest.approx(np.broadcast_to(mass * np.array([3.0, 0.0, -2.0]), (*shape, 3)), rel=1e-12)
    assert np.abs(found.kinetic_stress).max() < 1e-13 * mass * 9.0
    if shape == (4, 4, 4):
        assert found.contact_stress == pytest.approx(np.broadcast_to(20.0 * np.eye(3), (*shape, 3, 3)), abs=1e-10)


def test_two_streams_have_the_stress_of_their_difference():
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, True)))
    sim.add_grains(SIMPLE_CUBIC, 0.4, velocity=np.where((SIMPLE_CUBIC[:, :1] % 2) < 1, [5.0, 1.0, 0], [5.0, -1.0, 0]))
    sim.prepare()
    assert coarse_grain(sim, (1, 1, 1), 1.0).kinetic_stress == pytest.approx(
        np.reshape(np.diag([0, 4.0 / 3.0 * math.pi * 0.4**3, 0]), (1, 1, 1, 3, 3)), abs=1e-12
    )


def test_fields_travel_with_the_grains_through_periodic_faces():
    fields = []
    for shift in (0.0, 4.0):
        sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), (True, True, False)))
        rng = np.random.default_rng(2)
        sim.add_grains(
            (SIMPLE_CUBIC * 1.5 + rng.uniform(-0.1, 0.1, (64, 3)) + (0, shift, 0)) % 6, 0.55, velocity=rng.normal(size=(64, 3))
        )
        sim.prepare()
        fields.append(coarse_grain(sim, (6, 6, 6), 1.7))
    for before, after in zip(*fields):
        if before.ndim >= 3:
            assert after == pytest.approx(np.roll(before, 4, axis=1), rel=1e-9, abs=1e-10)


def test_what_touches_a_wall_outside_the_box_counts_at_its_face():
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4)))
    sim.add_wall(bc.Plane((0, 0, -0.4), (0, 0, 1)))
    sim.add_grains([[2, 2, 0.05]], 0.5)
    sim.prepare()
    found = coarse_grain(sim, (8, 8, 8), 0.5).contact_stress
    assert found[..., 2, 2].sum() * 0.125 == pytest.approx(1000 * 0.05 * 0.45, rel=1e-12)
    assert not found[:, :, 2:].any()


@pytest.mark.parametrize(
    ("shape", "width", "message"),
    [
        ((4, 4), 2.0, r"shape = \(4, 4\) must be three whole numbers > 0"),
        ((4, 4, 0), 2.0, r"shape = \(4, 4, 0\) must be three whole numbers > 0"),
        ((4, 4, 2.5), 2.0, r"shape = \(4, 4, 2.5\) must be three whole numbers > 0"),
        (4, 2.0, "shape = 4 must be three whole numbers > 0"),
        ((3, 6, 6), 1.9, "width = 1.9 .* below the longest edge of a cell, 2;"),
        ((6, 6, 6), math.nan, "width = nan"),
    ],
)
def test_grids_that_are_none_are_refused(shape, width, message):
    with pytest.raises(SceneError, match=f"coarse_grain: {message}"):
        coarse_grain(flow(steps=1), shape, width)


def test_contacts_of_a_scene_that_was_changed_are_not_measured():
    sim = flow(steps=1)
    sim.remove([3])
    with pytest.raises(SceneError, match="the scene was changed"):
        coarse_grain(sim, (6, 6, 6), 1.0)


def test_an_empty_box():
    sim = simulation()
    sim.prepare()
    assert not any(field.any() for field in coarse_grain(sim, (2, 2, 2), 20.0)[3:])


def test_the_same_bits_for_any_number_of_ranks_and_threads_and_nothing_changed(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)

    def program(threads=1):
        return [field.tobytes() for field in coarse_grain(flow(threads=threads), (5, 3, 4), 2.0)]

    alone = program()
    assert program(2) == alone
    for ranks in (1, 2, 4):
        assert virtual_ranks(ranks, program) == [alone] * ranks

    watched, plain = flow(), flow()
    coarse_grain(watched, (5, 3, 4), 2.0)
    watched.run(5), plain.run(5)
    assert fingerprint(watched) == fingerprint(plain)
