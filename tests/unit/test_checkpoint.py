"""Checkpoints: complete, checked, and refused when they are damaged or of another scene."""

import warnings

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import fingerprint, pile

import barchan as bc
from barchan import checkpoint
from barchan.checkpoint import Checkpoints, all_checkpoints, collect, newest_sound, read_state, restore, save
from barchan.errors import CheckpointError, OutputError, RankError
from barchan.parallel import virtual_ranks

GLASS = dict(density=2500.0, youngs_modulus=1e7, poisson_ratio=0.25, friction=0.5)


def scene(law=bc.laws.hertz_mindlin, gravity=(0.0, 0.0, -9.81), **changed):
    sim = bc.Simulation(bc.Box((0, 0, 0), (1, 1, 1)), law, bc.Material("glass", **GLASS | changed), dt=1e-5, gravity=gravity)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    return sim


def filled(**options):
    sim = scene(**options)
    sim.add_grains([(0.5, 0.5, 0.0999), (0.5, 0.65, 0.0999), (0.5, 0.6, 0.28)], 0.1, velocity=(0.1, 0.0, -0.1))
    sim.max_overlap = 0.5
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(20)
    return sim


def test_it_holds_all_that_the_next_step_reads(tmp_path):
    """The fields that DESIGN promises, contacts with grains and walls, walls, box, counters and hashes."""
    sim = filled()
    save(sim, tmp_path / "c.h5")
    state = read_state(tmp_path / "c.h5")
    needed = {
        "id",
        "position",
        "velocity",
        "omega",
        "force",
        "torque",
        "radius",
        "mass",
        "inertia",
        "material",
        "frozen",
        "image",
    }
    assert needed <= set(state.fields)
    for name in needed:
        assert np.array_equal(state.fields[name], sim.grains.sorted_by_id(name))
    assert (state.contacts.keys < 0).any() and (state.contacts.keys >= 0).any(), "contacts with the wall and with grains"
    assert {"step", "time", "dt", "next_id", "law", "gravity", "walls", "box", "materials"} <= set(state.about)
    assert state.about["step"] == 20 and state.about["walls"][0]["kind"] == "plane"


@pytest.mark.parametrize("cut", [0, 1, 100, 0.5, 0.999])
def test_a_cut_file_is_refused_and_the_one_before_is_used(cut, tmp_path):
    sim = filled()
    writer = Checkpoints(tmp_path, bc.Every(5))
    sim.writers = [writer]
    sim.run(10)
    older, newest = all_checkpoints(tmp_path)
    data = newest.read_bytes()
    newest.write_bytes(data[: int(cut * len(data)) if isinstance(cut, float) else cut])
    with pytest.raises(CheckpointError, match="Use the one before it"):
        read_state(newest)
    found, complaints = newest_sound(tmp_path)
    assert found == older and len(complaints) == 1 and newest.name in complaints[0]


@settings(max_examples=150, deadline=None)
@given(where=st.floats(0.0, 0.9999), mask=st.integers(1, 255))
def test_an_altered_byte_is_refused_or_harmless(where, mask, tmp_path_factory):
    """Every byte of the state is under the checksum; a byte of HDF5's own unused space may change without harm."""
    folder = tmp_path_factory.getbasetemp()
    path, copy = folder / "sound.h5", folder / "altered.h5"
    if not path.exists():
        save(filled(), path)
    data = bytearray(path.read_bytes())
    data[int(where * len(data))] ^= mask
    copy.write_bytes(bytes(data))
    sound = read_state(path)
    try:
        altered = read_state(copy)
    except CheckpointError:
        return
    assert altered.about == sound.about
    for name, values in sound.fields.items():
        assert np.array_equal(altered.fields[name], values)


def test_a_changed_number_is_refused(tmp_path):
    save(filled(), tmp_path / "c.h5")
    with h5py.File(tmp_path / "c.h5", "r+") as file:
        file["grains/velocity"][1, 2] += 1e-12
    with pytest.raises(CheckpointError, match="checksum"):
        read_state(tmp_path / "c.h5")


@pytest.mark.parametrize(
    "other, named",
    [
        (dict(law=bc.laws.hertz_mindlin_standard), "law"),
        (dict(friction=0.4), "materials"),
        (dict(gravity=lambda t: (0.0, 0.0, -t)), "gravity"),
    ],
)
def test_another_scene_is_refused(other, named, tmp_path):
    save(filled(), tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match=named):
        restore(scene(**other), tmp_path / "c.h5")


