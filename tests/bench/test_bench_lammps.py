"""barchan and LAMMPS driven through a whole benchmark: the same work, in every kind of case."""

import io
import json
import subprocess
import sys
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from barchan.bench import cases, comparison, peers, results
from barchan.bench.case import Grains
from barchan.bench.peers import lammps
from barchan.report import Journal


def found(*names):
    return [peer for peer in peers.find(1, 2) if peer.name in names]


def rows_of(case, names):
    entries, _ = comparison.compare(case, found(*names), Journal(stream=io.StringIO()))
    return {entry.peer.name: results.row(entry, entries[0], case) for entry in entries}


def short(case, steps=100):
    return case._replace(steps=steps, scan_steps=20, rounds=2, skins=(0.1, 0.2))


def bed(journal):
    """A part of the dense flow above its floor, some of it frozen: fewer grains, the same law."""
    case = cases.dense(journal)
    grains = case.grains.take((case.grains.position[:, :2] < 8.0).all(axis=1))
    frozen = (grains.position[:, 0] < 2.0) & (grains.position[:, 2] < 3.0)
    velocity, omega = (np.where(frozen[:, None], 0.0, column) for column in (grains.velocity, grains.omega))
    grains = grains._replace(velocity=velocity, omega=omega, frozen=frozen)
    return case._replace(grains=grains, high=(9.1, 9.1, 60.0))


@pytest.mark.parametrize("make", [bed, lambda journal: cases.gas(journal, count=2000)], ids=["bed", "gas"])
def test_both_do_the_same_work(make):
    """Hooke and Hertz, frozen grains, a floor, gravity and none."""
    rows = rows_of(short(make(None)), ("barchan-1", "lammps-1"))
    for row in rows.values():
        assert "reason" not in row, row
        assert row["same_work"] and row["rebuilds"] >= 5 and row["ratio_median"] > 0.0
        assert row["memory_per_grain"] is not None
    ours, theirs = rows["barchan-1"], rows["lammps-1"]
    assert theirs["kinetic_energy"] == pytest.approx(ours["kinetic_energy"], rel=1e-5)
    assert "LAMMPS 20" in theirs["version"]


def test_other_physics_is_seen():
    """A LAMMPS without its tangential spring does not do the same work: the check can fail."""
    case = short(bed(None))
    entries = [comparison.Entry(peer) for peer in found("barchan-1", "lammps-1")]
    wrong = case._replace(constants=case.constants._replace(kt=1e-3))
    for entry, told in zip(entries, (case, wrong)):
        run_alone(entry, told)
    assert not entries[1].does_the_work_of(entries[0])


def run_alone(entry, case):
    with TemporaryDirectory() as folder:
        case.save(folder)
        with comparison.Code(entry.peer, folder) as entry.code:
            entry.skin = 0.1
            entry.begin(case)


def test_two_ranks_and_openmp_run_and_a_rebuild_is_forced():
    """The number of rebuilds is checked in ``Entry.time``."""
    case = bed(None)._replace(steps=5, scan_steps=5, rounds=2, skins=(0.1,), forced=True)
    rows = rows_of(case, ("barchan-1", "lammps-2", "lammps-omp"))
    assert set(rows) == {"barchan-1", "lammps-2", "lammps-omp"}
    assert all(row.get("same_work") and row["rebuilds"] == 5 for row in rows.values()), rows


