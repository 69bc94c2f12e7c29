"""Packings that LAMMPS wrote, read by barchan: what LAMMPS was given comes back, to the last bit."""

import numpy as np
import pytest
from lammps_peer import HEAD, run_lammps

from barchan.bench.peers.lammps import write_data
from barchan.packing import read_packing

COUNT, LOW, HIGH = 60, (-1.0, 0.0, 0.5), (5.0, 7.0, 11.0)


@pytest.fixture(scope="module")
def given():
    """Position, radius, density, velocity, omega, type of each of some grains."""
    random = np.random.default_rng(8)
    position = random.uniform(np.add(LOW, 0.01), np.subtract(HIGH, 0.01), (COUNT, 3))
    moving = random.normal(size=(2, COUNT, 3))
    return position, random.uniform(0.1, 0.4, COUNT), random.uniform(1.0, 2.0, COUNT), *moving, random.integers(1, 4, COUNT)


@pytest.fixture(scope="module")
def written(given, tmp_path_factory):
    """Folder of the files that LAMMPS wrote after it had read the grains, sorted and changed nothing."""
    folder = tmp_path_factory.mktemp("packing")
    write_data(folder / "ours.data", LOW, HIGH, *given[:5], kind=given[5])
    run_lammps(
        f"{HEAD}boundary p f p\nread_data ours.data\nrun 0 pre no\nwrite_data theirs.data\n"
        f"write_dump all custom theirs.dump id type xu yu zu diameter vx vy vz mass modify format float %.17g sort off\n",
        folder,
    )
    return folder


@pytest.mark.parametrize("name", ["ours.data", "theirs.data", "theirs.dump"])
def test_what_lammps_was_given_comes_back(name, given, written):
    position, radius, _, velocity, _, kind = given
    packing = read_packing(written / name)
    assert np.array_equal(packing.position, position) and np.array_equal(packing.velocity, velocity)
    digits = 1e-15 if name == "theirs.data" else 0.0  # LAMMPS writes diameters with 16 digits there, one less than they have
    assert packing.radius == pytest.approx(radius, rel=digits, abs=0.0) and np.array_equal(packing.material, kind - 1)
    assert packing.box.low.tolist() == list(LOW) and packing.box.high.tolist() == list(HIGH)
    assert packing.box.periodic == ((True, False, True) if name == "theirs.dump" else (False, False, False))
