"""The avalanche with all its instruments leaves the same files on any number of threads and ranks, outlets and all."""

import pytest

from barchan.experiments.avalanche import Avalanche, build, instruments, stages
from barchan.parallel import virtual_ranks

#: A short floor without an end wall, so that grains leave through the outlet at its end; longer than high, so that the ranks
#: cut the flow across; in a strong gravity, so that it takes few steps.
SCENE = {
    "coarse_graining": 6,
    "length": "120 mm",
    "height": "36 mm",
    "floor": "160 mm",
    "end_wall": "0 mm",
    "gravity": "80 m/s^2",
    "equilibrate": "10 ms",
    "duration": "130 ms",
    "table_every": "5 ms",
    "frame_every": "25 ms",
}


def run(directory, threads):
    """What left through outlets, and how many grains flow on this rank at the end; the instruments write into ``directory``."""
    scene = Avalanche.make(SCENE)
    sim = build(scene, threads=threads)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return sim.notes["outlets"], int((sim.grains.view("frozen") == 0).sum())


def files(directory):
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    return run(out, 1), files(out)


@pytest.mark.parametrize(("threads", "ranks"), [(2, 1), (1, 3)])
def test_threads_and_ranks_change_no_byte(alone, tmp_path, threads, ranks):
    (left, staying), there = alone
    assert left["over the end wall"]["grains"] > 5
    everywhere, shares = zip(*virtual_ranks(ranks, run, tmp_path, threads))
    assert everywhere == (left,) * ranks
    assert sum(shares) == staying and min(shares) > 0.05 * staying, "all ranks have a part in it"
    assert files(tmp_path) == there
