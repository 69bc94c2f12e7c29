"""A sample has the same bits on any number of threads and ranks, and when its preparation was stopped and resumed."""

import sys
from contextlib import suppress
from pathlib import Path

import pytest

import barchan as bc
from barchan.checkpoint import Checkpoints, save
from barchan.errors import Interrupted
from barchan.kernels import compiler
from barchan.packing import Preparation, compact, press
from barchan.parallel import virtual_ranks

sys.path.insert(0, str(Path(__file__).parents[1] / "unit"))
from clouds import cloud

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")

WAYS = {
    "brick": lambda sim, how: press(sim, 20.0, how),
    "cylinder": lambda sim, how: compact(sim, 0.55, "walls", how, steps=2000),
    "periodic": lambda sim, how: compact(sim, 0.64, "growth", how, steps=2000),
}


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


class Stop:
    """End the run after a step."""

    def __init__(self, step):
        self.due = bc.At(step)

    def write(self, sim):
        sim.stop_requested = True


def prepared(kind, path, threads=1, stop=None):
    """What is told of the sample, and the state after another 100 steps with the friction of before; stopped on the way after a
    checkpoint."""
    how, directory = Preparation(friction=0.1), path.with_suffix("")
    if stop is not None:
        sim = cloud(kind, threads=threads)
        sim.writers = [Checkpoints(directory, bc.At(stop)), Stop(stop)]
        with suppress(Interrupted):  # in its last step it is over before it looks
            WAYS[kind](sim, how)
        how = how._replace(resume=directory / f"checkpoint_{stop:012d}.h5")
    sim = cloud(kind, threads=threads)
    found = WAYS[kind](sim, how)
    sim.run(100)
    save(sim, path)
    return found


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Kind of room -> what is told of the sample, and the bytes of its checkpoint, on one thread and rank."""
    known, out = {}, tmp_path_factory.mktemp("alone")

    def of(kind):
        if kind not in known:
            known[kind] = prepared(kind, out / f"{kind}.h5"), (out / f"{kind}.h5").read_bytes()
        return known[kind]

    return of


@pytest.mark.parametrize(
    ("threads", "ranks", "stop"), [(2, 1, None), (1, 1, 777), (1, 2, 1020), (1, 1, 2500), (1, 1, "last")], ids=str
)
@pytest.mark.parametrize("kind", WAYS)
def test_threads_ranks_and_a_stop_change_no_bit(kind, threads, ranks, stop, alone, tmp_path):
    """Stopped while walls close in or grains grow, between two looks and at one, and while it comes to rest."""
    expected, state = alone(kind)
    assert expected.steps > 2500 and expected.overlap > 1e-3
    stop = expected.steps if stop == "last" else stop
    found = virtual_ranks(ranks, prepared, kind, tmp_path / "parts.h5", threads, stop)
    assert found == [expected] * ranks
    assert (tmp_path / "parts.h5").read_bytes() == state
