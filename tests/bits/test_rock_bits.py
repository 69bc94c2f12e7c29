"""The tests of a rock leave the same files on any number of threads and ranks, and when stopped and resumed while it cracks."""

import pytest
from staged import files, run

from barchan.experiments.rock import ROCK
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: A few large grains, loaded fast.
SCENE = {
    "grains": 160,
    "dt": "0.18 us",
    "compression_rate": 24.0,
    "tension_rate": 4.0,
    "brazilian_rate": 24.0,
    "duration": "0.3 ms",
    "table_every": "9 us",
    "frame_every": "90 us",
}


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(ROCK, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(("threads", "ranks", "stop"), [(2, 1, None), (1, 3, None), (1, 1, 911)])
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    """Stopped between two rows of the table of cracks."""
    virtual_ranks(ranks, run, ROCK, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    cracks = read_table(tmp_path / "tables" / "cracks.csv")
    steps, tests = cracks["crack step"], cracks["test"]
    assert (steps < 911).sum() > 50 and (steps > 911).sum() > 50 and set(tests) == {0.0, 1.0, 2.0}, "it cracks before and after"
