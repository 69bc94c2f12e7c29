"""Meshes from files: the same triangles from all forms, and what is no mesh is refused, naming the file."""

import meshes
import numpy as np
import pytest
from scenes import simulation

import barchan as bc
from barchan.errors import SceneError

trimesh = pytest.importorskip("trimesh")

CUBE = meshes.box((0, 0, 0), (4, 4, 4))


def written(path, vertices=CUBE[0], triangles=CUBE[1]):
    trimesh.Trimesh(vertices, triangles, process=False).export(path)
    return path


@pytest.mark.parametrize("form", ["stl", "obj", "ply", "STL"])
@pytest.mark.parametrize("unit", ["mm", 1e-3])
def test_all_forms_are_read_in_the_units_of_the_scene(form, unit, tmp_path):
    mesh = bc.Mesh.read(written(tmp_path / f"cube.{form}"), unit, inside=True)
    assert mesh.is_closed and mesh.inside and mesh.patches == 6 and mesh.places.shape == (12, 3, 3)
    assert mesh.distance(np.array([(2e-3, 1e-3, 2e-3)])) == pytest.approx([1e-3])


def test_text_is_read(tmp_path):
    lines = ["solid cube"]
    for a, b, c in CUBE[0][CUBE[1]]:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in (a, b, c)), "endloop", "endfacet"]
    (tmp_path / "cube.stl").write_text("\n".join([*lines, "endsolid cube"]))
    assert bc.Mesh.read(tmp_path / "cube.stl", "m").is_closed


def test_what_is_no_mesh_is_refused(tmp_path):
    (tmp_path / "noise.stl").write_bytes(np.random.default_rng(1).bytes(1000))
    (tmp_path / "empty.ply").write_bytes(b"")
    (tmp_path / "no.obj").write_text("v 0 0 0\nf 1 2 3\n")
    for name in ("noise.stl", "empty.ply", "no.obj", "absent.stl"):
        with pytest.raises(SceneError, match=name):
            bc.Mesh.read(tmp_path / name, "m")
    with pytest.raises(SceneError, match=r"its name must end with one of .stl, .obj, .ply"):
        bc.Mesh.read(tmp_path / "mesh.pkl", "m")
    cube = written(tmp_path / "cube.stl")
    for unit in ("furlong", 0.0, None, float("nan")):
        with pytest.raises(SceneError, match=r"must be one of m, cm, mm, um, in, ft, or a number"):
            bc.Mesh.read(cube, unit)
    holes = written(tmp_path / "holes.ply", triangles=CUBE[1][1:])
    assert not bc.Mesh.read(holes, "m").is_closed
    with pytest.raises(SceneError, match=r"holes.ply.*needs a closed mesh; the edge"):
        bc.Mesh.read(holes, "m", inside=True)
    over = written(tmp_path / "over.ply", triangles=[CUBE[1][0][::-1], *CUBE[1][1:]])
    with pytest.raises(SceneError, match=r"over.ply.*run along their common edge in one direction"):
        bc.Mesh.read(over, "m")


def test_millimetres_that_are_taken_for_metres_are_noticed(tmp_path):
    mesh = bc.Mesh.read(written(tmp_path / "cube.stl", 1000.0 * CUBE[0] + 0.0), 10.0)
    with pytest.raises(SceneError, match=r"wall 0 .mesh.: it extends over 40000 .* the box over 20: is its unit right"):
        simulation().add_wall(mesh)
