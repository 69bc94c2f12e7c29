"""A drum with all its instruments leaves the same files on any number of threads and ranks, and stopped while it turns."""

import pytest
from staged import files, run

from barchan.experiments.drum import DRUM, observe
from barchan.parallel import virtual_ranks

#: Few grains, for a short time.
SCENE = {
    "grains": 60,
    "drum_radius": "25 mm",
    "length": "20 mm",
    "radius_min": "2.6 mm",
    "dt": "40 us",
    "rotation": 6.0,
    "equilibrate": "20 ms",
    "develop": "20 ms",
    "duration": "60 ms",
    "table_every": "5 ms",
    "frame_every": "20 ms",
}

#: While it turns, before and within the steps whose energy is accounted for.
BEFORE, WITHIN = 1013, 1901


@pytest.fixture(scope="module", autouse=True)
def few_steps():
    """Energy is accounted for in few steps: each takes as long as many."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(observe, "ACCOUNT_STEPS", 200)
        yield


@pytest.fixture(scope="module", params=["plates", "periodic"])
def alone(request, tmp_path_factory):
    """The scene, and the files that one thread leaves."""
    out, scene = tmp_path_factory.mktemp("alone"), SCENE | {"ends": request.param}
    run(DRUM, scene, out, 1)
    return scene, files(out)


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"),
    [(2, 1, None), pytest.param(1, 3, None, marks=pytest.mark.validate), (1, 1, BEFORE), (1, 1, WITHIN)],
)
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    scene, left = alone
    virtual_ranks(ranks, run, DRUM, scene, tmp_path, threads, stop)
    assert files(tmp_path) == left
    assert {"tables/time.csv", "tables/profiles.csv", "tables/layer.csv", "tables/energy.csv", "end.h5"} <= set(left)
