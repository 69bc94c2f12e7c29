"""How well several ranks share a dense bed: speed-up and efficiency, equations (14) and (15) of Walther & Sbalzarini (2009), and
where the time goes."""

import warnings
from time import perf_counter
from typing import NamedTuple

import numpy as np

from barchan.bench.bed import bed, simulation
from barchan.errors import SceneError
from barchan.kernels.wire import GHOST
from barchan.laws import hertz_standard
from barchan.materials import Material
from barchan.parallel import Serial
from barchan.parallel.guard import on_first_rank
from barchan.report import Journal, table
from barchan.stopwatch import Stopwatch
from barchan.warmup import compile_law

#: Grains in all above which one rank computes its share of them only, and the time of all is extrapolated linearly.
MEASURED = 4_000_000

#: Timings of one rank and of all in turns; steps before the first; steps that are timed phase by phase.
ROUNDS, BEFORE, PHASED = 5, 200, 100

#: Phases in the order of a step; "waiting" is for other ranks, if they are made to wait for each other.
PHASES = ("motion", "actions", "neighbours", "ghosts", "forces", "output", "waiting")


class Scaling(NamedTuple):
    """What was measured; times are seconds of a step.

    Attributes:
        ranks, threads, grains, steps: of the run of all ranks; steps of one timing.
        alone, together: (rounds,) on one rank and on all.
        measured: True if the one rank had all grains.
        phases: name -> (mean over ranks, largest), in steps that are timed phase by phase.
        ghosts, messages, bytes: ghosts for each grain; largest of any rank in a step, ghosts' messages only.
        imbalance: largest over mean time that ranks computed.
        hidden: time of ghosts' messages when nothing is computed meanwhile, less what is waited for when something is.
    """

    ranks: int
    threads: int
    grains: int
    steps: int
    alone: np.ndarray
    together: np.ndarray
    measured: bool
    phases: dict
    ghosts: float
    messages: int
    bytes: int
    imbalance: float
    hidden: float

    @property
    def speed_up(self):
        """S of each round, equation (14), for as many grains on one rank as on all."""
        return self.alone / self.together

    @property
    def efficiency(self):
        """e of each round, equation (15)."""
        return self.speed_up / self.ranks


