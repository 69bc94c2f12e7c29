"""What the writers wrote, read by programs that others wrote: VTK (ParaView's readers), LAMMPS and OVITO."""

import json
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from lammps_peer import HEAD, run_lammps

import barchan as bc
from barchan.measure import contact_table
from barchan.writers import ContactFrames, GrainFrames, LammpsDump, MeshFrames
from barchan.writers.collect import contact_lines, grains_at_full_step

#: Shared libraries of the system that the ovito wheel needs and does not bring along, as Debian's packages.
OVITO_NEEDS = "libegl1 libgl1 libxkbcommon0 libdbus-1-3 libfontconfig1 libglib2.0-0 libgssapi-krb5-2 libx11-6"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A pile of two materials on a floor with frozen grains and fields of the user's own, periodic, sheared; 3 frames.

    Returns:
        (directory, simulation, which is at the last frame)."""
    folder = tmp_path_factory.mktemp("written")
    values = dict(youngs_modulus=1e6, poisson_ratio=0.25, friction=0.4)
    materials = [bc.Material("a", density=1000.0, **values), bc.Material("b", density=2000.0, **values)]
    box = bc.Box((0, -1, 0), (6, 5, 7), periodic=(True, True, False))
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, materials, dt=1e-4, gravity=(3.0, 0.0, -9.81))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1), material="a"))
    sim.add_field("label", width=2)
    sim.add_field("marked", dtype=bool)
    site = np.random.default_rng(3).permutation(180)[:150]
    place = np.stack([site % 6, site // 6 % 6 - 1.0, site // 36], axis=1) * 1.0 + (0.01, 0.01, 0.49)
    radius = np.random.default_rng(4).uniform(0.47, 0.51, len(site))
    for k, name in enumerate("ab"):
        ids = sim.add_grains(place[k::2], radius[k::2], name, velocity=(-2.0, 1.0, 0.0), omega=(0.0, 1.0, 2.0), frozen=k == 1)
        sim.grains.label[np.isin(sim.grains.id, ids)] = (k, 0.1)
    sim.grains.marked = sim.grains.id % 2 == 0
    sim.writers = [kind(folder, bc.Every(50)) for kind in (GrainFrames, ContactFrames, LammpsDump)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(150)
    return folder, sim


def opened_by_vtk(path):
    """What ``vtkHDFReader`` makes of a file."""
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def arrays(group):
    """Name -> array, of points, cells or fields."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return {group.GetArrayName(k): vtk_to_numpy(group.GetArray(k)).copy() for k in range(group.GetNumberOfArrays())}


