"""Simple shear with all its instruments leaves the same files on any number of threads and ranks, and after a stop."""

import pytest
from staged import files, run

from barchan.experiments.shear import SHEAR
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: Few grains, fast, so that it takes few steps; the second stage is half as fast.
SCENE = {"grains": 160, "inertial_number": 1.0, "rates": 2, "start": 1.0, "settle": 0.1, "strain": 0.25, "dt": "3.5 us"}

#: While the energy of the first stage is taken, between two looks of the servo.
STOP = 533


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(SHEAR, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"), [(2, 1, None), pytest.param(1, 3, None, marks=pytest.mark.validate), (1, 1, STOP)]
)
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    virtual_ranks(ranks, run, SHEAR, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    scene = SHEAR.scene.make(SCENE)
    assert scene.begins[0] < STOP < scene.ends[0]
    assert read_table(tmp_path / "tables" / "time.csv")["coordination"][-1] > 0.5
