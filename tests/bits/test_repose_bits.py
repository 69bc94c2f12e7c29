"""The pile with all its instruments leaves the same files on any number of threads and ranks, lifted walls and all."""

import pytest

from barchan.experiments.repose import Repose, build, instruments, stages
from barchan.parallel import virtual_ranks

#: Few grains on a smooth floor, so small that some leave over its edge; in a strong gravity, so that it takes few steps.
SCENE = {
    "grains": 150,
    "cylinder_radius": "18 mm",
    "length": "25 mm",
    "width": "40 mm",
    "floor": "45 mm",
    "rough_floor": False,
    "gravity": "60 m/s^2",
    "lift_speed": "0.8 m/s",
    "equilibrate": "20 ms",
    "duration": "70 ms",
    "table_every": "5 ms",
    "frame_every": "20 ms",
}


def run(directory, method, threads):
    """What left over the edge, and how many grains are on this rank at the end; the instruments write into ``directory``."""
    scene = Repose.make(SCENE | {"method": method})
    sim = build(scene, threads=threads)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return sim.notes["outlets"], sim.grains.n


def files(directory):
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


@pytest.mark.parametrize("method", ["cylinder", pytest.param("plate", marks=pytest.mark.validate)])
def test_threads_and_ranks_change_no_byte(tmp_path, method):
    left, staying = run(tmp_path / "alone", method, 1)
    assert sum(outlet["grains"] for outlet in left.values()) > 5
    there = files(tmp_path / "alone")
    assert len(there) > 8
    for threads, ranks in ((2, 1), (1, 3)):
        out = tmp_path / f"{ranks}"
        everywhere, shares = zip(*virtual_ranks(ranks, run, out, method, threads))
        assert everywhere == (left,) * ranks
        assert sum(shares) == staying and min(shares) > 0.05 * staying, "all ranks have a part in it"
        assert files(out) == there