def read_by_vtk(path):
    """(points, number of vertices, lines, point data, cell data, field data) as ``vtkHDFReader`` gives them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    read = opened_by_vtk(path)
    points = vtk_to_numpy(read.GetPoints().GetData()).copy() if read.GetNumberOfPoints() else np.zeros((0, 3))
    lines = np.split(vtk_to_numpy(read.GetLines().GetConnectivityArray()), vtk_to_numpy(read.GetLines().GetOffsetsArray())[1:-1])
    lines = np.array(lines if read.GetNumberOfLines() else [], dtype=np.int64).reshape(-1, 2)
    data = [arrays(group) for group in (read.GetPointData(), read.GetCellData(), read.GetFieldData())]
    return points, read.GetNumberOfVerts(), lines, *data


def test_vtk_reads_all_grains_and_all_their_fields(written):
    folder, sim = written
    points, vertices, lines, grains, cells, now = read_by_vtk(folder / "grains_000000000150.vtkhdf")
    expected = grains_at_full_step(sim)
    assert np.array_equal(points, expected.pop("position"))
    assert (len(points), vertices, len(lines)) == (150, 150, 0)
    assert set(grains) == set(expected) and {"label", "marked", "image", "frozen", "omega"} <= set(grains)
    for name, values in expected.items():
        assert np.array_equal(grains[name], values), name
        assert values.dtype == bool or grains[name].dtype == values.dtype, name
    assert 0 < grains["frozen"].sum() < 150 and (grains["image"] != 0).any() and set(grains["material"]) == {0, 1}
    assert not cells and now["step"].tolist() == [150] and now["time"].tolist() == [sim.time]


def test_vtk_reads_contacts_as_lines(written):
    folder, sim = written
    points, vertices, lines, grains, cells, now = read_by_vtk(folder / "contacts_000000000150.vtkhdf")
    ends, expected = contact_lines(sim)
    assert len(lines) == len(contact_table(sim)["first"]) > 50 and vertices == 0 and not grains
    assert np.array_equal(points[lines], ends)
    assert set(cells) == {"force", "normal_force", "overlap", "first", "second"}
    for name, values in expected.items():
        assert np.array_equal(cells[name], values), name
    assert (cells["second"] < 0).any(), "at the floor"
    assert (points.min(axis=0)[:2] < sim.box.low[:2]).any() or (points.max(axis=0)[:2] > sim.box.high[:2]).any(), "across a face"
    assert now["time"].tolist() == [sim.time]


def test_vtk_reads_meshes_as_triangles(tmp_path):
    """A floor of two triangles, on which a grain lies, and a block, on which none does."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    material = bc.Material("a", density=1.0, kn=1e3, kt=1e2, friction=0.5)
    sim = bc.Simulation(bc.Box((0, 0, 0), (6, 6, 6)), bc.laws.linear, material, dt=1e-3, threads=1)
    floor = sim.add_wall(bc.Mesh([(0, 0, 1), (6, 0, 1), (0, 6, 1), (6, 6, 1)], [(0, 1, 2), (1, 3, 2)]))
    block = sim.add_wall(bc.Mesh([(4, 4, 4), (5, 4, 4), (4, 5, 4), (4, 4, 5)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]))
    sim.add_grains((2.0, 1.0, 1.49), 0.5)
    sim.prepare()
    MeshFrames(tmp_path, bc.Every(1)).write(sim)
    read = opened_by_vtk(tmp_path / "meshes_000000000000.vtkhdf")
    points, triangles = vtk_to_numpy(read.GetPoints().GetData()), vtk_to_numpy(read.GetPolys().GetConnectivityArray())
    assert np.array_equal(points[triangles.reshape(-1, 3)], np.concatenate([floor.places, block.places]))
    assert (read.GetNumberOfPolys(), read.GetNumberOfVerts(), read.GetNumberOfLines()) == (6, 0, 0)
    cells = arrays(read.GetCellData())
    assert cells["wall"].tolist() == [0, 0, 1, 1, 1, 1] and cells["triangle"].tolist() == [0, 1, 0, 1, 2, 3]
    assert set(cells) == {"wall", "triangle", "force", "torque", "stress"} and (cells["force"][1:] == 0.0).all()
    assert cells["force"][0].tolist() == floor.force.tolist() and cells["force"][0, 2] == pytest.approx(-10.0)
    assert cells["stress"][0, 2] == pytest.approx(-10.0 / 18.0)


def test_every_frame_of_the_series_opens_with_its_time(written):
    folder, _ = written
    for kind in ("grains", "contacts"):
        files = json.loads((folder / f"{kind}.vtkhdf.series").read_text())["files"]
        assert [entry["name"][-11:-7] for entry in files] == ["0050", "0100", "0150"]
        for entry in files:
            assert read_by_vtk(folder / entry["name"])[-1]["time"].tolist() == [entry["time"]]


def test_vtk_reads_frames_without_grains_and_contacts(tmp_path):
    sim = bc.Simulation(bc.Box((0, 0, 0), (1, 1, 1)), bc.laws.linear, bc.Material("a", kn=1.0, kt=1.0, friction=0.0), dt=1e-3)
    sim.prepare()
    for kind in (GrainFrames, ContactFrames):
        kind(tmp_path, bc.Every(1)).write(sim)
    for name in ("grains", "contacts"):
        points, vertices, lines, *_ = read_by_vtk(tmp_path / f"{name}_000000000000.vtkhdf")
        assert len(points) == vertices == len(lines) == 0


