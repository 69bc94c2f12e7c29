"""Laguerre cells: closed forms, lattices, Voro++, and the same bits however space is shared."""

import multivoro
import numpy as np
import pytest
from scenes import NOTHING, simulation

import barchan as bc
from barchan.errors import SceneError
from barchan.measure import laguerre_cells
from barchan.neighbors.tessellation import tessellate
from barchan.parallel import virtual_ranks


def crowd(places, radius=0.01, high=(1.0, 1.0, 1.0), periodic=(False, False, False)):
    sim = simulation(bc.Box((0, 0, 0), high, periodic), properties=NOTHING)
    sim.add_grains(places, radius)
    return sim


def faces_of(cells, i, least=0.0):
    """{neighbour: area} of a cell."""
    some = slice(cells.start[i], cells.start[i + 1])
    area = np.linalg.norm(cells.area[some], axis=1)
    return {int(n): float(a) for n, a in zip(cells.neighbour[some], area) if a > least}


def test_two_grains_share_the_box_at_their_radical_plane():
    """At a distance (d^2 + R1^2 - R2^2) / 2 d from the first."""
    cells = laguerre_cells(crowd([(0.2, 0.5, 0.5), (0.7, 0.5, 0.5)], [0.1, 0.3]))
    plane = 0.2 + 0.5 * (0.25 + 0.01 - 0.09) / 0.5
    np.testing.assert_allclose(cells.volume, [plane, 1.0 - plane], rtol=1e-14)
    np.testing.assert_allclose(cells.solid_fraction, 4.0 / 3.0 * np.pi * np.array([0.001, 0.027]) / cells.volume, rtol=1e-14)
    assert faces_of(cells, 0) == pytest.approx({1: 1.0, -1: 1.0, -3: plane, -4: plane, -5: plane, -6: plane}, rel=1e-13)
    beyond = cells.neighbour[: cells.start[1]].tolist().index(1)
    np.testing.assert_allclose(cells.area[beyond], (1.0, 0.0, 0.0), atol=1e-14)


LATTICES = {
    "sc": ([(0, 0, 0)], [(6, 1.0)]),
    "bcc": ([(0, 0, 0), (0.5, 0.5, 0.5)], [(6, 0.125), (8, 3.0 * np.sqrt(3.0) / 16.0)]),  # truncated octahedron, edge sqrt(2)/4
    "fcc": ([(0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0)], [(12, np.sqrt(2.0) / 8.0)]),  # rhombic dodecahedron
}


@pytest.mark.parametrize("name", LATTICES)
def test_cells_of_lattices_are_their_polyhedra(name):
    """Many planes meet in one corner, and those that only touch a corner or an edge leave no face."""
    base, kinds = LATTICES[name]
    corners = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 1, 3)
    places = 0.7 * (corners + np.array(base)).reshape(-1, 3) + 0.1  # rounded
    cells = laguerre_cells(crowd(places, 0.2, (2.8, 2.8, 2.8), (True, True, True)))
    np.testing.assert_allclose(cells.volume, 0.343 / len(base), rtol=1e-12)
    expected = sorted(0.49 * area for count, area in kinds for _ in range(count))
    for i in range(len(places)):
        np.testing.assert_allclose(sorted(np.linalg.norm(cells.area[cells.start[i] : cells.start[i + 1]], axis=1)), expected)


def test_a_sheared_lattice_in_a_tilted_box_goes_on_beyond_its_faces():
    """All grains have the same cell, at the faces, too."""
    places = 1.0 * np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3)
    places[:, 0] += 0.1 * places[:, 2]
    sim = simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, True)), properties=NOTHING)
    sim.box.tilt[1] = 0.4
    sim.add_grains(places, 0.3)
    cells = laguerre_cells(sim)
    np.testing.assert_allclose(cells.volume, 1.0, rtol=1e-12)
    areas = np.sort(np.linalg.norm(cells.area, axis=1).reshape(64, -1), axis=1)
    np.testing.assert_allclose(areas, areas[:1].repeat(64, axis=0), rtol=1e-9)


def test_images_are_found_however_far_they_are():
    """A cloud in a corner of a periodic box."""
    places = 0.02 * np.random.default_rng(6).random((300, 3))
    cells = laguerre_cells(crowd(places, 1e-4, periodic=(True, True, True)))
    assert cells.volume.sum() == pytest.approx(1.0, rel=1e-12)


WIDTHS = {"one size": 1.0, "1:3": 3.0, "1:100": 100.0}


def spread_radii(rng, count, ratio):
    """From the smallest, most of them, to the largest."""
    return 0.0015 * ratio ** (rng.random(count) ** 6)