def measure(comm, grains, threads=1, steps=None, sync=False, journal=None):
    """Run a dense bed on one rank and on all ranks of ``comm``, in turns. All ranks must call this.

    Args:
        grains: of each rank, about.
        steps: of one timing; default: about two seconds.
        sync: let ranks wait for each other after each phase, where phases are timed.
        journal: tells what is going on.

    Returns:
        A ``Scaling``, the same on all ranks but for times, which are right on rank 0.

    Raises:
        SceneError: there is one rank only.
    """
    if comm.size == 1:
        raise SceneError("scaling compares several processes with one; start them: mpiexec -n 2 barchan scaling")
    journal = journal or Journal()
    compile_law(hertz_standard, [Material("grain", kn=1.0, kt=1.0, friction=0.5)], journal.compiling)
    made = on_first_rank(comm, lambda: bed(grains * comm.size, journal))
    measured = made.count <= MEASURED
    several, alone = simulation(made, threads, comm), None
    if comm.rank == 0:
        alone = simulation(made if measured else bed(grains, journal), threads, Serial())
    steps = steps or int(min(4000, max(100, 3e7 // made.count)))
    seconds = np.zeros((2, ROUNDS))
    for number in range(-1, ROUNDS):  # the first one only warms up
        for kind, sim in ((0, alone), (1, several)):
            comm.rest()
            if sim is not None:
                seconds[kind, number] = _timed(sim, steps if number >= 0 else BEFORE)
        what = f"round {number + 1} of {ROUNDS}" if number >= 0 else "warmed up"
        journal.say(f"{what}: {steps if number >= 0 else BEFORE:,} steps on one rank, and on all", passing=True)
    several_at_once, _ = _phases(several, None, at_once=True)
    freely, computed = _phases(several, None)
    phases, computed = _phases(several, comm) if sync else (freely, computed)
    waited, at_once = (times["ghosts"][0] for times in (freely, several_at_once))
    get, count = several.ghosts.get, several.grains.n_ghost
    messages, rows = comm.maximum([len(get.sends), len(get.rows)]).tolist()
    ghosts, owned = comm.sum([count, several.grains.n]).tolist()
    factor = 1.0 if measured else made.count / alone.grains.n if alone else 1.0
    imbalance = float(computed.max() / computed.mean())
    traffic = (ghosts / owned, int(messages), int(rows) * _bytes_of_ghost(several))
    times = (seconds[0] * factor, seconds[1], measured, phases)
    return Scaling(comm.size, threads, owned, steps, *times, *traffic, imbalance, at_once - waited)


def _bytes_of_ghost(sim):
    """What a step sends of a ghost: compiled code what the law reads, Python whole blocks."""
    if sim.threads == 1 and sim.ghosts.wire is not None:
        return GHOST * 8
    return sum(sim.grains.block(name).strides[0] for name in sim.grains.blocks_of(sim.law.reads))


def _timed(sim, steps):
    """Seconds of a step, of the slowest rank."""
    sim.comm.barrier()
    began = perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of large overlaps: the bed is as soft as that
        sim.run(steps)
    return float(sim.comm.maximum([perf_counter() - began])[0]) / steps


def _phases(sim, wait, at_once=False):
    """Time steps phase by phase.

    Args:
        wait: communicator of ranks that wait for each other after each phase; None: they do not.
        at_once: wait for ghosts at once.

    Returns:
        (phase -> seconds of a step, mean over ranks and largest; (ranks,) seconds that each computed).
    """
    clock, sim.clock = sim.clock, Stopwatch(wait)
    sim.clock.by_phase, sim.ghosts.at_once = True, at_once
    sim.run(PHASED)
    watch, sim.clock, sim.ghosts.at_once = sim.clock, clock, False
    own = np.array([watch.seconds.get(name, 0.0) for name in PHASES]) / PHASED
    each = np.array(sim.comm.all_gather(own.tolist()))
    computed = each[:, [PHASES.index("motion"), PHASES.index("forces")]].sum(axis=1)
    return {name: (float(each[:, k].mean()), float(each[:, k].max())) for k, name in enumerate(PHASES)}, computed


def lines(result):
    """A ``Scaling`` as text for a terminal."""
    how = "measured" if result.measured else "extrapolated from the grains of one rank"

    def spread(values, digits):
        return f"{np.median(values):.{digits}f} ({values.min():.{digits}f}-{values.max():.{digits}f})"

    cells = [
        ("grains", f"{result.grains:,} on {result.ranks} ranks of {result.threads} thread(s), dense bed"),
        ("one rank t(1)", f"{spread(1e3 * result.alone, 3)} ms a step, {how}"),
        (
            f"all ranks t({result.ranks})",
            f"{spread(1e3 * result.together, 3)} ms a step; {len(result.together)} timings of {result.steps:,} steps in turns",
        ),
        ("speed-up S", f"{spread(result.speed_up, 3)}, equation (14)"),
        ("efficiency e", f"{spread(result.efficiency, 3)}, equation (15)"),
        ("ghosts", f"{result.ghosts:.4f} for each grain"),
        ("a rank's messages", f"at most {result.messages} with {result.bytes:,} bytes a step"),
        ("imbalance", f"{result.imbalance:.3f} largest over mean time of motion and forces"),
        ("overlap", f"{1e3 * result.hidden:.3f} ms a step less than if ghosts were waited for at once (negative: noise)"),
    ]
    head = ("phase, in steps from Python", "mean of ranks [ms a step]", "largest")
    rows = [(name, f"{1e3 * mean:.4f}", f"{1e3 * most:.4f}") for name, (mean, most) in result.phases.items() if most > 0.0]
    noise = "  A range wider than the differences you look for means that something else used the cores: measure again."
    return [
        *table(cells),
        noise,
        "",
        *table([head, *rows]),
        "  One by one, phases take longer than in t: compare them, not sums.",
    ]