def test_codes_that_are_told_size_classes_try_all_and_do_the_same_work():
    """LAMMPS with each size of cells, barchan in a grid for each class and in one for all."""
    rng, sites = np.random.default_rng(1), np.stack(np.unravel_index(np.arange(27 * 64), (12, 12, 12)), axis=1)
    large = np.all(sites % 6 == 2, axis=1)  # in the place of their neighbours, too
    near = (np.abs(sites[:, None] - sites[large]) <= 1).all(axis=2).any(axis=1)
    position = 1.005 * (sites + 0.5)[~near | large] + rng.uniform(-0.03, 0.03, (np.sum(~near | large), 3))
    radius = np.where(large[~near | large], 1.5, 0.5)
    still = np.zeros(position.shape)
    velocity = rng.normal(scale=1.0, size=position.shape)
    grains = Grains(position, radius, np.ones(len(radius)), velocity, still, radius < 0.0)
    case = cases.gas(None, count=8)._replace(grains=grains, high=(12.06,) * 3, steps=3, scan_steps=2, rounds=2, skins=(0.03,))
    case = case._replace(forced=True, ends=((0.7,), (1.0,)), cells=(0.5, 1.0))
    wanted = [
        peer for peer in peers.find(1, 1, wide=radius) if peer.name in ("barchan-1", "barchan-told", "barchan-multi", "lammps-1")
    ]
    entries, _ = comparison.compare(case, wanted, Journal(stream=io.StringIO()))
    rows = {entry.peer.name: results.row(entry, entries[0], case) for entry in entries}
    assert all(row.get("same_work") for row in rows.values()), rows
    assert rows["barchan-1"]["contacts_per_grain"] > 0.01
    assert "divisions" not in rows["barchan-1"] and len(rows["barchan-told"]["divisions"]) == 2
    assert len(rows["lammps-1"]["divisions"]) == len(rows["barchan-multi"]["divisions"]) == 4
    assert rows["lammps-1"]["divisions"][0].keys() == {"ends", "cells", "seconds"}
    assert [(one["ends"], one["cells"]) for one in rows["lammps-1"]["divisions"]][:2] == [((0.7,), 0.5), ((0.7,), 1.0)]


def test_peers_that_are_not_there_say_so(monkeypatch):
    monkeypatch.setattr(lammps.importlib.util, "find_spec", lambda name: None)
    for peer in lammps.find(1, 2):
        assert "pip install 'barchan[test]'" in peer.missing
    names = [peer.name for peer in peers.find(1, 2)]
    assert names == ["barchan-1", "barchan-mpi-2", "lammps-1", "lammps-2", "lammps-omp", "liggghts", "yade", "esysparticle"]
    assert [peer.name for peer in peers.find(2, 1)][:4] == ["barchan-2", "barchan-1", "lammps-1", "lammps-omp"]
    assert all(peer.command or peer.missing for peer in peers.find(1, 2))
    wide = [peer.name for peer in peers.find(1, 2, wide=np.array([1.0, 10.0]))]
    assert wide == ["barchan-1", "barchan-mpi-2", "barchan-told", "barchan-multi", "lammps-1", "lammps-2"]


def test_more_ranks_than_cores_would_spin(monkeypatch):
    assert "core(s)" in {peer.name: peer.missing for peer in lammps.find(1, 4096)}["lammps-4096"]


def test_the_command_refuses_bad_input_in_one_line(tmp_path):
    for arguments, word in (
        (("dens",), "did you mean 'dense'?"),
        (("small", "--threads", "4096"), "--threads = 4096"),
        (("size-classes",), "--case goes with size-classes"),
        (("small", "--case", "dunkirk-20"), "--case goes with size-classes"),
        (("size-classes", "--case", "dunkirk-2O"), "did you mean 'dunkirk-20'?"),
    ):
        command = [sys.executable, "-m", "barchan", "bench", *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 2 and word in done.stderr and "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_data_file_keeps_all_bits(tmp_path):
    case = cases.small(None)
    lammps.write_data(tmp_path / "x", case.low, case.high, *case.grains[:5])
    rows = [line.split() for line in (tmp_path / "x").read_text().splitlines() if len(line.split()) == 7]
    _, _, diameter, density, *position = np.array(rows, dtype=float)[:100].T
    assert np.array_equal(np.stack(position, axis=1), case.grains.position)
    assert np.array_equal(diameter, 2.0 * case.grains.radius) and np.array_equal(density, case.grains.density)


@pytest.mark.validate
def test_the_dense_flow_is_faster_than_with_lammps(tmp_path):
    """The whole command at full size: barchan on one thread beats every LAMMPS on one core, at the same work."""
    path = tmp_path / "dense.json"
    subprocess.run([sys.executable, "-m", "barchan", "bench", "dense", "--json", str(path)], check=True)
    rows = {row["peer"]: row for row in json.loads(path.read_text())["rows"]}
    assert rows["lammps-1"]["ratio_median"] >= 1.5 and rows["lammps-omp"]["ratio_median"] >= 1.5
    assert all(row["same_work"] for row in rows.values() if "reason" not in row)
    assert path.with_suffix(".png").exists()