@pytest.mark.parametrize("ratio", WIDTHS.values(), ids=WIDTHS)
def test_cells_are_those_of_voro(ratio, count=10_000):
    """The same neighbours, but for faces of next to no area, and the same areas, as far as Voro++ itself gives a face the same
    one from both its sides: within 3e-7 (ours: 4e-14). Grains that a larger one has buried have no cell."""
    rng = np.random.default_rng(5)
    places, radii = rng.random((count, 3)), spread_radii(rng, count, ratio)
    cells = laguerre_cells(crowd(places, radii))
    assert cells.volume.sum() == pytest.approx(1.0, rel=1e-12)
    theirs = multivoro.compute_voronoi(places, limits=np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), radii=radii)
    for i, other in enumerate(theirs):
        scale = cells.volume[i] ** (2.0 / 3.0)
        own, voro = faces_of(cells, i, 1e-9 * scale), voro_faces(other, 1e-9 * scale)
        assert own.keys() == voro.keys(), f"grain {i}"
        assert all(abs(own[n] - area) < 1e-6 * scale for n, area in voro.items()), f"grain {i}"


def voro_faces(cell, least):
    """{neighbour: area} of a cell of Voro++."""
    corners, flat, found = np.array(cell.get_vertices()).reshape(-1, 3), cell.get_face_vertices(), {}
    at = 0
    for neighbour in cell.get_neighbors():
        points = corners[flat[at + 1 : at + 1 + flat[at]]]
        at += flat[at] + 1
        fan = np.cross(points[1:-1] - points[0], points[2:] - points[0]).sum(axis=0)
        found[int(neighbour)] = 0.5 * float(np.sqrt(fan @ fan))
    return {neighbour: area for neighbour, area in found.items() if area > least}


@pytest.mark.parametrize("periodic", [(False, False, False), (True, False, True)])
def test_faces_are_shared_and_close_each_cell(periodic):
    rng = np.random.default_rng(3)
    cells = laguerre_cells(crowd(rng.random((300, 3)), rng.uniform(0.01, 0.05, 300), periodic=periodic))
    assert cells.volume.sum() == pytest.approx(1.0, rel=1e-12)
    one = np.repeat(cells.id, np.diff(cells.start))
    closed = np.zeros((300, 3))
    np.add.at(closed, one, cells.area)
    np.testing.assert_allclose(closed, 0.0, atol=1e-13)
    between = cells.neighbour >= 0
    total = np.zeros((300, 300, 3))  # of several images together
    np.add.at(total, (one[between], cells.neighbour[between]), cells.area[between])
    np.testing.assert_allclose(total, -total.transpose(1, 0, 2), atol=1e-13)


def by_id(count, periodic):
    """id -> volume, neighbours and areas, of this rank's grains."""
    rng = np.random.default_rng(9)
    sim = crowd(rng.random((count, 3)), spread_radii(rng, count, 30.0), periodic=periodic)
    cells = laguerre_cells(sim)
    parts = zip(cells.id.tolist(), cells.volume.tolist(), cells.start[:-1], cells.start[1:])
    return {i: (volume, cells.neighbour[a:b].tolist(), cells.area[a:b].tobytes()) for i, volume, a, b in parts}


@pytest.mark.parametrize("periodic", [(False, False, False), (True, True, True)])
@pytest.mark.parametrize("count", [4, 500])
def test_the_same_bits_on_ranks(count, periodic):
    alone = by_id(count, periodic)
    for ranks in (2, 3):
        together = {}
        for part in virtual_ranks(ranks, by_id, count, periodic):
            together |= part
        assert together == alone


def test_the_order_of_grains_changes_no_bit():
    """Rows alone differ: the ids go along. Many grains of a lattice are equally near."""
    places = np.stack(np.meshgrid(*[np.arange(6) * 0.1 + 0.07] * 3), axis=-1).reshape(-1, 3)
    ids, turn = np.arange(len(places)), np.random.default_rng(2).permutation(len(places))
    place = np.column_stack([places, np.full(len(places), 0.05)])
    one, other = (tessellate(place[rows], ids[rows], len(rows), np.zeros(3), np.ones(3)) for rows in (ids, turn))
    assert one.volume[turn].tobytes() == other.volume.tobytes()
    areas = [np.add.reduceat(np.abs(cells.area), cells.start[:-1]) for cells in (one, other)]
    assert areas[0][turn].tobytes() == areas[1].tobytes()


def test_of_grains_at_one_place_the_larger_has_the_cell():
    cells = laguerre_cells(crowd([(0.2, 0.5, 0.5), (0.2, 0.5, 0.5), (0.8, 0.5, 0.5)], [0.1, 0.2, 0.2]))
    np.testing.assert_allclose(cells.volume, [0.0, 0.5, 0.5], rtol=1e-14)


def test_no_grains_have_no_cells():
    sim = simulation(properties=NOTHING)
    assert len(laguerre_cells(sim).volume) == 0


def test_containers_that_are_none_are_refused():
    sim = crowd([(0.2, 0.5, 0.5), (0.7, 0.5, 0.5)], periodic=(False, False, True))
    with pytest.raises(SceneError, match=r"1 centre\(s\) lie outside the container, from \[0.0, 0.0, 0.0\] to \[0.5, 1.0, 1.0\]"):
        laguerre_cells(sim, high=(0.5, 1.0, 1.0))
    with pytest.raises(SceneError, match=r"from 0 to 0.9 \[length\] along z, where the box is periodic"):
        laguerre_cells(sim, high=(1.0, 1.0, 0.9))
    assert laguerre_cells(sim, low=(0.1, 0.4, 0.0), high=(0.8, 0.6, 1.0)).volume.sum() == pytest.approx(0.14)
