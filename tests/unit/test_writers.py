"""Writers: what they write, how it is read back, and that a file is whole or not there.

A full disk is simulated with RLIMIT_FSIZE, in a process of its own: the operating system refuses a write in the middle.
"""

import json
import subprocess
import sys

import h5py
import meshes
import numpy as np
import pytest
import written
from fuzzing import seal
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import simulation
from written import contents, pile, writers

import barchan as bc
from barchan.atomic import writing
from barchan.checkpoint import restore, save
from barchan.errors import BarchanError, OutputError, RankError, ResultError, SceneError
from barchan.measure import KineticEnergy, contact_table
from barchan.parallel import virtual_ranks
from barchan.writers import ContactFrames, GrainFrames, MeshFrames, frames, read_grain_frame
from barchan.writers.vtkhdf import read_polydata

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

ALWAYS = bc.Every(1)


def run_apart(*arguments):
    """Run ``written.py`` in a process of its own."""
    command = [sys.executable, written.__file__, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


# -- frames ----------------------------------------------------------------------------------------------------------


def test_a_grain_frame_holds_the_state_by_ascending_id(tmp_path):
    sim = pile(tmp_path)
    sim.run(20)
    first, last = frames(tmp_path, "grains")
    assert (first.step, last.step) == (10, 20) and last.time == sim.time
    frame = read_grain_frame(last.path)
    assert (frame.step, frame.time) == (20, sim.time)
    for name in ("id", "position", "radius", "mass", "force", "material", "frozen", "image", "label", "marked"):
        assert np.array_equal(frame.fields[name], sim.grains.sorted_by_id(name)), name
    assert np.array_equal(frame.fields["id"], np.arange(40)) and frame.fields["marked"].sum() == 14


def test_velocities_are_those_of_the_full_step(tmp_path):
    """A falling grain has v = g t at t, not at t - dt/2; and the frame's kinetic energy is the measured one."""
    sim = simulation(gravity=(0, 0, -2.0))
    sim.add_grains([[5, 5, 5], [9, 9, 9]], 0.5, omega=(0, 2.0, 0), frozen=[False, True])
    sim.start_at_full_step()
    sim.run(50)
    GrainFrames(tmp_path, ALWAYS).write(sim)
    velocity = read_grain_frame(frames(tmp_path, "grains")[0].path).fields["velocity"]
    assert velocity == pytest.approx(np.array([[0, 0, -0.1], [0, 0, 0]]), rel=1e-12)

    sim = pile()
    sim.run(30)
    GrainFrames(tmp_path / "pile", ALWAYS).write(sim)
    fields = read_grain_frame(frames(tmp_path / "pile", "grains")[0].path).fields
    energy = KineticEnergy().compute(sim)
    assert 0.5 * (fields["mass"] * (fields["velocity"] ** 2).sum(axis=1)).sum() == pytest.approx(energy.translation, rel=1e-13)
    inertia = 0.4 * fields["mass"] * fields["radius"] ** 2
    assert 0.5 * (inertia * (fields["omega"] ** 2).sum(axis=1)).sum() == pytest.approx(energy.rotation, rel=1e-13)


def test_contacts_are_lines_that_never_cross_the_box(tmp_path):
    sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True, False, False)))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains([[0.2, 4, 4], [7.3, 4, 4], [4, 4, 0.45], [4, 4, 1.4]], [0.6, 0.4, 0.5, 0.48])
    sim.prepare()
    ContactFrames(tmp_path, ALWAYS).write(sim)
    with h5py.File(tmp_path / "contacts_000000000000.vtkhdf") as file:
        root = file["VTKHDF"]
        lines = root["Points"][()][root["Lines/Connectivity"][()].reshape(-1, 2)]
        cells = {name: dataset[()] for name, dataset in root["CellData"].items()}
    across, wall, stacked = [[0.2, 4, 4], [-0.7, 4, 4]], [[4, 4, 0.45], [4, 4, 0]], [[4, 4, 0.45], [4, 4, 1.4]]
    assert lines == pytest.approx(np.array([across, wall, stacked]), abs=1e-12)
    assert list(zip(cells["first"], cells["second"])) == [(0, 1), (2, -1), (2, 3)]
    assert cells["overlap"] == pytest.approx([0.1, 0.05, 0.03])
    assert cells["normal_force"] == pytest.approx([100.0, 50.0, 30.0])
    assert cells["force"] == pytest.approx(np.array([[100, 0, 0], [0, 0, 50], [0, 0, -30.0]]))


