"""Checks of the promise that the result has the same bits on any number of threads and ranks, and after stop and resume."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.domain import Box
from barchan.kernels import compiler
from barchan.laws import SHIPPED, silbert
from barchan.materials import Material
from barchan.packing.lattice import lattice
from barchan.parallel import virtual_ranks
from barchan.selftest.finding import Finding
from barchan.simulation import Simulation
from barchan.testing import packed_square_roots
from barchan.walls import Plane

STEPS = 100


def flow(threads=1, grains=300):
    """A compressed, sheared layer on a floor in a periodic box: contacts form, slide and break in every step."""
    box = Box((0.0, 0.0, -0.5), (8.0, 6.0, 12.0), (True, True, False))
    sand = Material("sand", density=1.0, kn=2e4, kt=6e3, gamma_n=20.0, gamma_t=10.0, friction=0.4)
    sim = Simulation(box, silbert, sand, 5e-4, gravity=(2.0, 0.3, -5.0), threads=threads)
    sim.add_wall(Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    if grains:
        random = np.random.default_rng(7)
        points = lattice("fcc", 4.0 / 3.0, (0.0, 0.0, 0.45), (6, 5, 3))[:grains] * (1.0, 0.9, 1.0)
        velocity = random.normal(0.0, 0.4, points.shape) + np.outer(points[:, 2], (0.5, 0.0, 0.0))
        sim.add_grains(points, random.uniform(0.45, 0.5, len(points)), velocity=velocity)
    return sim


def final_state(threads=1, rebuild=None):
    """State of the flow after ``STEPS`` steps."""
    sim = flow(threads)
    sim.staleness.also_when = rebuild
    sim.run(STEPS)
    return collect(sim)


def same(first, second, allowed="identical"):
    """The finding that two states have the same bits, and enough contacts for that to mean something."""
    lines = differences(first, second)
    contacts = len(first.contacts.keys)
    return Finding(lines[0] if lines else f"identical, {contacts} contacts", allowed, not lines and contacts > 150)


@contextmanager
def woken_threads():
    """Let even a few grains be shared by all threads; otherwise threads that pay off only for many would stay asleep."""
    before, compiler.GRAINS_PER_THREAD = compiler.GRAINS_PER_THREAD, 1
    try:
        yield
    finally:
        compiler.GRAINS_PER_THREAD = before


def threads(number):
    """The same bits on one thread and on ``number``."""
    with woken_threads():
        return same(final_state(), final_state(number), f"identical on {number} threads")


def ranks():
    """The same bits on one rank and on three that share the box."""
    return same(final_state(), virtual_ranks(3, final_state)[0])


def resumed():
    """The same bits after a run in one go and after one that was saved to a file half-way and resumed from it."""
    first, second = flow(), flow(grains=0)
    with tempfile.TemporaryDirectory() as folder:
        first.run(STEPS // 2)
        save(first, Path(folder) / "middle.h5")
        restore(second, Path(folder) / "middle.h5")
    second.run(STEPS - STEPS // 2)
    return same(final_state(), collect(second))


def rebuilds():
    """The same bits when the neighbour list is made anew in every step."""
    return same(final_state(), final_state(rebuild=lambda step: True))


def vectorised():
    """The loops of the shipped laws use vector instructions of this processor: information, not all processors have them.
    Fails when no law does."""
    names = [law.name for law in SHIPPED.values() if packed_square_roots(law) > 0]
    return Finding(f"{len(names)} of {len(SHIPPED)} laws", "not none", bool(names))
