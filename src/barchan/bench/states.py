"""Starting states that take a while to make: made once by barchan itself, and kept in its cache directory."""

import time
import zipfile

import numpy as np

from barchan import atomic
from barchan.bench.peers.barchan import Engine
from barchan.experiments.avalanche import stages
from barchan.kernels.compiler import cache_root, default_threads
from barchan.measure.base import full_step
from barchan.parallel import Serial
from barchan.report import ProgressLine, clock

#: Version of everything made here; a new one makes all of it anew.
VERSION = 1

#: Steps in which the dense flow comes to rest, and those after which its grains are stopped: a bed that is let go swings for
#: ten times as long. Kinetic energy afterwards: 3e-4 of that of the flow.
SETTLING, STOPPED_EVERY = 3000, 250


def kept(name, make, journal):
    """The arrays of a state, from the cache directory or made now.

    Args:
        name: of the state, with what it depends on.
        make: function of the journal that returns the arrays by name.
        journal: tells what is made, and how long it took.

    Returns:
        Name -> array.
    """
    path = cache_root() / "bench" / f"{name}-v{VERSION}.npz"
    try:
        with np.load(path, allow_pickle=False) as saved:
            return {name: saved[name] for name in saved.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):  # not there, or not whole
        journal.say(f"making the state '{name}' of this benchmark, once; it is kept in {path}")
    began = time.monotonic()
    arrays = make(journal)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic.writing(path) as partial, open(partial, "wb") as file:
        np.savez(file, **arrays)
    journal.say(f"made the state '{name}' in {clock(time.monotonic() - began)}")
    return arrays


def settle(case, steps, journal):
    """Positions of the grains of a case, in its order, after they came to rest under vertical gravity: {"position"}."""
    still = np.zeros_like(case.grains.velocity)
    weight = float(np.linalg.norm(case.gravity))
    case = case._replace(grains=case.grains._replace(velocity=still, omega=still), gravity=(0.0, 0.0, -weight))
    engine = Engine(default_threads(), None, Serial())  # whoever makes a state does so alone

    def come_to_rest():
        for _ in range(0, steps, STOPPED_EVERY):
            engine.sim.grains.velocity = engine.sim.grains.omega = 0.0
            engine.sim.run(STOPPED_EVERY)

    engine.set_up(case, 0.1)
    _watched(engine.sim, [("settle", steps)], come_to_rest, journal)
    return {"position": engine.observe()["position"]}


def flow(scene, sim, duration, journal):
    """An avalanche ``duration`` [s] after its release, as the columns of ``Grains``."""
    equilibrate, down = stages(scene)
    end = equilibrate.end + scene.steps(duration)

    def both():
        for stage, last in ((equilibrate, equilibrate.end), (down, end)):
            stage.begin(sim)
            sim.run(last - sim.step_number)

    _watched(sim, [("equilibrate", equilibrate.end), ("flow", end)], both, journal)
    grains = sim.grains
    velocity, omega = full_step(sim, np.arange(grains.n))
    return {
        "position": grains.view("position").copy(),
        "radius": grains.view("radius").copy(),
        "density": np.full(grains.n, scene.density),
        "velocity": velocity,
        "omega": omega,
        "frozen": grains.view("frozen") == 1,
    }


def _watched(sim, phases, run, journal):
    """Run with a progress line."""
    progress = ProgressLine(phases, sim.step_number, journal)
    sim.writers = [progress]
    try:
        run()
    finally:
        progress.close()