def test_meshes_are_triangles_with_what_grains_do_to_them(tmp_path):
    """A sheet and a block, beside a plane; the sum of forces and torques is that of each wall; the same bytes from two ranks."""

    def program(directory):
        sim = simulation(bc.Box((0, 0, 0), (20, 20, 20)))
        sheet = sim.add_wall(bc.Mesh(*meshes.floor("regular")))
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
        block = sim.add_wall(bc.Mesh(*meshes.box((8, 8, 8), (12, 12, 12)), velocity=(0.5, 0, 0)))
        sim.add_grains([(5.1, 5.2, 0.45), (9, 11, 12.47), (12.47, 10.5, 9), (15, 15, 0.48)], 0.5, velocity=(0.1, 0.2, 0))
        sim.writers = [MeshFrames(directory, ALWAYS)]
        sim.run(3)
        return [np.array([wall.force, wall.torque]) for wall in (sheet, block)], [sheet.places, block.places]

    loads, places = program(tmp_path / "one")
    assert program(tmp_path / "one")[0][0].tolist() == virtual_ranks(2, program, tmp_path / "two")[1][0][0].tolist()
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert [frame.step for frame in frames(tmp_path / "one", "meshes")] == [1, 2, 3]
    with h5py.File(frames(tmp_path / "one", "meshes")[-1].path) as file:
        root = file["VTKHDF"]
        corners = root["Points"][()][root["Polygons/Connectivity"][()].reshape(-1, 3)]
        cells = {name: dataset[()] for name, dataset in root["CellData"].items()}
    assert (cells["wall"] == np.repeat([0, 2], [3200, 12])).all() and cells["triangle"].tolist() == [*range(3200), *range(12)]
    assert np.array_equal(corners, np.concatenate(places))
    for number, load in zip((0, 2), loads):
        sums = [cells[name][cells["wall"] == number].sum(axis=0) for name in ("force", "torque")]
        np.testing.assert_allclose(sums, load, rtol=0.0, atol=1e-13 * np.abs(load).max())
        assert np.abs(load[0]).max() > 10.0
    hit = (cells["force"] != 0.0).any(axis=1)
    assert hit.sum() == 4 and cells["stress"][hit & (cells["wall"] == 0)] == pytest.approx(cells["force"][hit][:2] / 0.125)


def test_normal_and_tangential_force_make_up_the_whole(tmp_path):
    """In a pile that slides: |normal_force| <= |force|, and every touching contact is there once."""
    sim = pile(tmp_path)
    sim.run(40)
    table = contact_table(sim)
    with h5py.File(frames(tmp_path, "contacts")[-1].path) as file:
        cells = {name: dataset[()] for name, dataset in file["VTKHDF/CellData"].items()}
        points = file["VTKHDF/Points"][()].reshape(-1, 2, 3)
    for name in ("first", "second", "overlap", "force"):
        assert np.array_equal(cells[name], table[name])
    size = np.sqrt((table["force"] ** 2).sum(axis=1))
    assert (np.abs(cells["normal_force"]) <= size * (1 + 1e-14)).all() and (cells["normal_force"] < 0.999 * size).any()
    radius = sim.grains.sorted_by_id("radius")
    reach = radius[cells["first"]] + np.where(cells["second"] < 0, 0.0, radius[cells["second"]])
    length = np.sqrt(((points[:, 1] - points[:, 0]) ** 2).sum(axis=1))
    assert length == pytest.approx(reach - cells["overlap"], rel=1e-12)


