"""Silos with all their instruments leave the same files on any number of threads and ranks, and stopped while grains leave."""

import pytest
from staged import files, run

from barchan.experiments.silo import SILO
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: Few grains in a strong gravity, so that it takes few steps.
SCENE = {
    "grains": 60,
    "outlets": 2,
    "silo_diameter": "40 mm",
    "outlet_min": "20 mm",
    "outlet_max": "28 mm",
    "gravity": "60 m/s^2",
    "youngs_modulus": "10 MPa",
    "dt": "20 us",
    "equilibrate": "16 ms",
    "slide": "4 ms",
    "duration": "40 ms",
    "table_every": "5 ms",
    "frame_every": "20 ms",
}

#: Between two looks for grains that have left.
STOP = 2033


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(SILO, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"), [(2, 1, None), pytest.param(1, 3, None, marks=pytest.mark.validate), (1, 1, STOP)]
)
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    virtual_ranks(ranks, run, SILO, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    left = read_table(tmp_path / "tables" / "left.csv")["step"]
    assert (left < STOP).sum() > 10 and (left > STOP).sum() > 10, "grains leave before and after the stop"
