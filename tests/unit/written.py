"""A pile with one of each writer, for the tests of writers; and a program that is to fail or to die while it writes.

written.py full DIRECTORY          every writer meets a full disk; prints what each of them said
written.py kill DIRECTORY NUMBER   killed, as by ``kill -9``, when it has filled its NUMBER-th file, before that is renamed
"""

import json
import os
import resource
import signal
import sys
import warnings
from pathlib import Path

import scenes

import barchan as bc
from barchan.checkpoint import Checkpoints
from barchan.errors import BarchanError
from barchan.measure import KineticEnergy
from barchan.writers import ContactFrames, GrainFrames, LammpsDump, Table


def means(sim):
    """One row: a number that needs all its digits, and a count."""
    return {"kinetic energy [J]": KineticEnergy().compute(sim).total, "contacts": int(sim.comm.sum([sim.touching])[0])}


def profile(sim):
    """Two rows: the same for what lies below and above half the box."""
    height = sim.grains.view("position")[:, 2]
    return [{"z [m]": z, "grains": int(sim.comm.sum([(abs(height - z) < 1.5).sum()])[0])} for z in (1.5, 4.5)]


def writers(directory, tables_every=5):
    """One of each."""
    due = bc.Every(10)
    return [
        GrainFrames(directory, due),
        ContactFrames(directory, due),
        LammpsDump(directory, due),
        Table(directory / "means.csv", bc.Every(tables_every), means),
        Table(directory / "profile.csv", due, profile),
    ]


def pile(directory=None, count=40):
    """The pile of ``scenes`` with fields of the user's own; with ``count`` = 0, without its grains."""
    sim = scenes.pile(count)
    sim.add_field("label", width=2, dimension="length")
    sim.add_field("marked", dtype=bool)
    sim.grains.label[:, 1] = sim.grains.id**0.5
    sim.grains.marked = sim.grains.id % 3 == 0
    if directory is not None:
        sim.writers = writers(directory)
    return sim


def meet_full_disk(directory):
    """What each writer says when no file may grow beyond a limit, and whether it can go on when that is lifted."""
    sim = pile(directory)
    sim.run(10)
    every = [*sim.writers, Checkpoints(directory / "checkpoints", bc.Every(1))]
    every[-1].write(sim)
    sim.writers = []
    sim.run(1)
    before = contents(directory)
    heard = []
    for writer in every:
        limit = writer.path.stat().st_size + 20 if isinstance(writer, Table) else 700
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        try:
            writer.write(sim)
            error = None
        except BarchanError as raised:
            error = raised
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        heard.append([type(writer).__name__, type(error).__name__, str(error), contents(directory) == before])
    for writer in every:
        writer.write(sim)
    print(json.dumps({"heard": heard, "new": sorted(set(contents(directory)) - set(before))}))


def contents(directory):
    """Every file below a directory: name -> bytes."""
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def die_in_write(directory, number):
    """Run until ``number`` files have been filled."""
    real, count = os.replace, 0

    def replace(old, new):
        nonlocal count
        count += 1
        if count == number:
            os.kill(os.getpid(), signal.SIGKILL)
        real(old, new)

    os.replace = replace
    pile(directory).run(50)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    if sys.argv[1] == "full":
        meet_full_disk(Path(sys.argv[2]))
    else:
        die_in_write(Path(sys.argv[2]), int(sys.argv[3]))