def test_the_series_lists_what_is_there(tmp_path):
    sim = pile(tmp_path)
    sim.run(25)
    (tmp_path / "grains_000000000010.vtkhdf").unlink()
    sim.run(10)
    series = json.loads((tmp_path / "grains.vtkhdf.series").read_text())
    assert series["file-series-version"] == "1.0"
    assert series["files"] == [{"name": f.path.name, "time": f.time} for f in frames(tmp_path, "grains")]
    assert [f.step for f in frames(tmp_path, "grains")] == [20, 30]


def test_a_damaged_frame_of_before_is_left_out_of_the_series_with_a_warning(tmp_path):
    pile(tmp_path).run(20)
    (tmp_path / "grains_000000000010.vtkhdf").write_bytes(b"cut")
    sim = pile(tmp_path)
    sim.step_number = 30
    with pytest.warns(UserWarning, match=r"grains_000000000010\.vtkhdf cannot be read.*left out of the series"):
        sim.run(10)
    series = json.loads((tmp_path / "grains.vtkhdf.series").read_text())
    assert [entry["name"] for entry in series["files"]] == ["grains_000000000020.vtkhdf", "grains_000000000040.vtkhdf"]


def rewrite(path, name, values):
    """Put other values into a frame, whose checksum is then right again."""
    with h5py.File(path, "r+") as file:
        del file["VTKHDF"][name]
        if values is not None:
            file["VTKHDF"][name] = values
    seal(path)


def test_what_is_no_frame_is_refused(tmp_path):
    sim = pile(tmp_path)
    sim.run(10)
    good = tmp_path / "grains_000000000010.vtkhdf"
    with pytest.raises(ResultError, match="no such file"):
        read_grain_frame(tmp_path / "nothing.vtkhdf")
    with pytest.raises(ResultError, match="was not written by GrainFrames"):
        read_grain_frame(tmp_path / "contacts_000000000010.vtkhdf")
    rewrite(good, "PointData/radius", np.ones(39))
    with pytest.raises(ResultError, match="40 grains, but not as many of radius"):
        read_grain_frame(good)
    rewrite(good, "FieldData/step", None)
    with pytest.raises(ResultError, match="does not tell its step and time"):
        frames(tmp_path, "grains")
    rewrite(good, "Points", np.array([b"text"]))
    with pytest.raises(ResultError, match="something else than numbers"):
        read_polydata(good)
    for data in (b"", b"hello", bytes(5000)):
        good.write_bytes(data)
        with pytest.raises(ResultError, match=good.name):
            read_grain_frame(good)
    with h5py.File(good, "w") as file:
        file["VTKHDF/Points"] = np.zeros((3, 3))
    with pytest.raises(ResultError, match="no frame of barchan"):
        read_grain_frame(good)


@settings(max_examples=150)
@given(where=st.floats(0.0, 0.9999), mask=st.integers(0, 255))
def test_a_cut_or_altered_frame_is_refused(where, mask, tmp_path_factory):
    """Whichever byte: mask 0 cuts the file there, any other alters the byte."""
    folder = tmp_path_factory.getbasetemp() / "frames"
    if not folder.exists():
        pile(folder).run(10)
    data = bytearray((folder / "grains_000000000010.vtkhdf").read_bytes())
    place = int(where * len(data))
    data[place] ^= mask
    altered = folder / "altered.vtkhdf"
    altered.write_bytes(bytes(data) if mask else bytes(data[:place]))
    with pytest.raises(ResultError, match=r"altered\.vtkhdf cannot be read \(it"):
        read_grain_frame(altered)


def test_a_state_without_forces_is_not_written(tmp_path):
    for writer in writers(tmp_path)[:3]:
        with pytest.raises(SceneError, match=r"call Simulation.prepare\(\) first"):
            writer.write(pile())
    assert not contents(tmp_path)
    sim = pile()
    sim.prepare()
    for writer in writers(tmp_path):
        writer.write(sim)
    assert read_grain_frame(frames(tmp_path, "grains")[0].path).step == 0