#: Three columns at a time go through the one vector that ``read_dump`` lets a script rename.
COLUMNS = {"force": "fx fy fz", "omega": "omegax omegay omegaz", "size": "radius mass type", "image": "ix iy iz"}


def test_lammps_reads_the_dump(written, tmp_path):
    """``read_dump`` makes the box and the atoms of it; all columns are compared to the last bit."""
    folder, sim = written
    dump = folder / "grains_000000000150.dump"
    script = [HEAD, "atom_modify map array\nboundary p p f\nregion box block 0 1 0 1 0 1\ncreate_box 2 box\n"]
    script.append(f"read_dump {dump} 150 x y z vx vy vz box yes add keep\nrun 0 pre no\nsnapshot grains\n")
    for name, columns in COLUMNS.items():
        labels = " ".join(f"label f{axis} {column}" for axis, column in zip("xyz", columns.split()))
        script.append(f"read_dump {dump} 150 fx fy fz {labels} box no replace yes\nsnapshot {name}\n")
    taken = run_lammps("".join(script), tmp_path)
    expected = grains_at_full_step(sim)
    assert np.array_equal(taken["grains"]["x"], expected["position"])
    assert np.array_equal(taken["grains"]["v"], expected["velocity"])
    size = np.stack([expected["radius"], expected["mass"], expected["material"] + 1.0], axis=1)
    for name, values in (expected | {"size": size}).items():
        if name in COLUMNS:
            assert np.array_equal(taken[name]["f"], values), name


READ_BY_OVITO = """
import sys
import numpy as np
from ovito.io import import_file

pipeline = import_file(sys.argv[1])
data = pipeline.compute(pipeline.num_frames - 1)
arrays = {name: np.array(values) for name, values in data.particles.items()}
box = {"cell": np.array(data.cell[...]), "periodic": np.array(data.cell.pbc), "frames": pipeline.num_frames}
np.savez(sys.argv[2], **arrays, **box, time=data.attributes["Time"], step=data.attributes["Timestep"])
"""


def test_ovito_reads_the_dumps(written, tmp_path):
    """All frames as one series, in a process of its own; box, time, step and every column."""
    folder, sim = written
    result = tmp_path / "read.npz"
    command = [sys.executable, "-c", READ_BY_OVITO, str(Path(folder) / "grains_*.dump"), str(result)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    if "ImportError" in done.stderr or "ModuleNotFoundError" in done.stderr:
        pytest.skip(f"OVITO cannot be loaded ({done.stderr.strip().splitlines()[-1]}); it needs, of the system: {OVITO_NEEDS}")
    assert done.returncode == 0, done.stderr
    grains = np.load(result)
    expected = grains_at_full_step(sim)
    assert (int(grains["frames"]), int(grains["step"]), float(grains["time"])) == (3, 150, sim.time)
    assert np.array_equal(grains["cell"], np.column_stack([np.diag([6.0, 6.0, 7.0]), [0.0, -1.0, 0.0]]))
    assert grains["periodic"].tolist() == [True, True, False]
    order = np.argsort(grains["Particle Identifier"])
    names = {
        "Position": "position",
        "Velocity": "velocity",
        "Angular Velocity": "omega",
        "Force": "force",
        "Radius": "radius",
        "Mass": "mass",
    }
    for theirs, ours in names.items():
        digits = 1e-6 if grains[theirs].dtype == np.float32 else 1e-14  # OVITO keeps radii in single precision
        assert grains[theirs][order] == pytest.approx(expected[ours], rel=digits, abs=0.0), ours
    assert np.array_equal(grains["Particle Identifier"][order], expected["id"] + 1)
    assert np.array_equal(grains["Periodic Image"][order], expected["image"])
    assert np.array_equal(grains["Particle Type"][order], expected["material"] + 1)
