"""barchan itself, driven like any other code: on several threads and on one, which shows our own speed-up, and on several
ranks of one thread each."""

import time
import warnings

import numpy as np

from barchan.bench.peers import mpich
from barchan.bench.peers.peer import Peer, driver
from barchan.domain import Box
from barchan.laws import SHIPPED
from barchan.materials import Material
from barchan.measure.base import full_step
from barchan.parallel import world
from barchan.simulation import Simulation
from barchan.version import VERSION
from barchan.walls import Plane
from barchan.warmup import compile_law

#: Cells that all grains may look at, about, where one grid for all sizes is timed.
PATIENT = 1e9

#: The laws that compute what LAMMPS does.
LAWS = {"hooke": "linear_standard", "hertz": "hertz_standard"}


def find(threads, ranks):
    """barchan on ``threads`` threads, on one, and on ``ranks`` ranks."""
    peers, several = [Peer(f"barchan-{n}", driver("barchan", n)) for n in dict.fromkeys((threads, 1))], f"barchan-mpi-{ranks}"
    if ranks > 1 and mpich.why_not(ranks):
        peers.append(Peer(several, missing=mpich.why_not(ranks)))
    elif ranks > 1:
        peers.append(Peer(several, mpich.on_ranks(ranks, driver("barchan", 1)), ranks=ranks))
    return peers


def told(radius):
    """barchan on one thread, told the size classes of grains of these radii, and told to use one grid for all of them."""
    alone, multi = driver("barchan", 1), Peer("barchan-multi", missing="a rebuild of one grid for so many sizes takes minutes")
    if len(radius) * (radius.max() / radius.min()) ** 3 <= PATIENT:
        multi = Peer("barchan-multi", alone, told=True, cells=True)
    return [Peer("barchan-told", alone, told=True), multi]


class Engine:
    """Runs a case; see ``barchan.bench.serving``.

    Args:
        comm: of the ranks that run it; default: all.
    """

    version = f"barchan {VERSION}"

    def __init__(self, threads, home, comm=None):
        self.threads, self.sim, self.comm = threads, None, comm or world()
        self.rank = self.comm.rank
        warnings.simplefilter("ignore")  # of large overlaps: the cases have what they have

    def set_up(self, case, skin):
        """Start anew."""
        self.sim = None  # the memory of one simulation, not of two
        grains, material = case.grains, Material("grain", **case.constants._asdict())
        law = SHIPPED[LAWS[case.law]]
        compile_law(law, [material])  # or the first steps and the first rebuild would be timed with it
        sim = Simulation(Box(case.low, case.high, case.periodic), law, material, case.dt, case.gravity, self.threads, self.comm)
        sim.skin, sim.max_overlap = skin * case.diameter, 0.9  # other codes have no such limit; one case is as soft as that
        if case.floor is not None:
            sim.add_wall(Plane((0.0, 0.0, case.floor), (0.0, 0.0, 1.0)))
        mass = 4.0 / 3.0 * np.pi * grains.radius**3 * grains.density
        motion = {"velocity": grains.velocity, "omega": grains.omega, "frozen": grains.frozen}
        sim.add_grains(grains.position, grains.radius, mass=mass, **motion)
        sim.start_at_full_step()
        self.sim, self.radius = sim, grains.radius

    def divide(self, ends, cells):
        """Search as a ``Division`` says: in a grid for each class, or, if cells are given, in one of these."""
        classes, radius = self.sim.size_classes, self.radius
        classes.separators = tuple(ends)
        if cells is not None:
            classes.strategy, classes.cell = "multi", cells * (2.0 * float(radius[radius <= ends[0]].max()) + self.sim.skin)

    def run(self, steps, forced):
        """Advance; returns (seconds, rebuilds)."""
        watch = self.sim.staleness
        watch.also_when = (lambda step: True) if forced else None
        before, began = watch.rebuilds, time.perf_counter()
        self.sim.run(steps)
        return time.perf_counter() - began, watch.rebuilds - before

    def ghosts(self):
        """Grains of other ranks that this one has."""
        return self.sim.grains.n_ghost

    def observe(self):
        """The present state, at the full step."""
        grains, comm = self.sim.grains, self.sim.comm
        velocity, omega = full_step(self.sim, np.arange(grains.n))
        own = {"id": grains.view("id"), "position": grains.view("position"), "velocity": velocity, "omega": omega}
        parts = comm.all_gather({name: values.copy() for name, values in own.items()})
        seen = {name: np.concatenate([part[name] for part in parts]) for name in own}
        order = np.argsort(seen.pop("id"))
        return {name: values[order] for name, values in seen.items()}