# -- the dump --------------------------------------------------------------------------------------------------------


def test_a_dump_of_a_sheared_box_has_its_tilts(tmp_path):
    """As LAMMPS writes them: the bounds of the parallelepiped, then xy xz yz."""
    soft = bc.Material("soft", density=1.0, kn=1.0, kt=1.0, friction=0.0)
    sim = bc.Simulation(bc.Box((0, 0, 0), (4, 2, 3), (True,) * 3), bc.laws.linear, soft, 1e-3)
    sim.add_grains([(1.0, 1.0, 1.0)], 0.1)
    sim.deformation = bc.Deformation(xz=-0.5)
    sim.writers.append(bc.writers.LammpsDump(tmp_path, bc.Every(500)))
    sim.run(500)
    head = (tmp_path / "grains_000000000500.dump").read_text().partition("ITEM: BOX BOUNDS ")[2].splitlines()
    assert head[0] == "xy xz yz pp pp pp"
    bounds = np.array([line.split() for line in head[1:4]], dtype=np.float64)
    np.testing.assert_allclose(bounds, [[-0.75, 4.0, 0.0], [0.0, 2.0, -0.75], [0.0, 3.0, 0.0]], atol=1e-12)


def test_a_dump_has_the_numbers_of_the_frame(tmp_path):
    """To the last bit; atoms and types count from 1. Other programs read it in ``tests/peers/test_read_back.py``."""
    sim = pile(tmp_path)
    sim.run(10)
    head, _, body = (tmp_path / "grains_000000000010.dump").read_text().partition("ITEM: ATOMS ")
    assert head.split("\n")[:5] == ["ITEM: TIME", repr(sim.time), "ITEM: TIMESTEP", "10", "ITEM: NUMBER OF ATOMS"]
    assert head.endswith("40\nITEM: BOX BOUNDS pp pp ff\n0.0 6.0\n0.0 6.0\n0.0 6.0\n")
    names, *lines = body.splitlines()
    values = dict(zip(names.split(), np.array([line.split() for line in lines], dtype=np.float64).T))
    fields = read_grain_frame(tmp_path / "grains_000000000010.vtkhdf").fields
    assert np.array_equal(values["id"], fields["id"] + 1) and (values["type"] == 1).all()
    for name, axes in {"position": "x y z", "velocity": "vx vy vz", "omega": "omegax omegay omegaz", "force": "fx fy fz"}.items():
        assert np.array_equal(np.stack([values[axis] for axis in axes.split()], axis=1), fields[name])
    assert np.array_equal(values["radius"], fields["radius"]) and np.array_equal(values["mass"], fields["mass"])


# -- whole or not there ----------------------------------------------------------------------------------------------


def test_a_full_disk_stops_every_writer_and_leaves_no_part(tmp_path):
    done = run_apart("full", tmp_path)
    assert done.returncode == 0, done.stderr
    outcome = json.loads(done.stdout)
    assert len(outcome["heard"]) == 6
    for name, error, message, untouched in outcome["heard"]:
        assert error == "OutputError", name
        assert "cannot be written: File too large" in message and untouched, name
    assert outcome["new"] == [
        "checkpoints/checkpoint_000000000011.h5",
        "contacts_000000000011.vtkhdf",
        "grains_000000000011.dump",
        "grains_000000000011.vtkhdf",
    ], "once there is room again, they write"


@pytest.mark.parametrize(("number", "cut"), [(10, ".grains_000000000020.vtkhdf."), (11, ".grains.vtkhdf.series.")])
def test_a_kill_in_mid_write_never_loses_the_series(number, cut, tmp_path):
    """Killed when the second frame of grains is filled, or its series, and before that is renamed."""
    done = run_apart("kill", tmp_path, number)
    assert done.returncode == -9, done.stderr
    (unfinished,) = tmp_path.glob(".*.partial")
    assert unfinished.name.startswith(cut)
    for kind in ("grains", "contacts"):
        listed = json.loads((tmp_path / f"{kind}.vtkhdf.series").read_text())["files"]
        assert listed, "the series is whole"
        whole = [{"name": frame.path.name, "time": frame.time} for frame in frames(tmp_path, kind)]
        assert listed == whole[: len(listed)] and len(listed) >= len(whole) - 1