def test_a_missing_wall_is_refused(tmp_path):
    save(filled(), tmp_path / "c.h5")
    sim = scene()
    sim.walls.clear()
    with pytest.raises(CheckpointError, match="walls"):
        restore(sim, tmp_path / "c.h5")


def test_a_full_disk_leaves_the_older_file(tmp_path, monkeypatch):
    """A failing write names the file and touches neither it nor its neighbours."""
    sim = filled()
    path = tmp_path / "c.h5"
    save(sim, path)
    before = path.read_bytes()

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        save(sim, path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["c.h5"]


def test_what_is_not_a_checkpoint_is_refused(tmp_path):
    for name, data in {"text.h5": b"hello", "empty.h5": b"", "zeros.h5": bytes(4096)}.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(CheckpointError, match=name):
            read_state(tmp_path / name)
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = np.zeros(3)
    with pytest.raises(CheckpointError, match=r"foreign\.h5"):
        read_state(tmp_path / "foreign.h5")
    with pytest.raises(CheckpointError, match="no such file"):
        read_state(tmp_path / "nothing.h5")


def test_restoring_keeps_the_forces_of_the_file(tmp_path):
    """A resumed run never primes: F(n) comes from the file, to the bit."""
    sim = filled()
    save(sim, tmp_path / "c.h5")
    again = scene()
    restore(again, tmp_path / "c.h5")
    again.max_overlap = 0.5
    again.prepare()
    assert np.array_equal(again.grains.sorted_by_id("force"), sim.grains.sorted_by_id("force"))
    assert collect(again).about["step"] == 20


def saved_by(path):
    """The bytes of a checkpoint of all ranks: with a list, and with memory put away."""
    sim = filled()
    save(sim, path)
    listed = path.read_bytes()
    sim.begin_change()
    save(sim, path)
    return listed, path.read_bytes()


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_a_file_written_slab_by_slab_is_the_same(ranks, tmp_path, monkeypatch):
    """Three grains in three slabs, some of which are empty on some ranks."""
    listed, put_away = saved_by(tmp_path / "whole.h5")
    assert listed == put_away
    monkeypatch.setattr(checkpoint, "AT_A_TIME", 1 / ranks)
    for files in virtual_ranks(ranks, saved_by, tmp_path / "slabs.h5"):
        assert files == (listed, listed)


def emptied(path):
    """All grains leave; the scene goes on without any, and so does what is read back."""
    sim = filled()
    sim.remove(np.arange(3))
    sim.run(5)
    save(sim, path)
    again = scene()
    restore(again, path)
    again.run(5)
    return again.step_number, again.grains.n


@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_a_scene_without_grains_goes_on_and_is_read_back(ranks, tmp_path):
    assert virtual_ranks(ranks, emptied, tmp_path / "empty.h5") == [(30, 0)] * ranks


def test_a_value_that_one_rank_finds_is_refused_by_all(tmp_path):
    """Rank 1 reads the grain that is nowhere; then all take the file before."""
    save(filled(), tmp_path / "good.h5")
    bad = filled()
    bad.grains.position[bad.grains.id == 2] = np.nan
    save(bad, tmp_path / "bad.h5")

    def program():
        sim = scene()
        with pytest.raises((CheckpointError, RankError), match="is not inside the box"):
            restore(sim, tmp_path / "bad.h5")
        restore(sim, tmp_path / "good.h5")
        return sim.step_number

    assert virtual_ranks(2, program) == [20, 20]


@pytest.mark.parametrize("friction", [0.05, 5.0])
@pytest.mark.filterwarnings("ignore:step .* overlap by more than")
def test_a_friction_set_between_restore_and_the_first_run_is_that_set_between_two_runs(friction, tmp_path):
    """Forces of the present state are computed anew in both, before the first kick."""
    sim = pile()
    sim.run(60)
    save(sim, tmp_path / "c.h5")
    again = pile()
    restore(again, tmp_path / "c.h5")
    for one in (sim, again):
        one.materials.set_pair("a", "a", friction=friction, kn=900.0)
        one.run(1)
    assert fingerprint(sim) == fingerprint(again)
