"""A compression test leaves the same files on any number of threads and ranks, and when it was stopped and resumed."""

import pytest
from staged import files, run

from barchan.experiments.compression import COMPRESSION
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: A few grains in a strong gravity, loaded fast, so that it takes few steps.
SCENE = {
    "grains": 250,
    "width": "9 mm",
    "height": "8 mm",
    "gravity": 400.0,
    "rain": "16 ms",
    "seat": "9 ms",
    "stress_rate": "25 MPa/s",
    "hold": "0.5 ms",
    "shear_modulus": "15 MPa",
    "dt": "3.6 us",
    "table_every": "0.25 ms",
    "frame_every": "2 ms",
}


THREE_RANKS = pytest.param(1, 3, None, marks=pytest.mark.validate)
TWO_RANKS_AND_A_STOP = pytest.param(1, 2, 5_900, marks=pytest.mark.validate)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(COMPRESSION, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(("threads", "ranks", "stop"), [(2, 1, None), THREE_RANKS, TWO_RANKS_AND_A_STOP, (1, 1, 7_503)])
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    """Stopped while the walls are loaded, between two looks of the servo, and while they are seated."""
    virtual_ranks(ranks, run, COMPRESSION, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    assert read_table(tmp_path / "tables" / "load.csv")["mean stress [Pa]"].max() > 50e3, "it is loaded"