def test_a_directory_that_cannot_be_written_is_named_on_all_ranks(tmp_path):
    (tmp_path / "file").write_text("")

    def program(number):
        sim = pile()
        sim.prepare()
        try:
            writers(tmp_path / "file")[number].write(sim)
        except BarchanError as error:
            return type(error), str(error)

    for number in range(5):
        (first, text), *others = virtual_ranks(3, program, number)
        assert first is OutputError and str(tmp_path) in text and "is a file, not a directory" in text
        assert all(kind is RankError and f"{tmp_path}/file" in quoted and "rank 0" in quoted for kind, quoted in others)


def test_a_table_refuses_rows_of_one_rank(tmp_path):
    """Where a script was written for one process, and counts the grains of each."""

    def program():
        sim = pile()
        sim.writers = [bc.writers.Table(tmp_path / "time.csv", bc.Every(1), lambda sim: {"highest id": int(sim.grains.id.max())})]
        with pytest.raises(
            OutputError, match=r"the ranks gave different rows, here \[\{'highest id': \d+\}\]; give sums over all ranks"
        ):
            sim.run(1)
        sim.writers = [bc.writers.Table(tmp_path / "time.csv", bc.Every(1), lambda sim: {"grains": sim.n_grains})]
        sim.run(1)
        return sim.n_grains

    assert len(set(virtual_ranks(2, program))) == 1


def test_an_atomic_write_that_fails_leaves_the_older_file(tmp_path, monkeypatch):
    """Whatever fails: the block, the disk when it is flushed, the rename."""
    path = tmp_path / "f"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), writing(path) as partial:
        partial.write_text("new")
        _ = 1 / 0

    def refuse(*arguments):
        raise OSError(28, "No space left on device")

    for name in ("os.fsync", "os.replace"):
        with monkeypatch.context() as patch:
            patch.setattr(name, refuse)
            with pytest.raises(OSError, match="No space"), writing(path) as partial:
                partial.write_text("new")
    assert contents(tmp_path) == {"f": b"old"}
    with writing(path) as partial:
        partial.write_text("new")
        assert path.read_text() == "old"
    assert contents(tmp_path) == {"f": b"new"}


# -- the same files --------------------------------------------------------------------------------------------------


def test_a_run_that_was_killed_and_resumed_leaves_the_files_of_one_that_never_stopped(tmp_path):
    """Killed at step 76, its checkpoint was at 33, and it ends at 60: rows and frames of the lost future go."""
    steady, broken = tmp_path / "steady", tmp_path / "broken"
    pile(steady).run(60)
    sim = pile(broken)
    sim.run(33)
    save(sim, tmp_path / "c.h5")
    sim.run(43)
    with open(broken / "means.csv", "a") as file:
        file.write("76,0.0")
    assert len(frames(broken, "grains")) == 7
    again = pile(broken, count=0)
    restore(again, tmp_path / "c.h5")
    again.run(27)
    assert contents(broken) == contents(steady)
    assert len(contents(steady)) == 3 * 6 + 2 + 2


def test_three_ranks_write_the_bytes_of_one(tmp_path):
    def program(directory):
        sim = pile(directory)
        sim.run(40)
        return len(sim.grains)

    program(tmp_path / "one")
    owned = virtual_ranks(3, program, tmp_path / "three")
    assert sum(owned) == 40 and min(owned) > 0
    one = contents(tmp_path / "one")
    assert one == contents(tmp_path / "three") and len(one) == 3 * 4 + 2 + 2


def test_writers_change_nothing(tmp_path):
    written_to, plain = pile(tmp_path), pile()
    written_to.run(40)
    plain.run(40)
    for field in plain.grains.table:
        assert written_to.grains.sorted_by_id(field.name).tobytes() == plain.grains.sorted_by_id(field.name).tobytes()
