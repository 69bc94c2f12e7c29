"""The avalanche with all its instruments leaves the same files on any number of threads and ranks, outlets and all."""

import pytest

from barchan.experiments.avalanche import Avalanche, build, instruments, stages
from barchan.parallel import virtual_ranks

#: A short floor with a low end wall, so that grains leave through the outlet behind it.
SCENE = {
    "coarse_graining": 8,
    "length": "80 mm",
    "height": "80 mm",
    "floor": "160 mm",
    "end_wall": "10 mm",
    "equilibrate": "20 ms",
    "duration": "250 ms",
    "table_every": "10 ms",
    "frame_every": "50 ms",
}


def run(directory, threads):
    """All files that the instruments wrote, by name, and what left through outlets."""
    scene = Avalanche.make(SCENE)
    sim = build(scene, threads=threads)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return sim.notes["outlets"]


def files(directory):
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    return run(out, 1), files(out)


@pytest.mark.parametrize(("threads", "ranks"), [(2, 1), (1, 3)])
def test_threads_and_ranks_change_no_byte(alone, tmp_path, threads, ranks):
    left, there = alone
    assert left["over the end wall"]["grains"] > 5
    assert virtual_ranks(ranks, run, tmp_path, threads) == [left] * ranks
    assert files(tmp_path) == there
