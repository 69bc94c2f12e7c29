"""As many grains as fit: ``mpiexec -n 2 python tests/reference/capacity.py GRAINS STEPS CHECKPOINT``.

Runs a settled bed, shares it anew on the way, writes a checkpoint and reads it back, and prints what it took as JSON.
"""

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np

from barchan.bench.bed import bed, simulation, without_grains
from barchan.checkpoint import restore, save
from barchan.parallel import world
from barchan.parallel.guard import on_first_rank
from barchan.report import Journal

SAVED = ("position", "velocity", "omega", "radius")


def main(grains, steps, path):
    comm, watch = world(), Watch()
    made = on_first_rank(comm, lambda: bed(grains, Journal()))
    told, before = run(made, steps, watch)
    save_and_drop(told.pop("sim"), path, watch)
    again = without_grains(made, 1, comm)
    restore(again, path)
    watch.lap("reading")
    told |= {
        "read_back": before == fingerprint(again) and again.step_number == steps,
        "checkpoint_bytes": Path(path).stat().st_size,
        "peak_bytes": watch.peaks,
        "peak_bytes_a_grain": {name: round(peak / made.count) for name, peak in watch.peaks.items()},
        "seconds": watch.seconds,
        "seconds_a_step": watch.seconds["steps"] / steps,
    }
    if comm.rank == 0:
        print(json.dumps(told, indent=1))


class Watch:
    """Seconds by name, and the largest memory of all ranks together until then [bytes]."""

    def __init__(self):
        self.seconds, self.peaks, self._since = {}, {}, time.perf_counter()

    def lap(self, name):
        now = time.perf_counter()
        self.seconds[name], self._since = now - self._since, now
        self.peaks[name] = int(world().sum([resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024])[0])


def run(made, steps, watch):
    """The bed after so many steps, with what is to be told of it; and the fingerprint of its state."""
    sim = simulation(made, 1, world())
    sim.skin = 0.05 * 2.0 * float(made.grains.radius.max())
    sim.prepare()
    watch.lap("set-up")
    balance, shared = sim.balance, sim.balance.count
    balance.when = lambda step: balance.count == shared  # once more, in the next rebuild
    sim.run(steps)
    watch.lap("steps")
    touching, ghosts = sim.comm.sum([sim.touching, sim.grains.n_ghost]).tolist()
    told = {
        "ranks": sim.comm.size,
        "grains": made.count,
        "steps": steps,
        "rebuilds": sim.staleness.rebuilds,
        "shared_anew": balance.count - shared,
        "coordination": 2.0 * touching / made.count,
        "ghosts_per_grain": ghosts / made.count,
        "sim": sim,
    }
    return told, fingerprint(sim)


def save_and_drop(sim, path, watch):
    """Write the checkpoint; afterwards nobody holds the state."""
    save(sim, path)
    watch.lap("saving")


def fingerprint(sim):
    """A number for the state of all grains, whichever rank has them: products of their bits and of odd numbers of their ids."""
    total = np.zeros(len(SAVED), dtype=np.int64)
    odd = 2 * sim.grains.view("id") + 1
    for k, name in enumerate(SAVED):
        words = np.ascontiguousarray(sim.grains.view(name)).view(np.int64).reshape(len(odd), sim.grains.field(name).width)
        for column in range(words.shape[1]):
            total[k : k + 1] += (words[:, column] * (odd + 2 * column)).sum()
    return sim.comm.sum(total).tolist()


if __name__ == "__main__":
    main(int(float(sys.argv[1])), int(sys.argv[2]), sys.argv[3])
