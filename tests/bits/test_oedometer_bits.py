"""An oedometer test leaves the same files on any number of threads and ranks, and when it was stopped and resumed."""

import pytest
from staged import files, run

from barchan.experiments.oedometer import OEDOMETER
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: A few grains that fall and are loaded fast, with friction on the walls.
SCENE = {
    "grains": 250,
    "width": "12 mm",
    "height": "7.5 mm",
    "wall_friction": 0.2,
    "gravity": 60.0,
    "rain": "30 ms",
    "seat": "12 ms",
    "stress_rate": "40 MPa/s",
    "max_stress": "100 kPa",
    "hold": "0.5 ms",
    "rest": "0.5 ms",
    "table_every": "0.25 ms",
    "frame_every": "4 ms",
}


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(OEDOMETER, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"), [(2, 1, None), pytest.param(1, 3, None, marks=pytest.mark.validate), (1, 1, 22_805)]
)
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    """Stopped while the sample is unloaded, between two looks of the servo."""
    virtual_ranks(ranks, run, OEDOMETER, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    assert (tmp_path / "stop.h5").exists() is (stop is not None)
    assert read_table(tmp_path / "tables" / "load.csv")["stress top [Pa]"].max() > 50e3, "it is loaded"
