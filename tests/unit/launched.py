"""What ``test_mpi_launch`` starts with mpiexec: launched.py WHAT DIRECTORY."""

import os
import signal
import sys
import warnings
from pathlib import Path

import numpy as np
from scenes import pile

import barchan as bc
from barchan import cli
from barchan.checkpoint import Checkpoints, newest_sound, restore
from barchan.parallel import world
from barchan.parallel.guard import on_first_rank


class On:
    """An action or a writer that does something at one step on one rank."""

    def __init__(self, rank, do):
        self.rank, self.do = rank, do

    def due(self, step):
        return step == 25

    def apply(self, sim):
        if world().rank == self.rank:
            self.do(sim)

    write = apply


def stumble(sim):
    raise ZeroDivisionError("a mistake in an action")


def prepared():
    sim = pile(80)
    sim.run(20)
    return sim


def whoever_fails(what):
    """Rank 1 alone fails, or all find out together, in the given phase."""
    rank = world().rank
    if what == "before" and rank == 1:
        raise RuntimeError("a mistake before the first step")
    if what == "drawing":
        signal.signal(signal.SIGINT, cli._interrupted)
        on_first_rank(world(), lambda: os.kill(os.getpid(), signal.SIGINT))
    sim = prepared()
    if what == "scene" and rank == 1:
        sim.grains.radius[0] = -1.0
    if what == "action":
        sim.actions.append(On(1, stumble))
    if what == "writer":
        sim.writers.append(On(1, stumble))
    if what == "force" and rank == 1:
        sim.grains.velocity[0] = np.inf
    if what == "rebuild":
        build = sim.contacts.build
        sim.contacts.build = lambda *a: stumble(sim) if rank == 1 and sim.step_number > 30 else build(*a)
        sim.staleness.also_when = lambda step: True
    if what == "ghosts":
        finish = sim.ghosts.finish_update
        sim.ghosts.finish_update = lambda g: stumble(sim) if rank == 1 and sim.step_number > 30 else finish(g)
    if what == "disk" and rank == 1:
        os.pwrite = lambda *a: (_ for _ in ()).throw(OSError(28, "No space left on device"))
    if what == "disk":
        sim.writers.append(Checkpoints(Path(sys.argv[2]) / "checkpoints", bc.Every(30)))
    sim.run(40)
    print("went on to the end")


def die_or_go_on(directory):
    """Goes on from the newest checkpoint; the first time rank 1 is killed at step 57."""
    sim = pile(0)
    path, _ = newest_sound(directory, world())
    if path is None:
        sim = pile(80)
        sim.actions.append(On(1, lambda sim: None))
        sim.actions[-1].due = lambda step: step == 57 and world().rank == 1
        sim.actions[-1].apply = lambda sim: os.kill(os.getpid(), signal.SIGKILL)
    else:
        restore(sim, path)
    sim.writers.append(Checkpoints(directory, bc.Every(20)))
    sim.run(80 - sim.step_number)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    if sys.argv[1] == "die":
        die_or_go_on(Path(sys.argv[2]))
    elif sys.argv[1] == "world":
        sys.stdout.write(f"{world().rank} of {world().size}\n")
    else:
        whoever_fails(sys.argv[1])
