"""How ranks share grains of very different sizes (Stratford et al. 2018, Figures 4 and 5): what they send each other, how evenly
they work, how a rebuild gets faster.

Ranks are virtual ones, which compute one at a time, and all wait for each other wherever they talk; times are the processor's.
That a network takes time, and that cores share a memory, is not in them.
``python -m barchan.bench.shared FIGURE.png bidisperse-10 bidisperse-20`` measures these cases of ``barchan bench size-classes``.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.ticker import LogLocator, NullLocator

from barchan.bench import cases
from barchan.bench.peers.barchan import Engine
from barchan.kernels.wire import GHOST
from barchan.parallel import virtual_ranks, world
from barchan.report import Journal, table
from barchan.view.style import COLOURS, figure

#: Numbers of ranks; rebuilds, and steps without one, that are timed.
RANKS, TIMED = (1, 2, 4, 8, 16), 5

#: What is sent of a ghost in a step, and what would be sent back of one on which forces act: force and torque [bytes].
SENT, RETURNED = 8 * GHOST, 8 * 6


class Share(NamedTuple):
    """What one rank has of a sample. Ghosts are those that it gets; of ``of_one_class`` and ``put``, those that it sends.

    ``owned``: grains. ``of_one_class``: ghosts that a search with one class of all would look at. ``searched``: that this one
    looks at. ``kept``: those of them that are in a pair, and travel in every step. ``put``: those that would travel, and on which
    forces would be sent back, if each pair of grains of two ranks were computed once. ``rebuilds``, ``steps``: (k,) seconds for
    which it computed.
    """

    owned: int
    of_one_class: int
    searched: int
    kept: int
    put: int
    rebuilds: tuple
    steps: tuple


def shares(case, ranks, timed=TIMED):
    """The ``Share`` of each rank of so many that run a ``Case``."""

    def program():
        engine, comm = Engine(1, None), world()
        engine.set_up(case, case.skins[0])
        sim = engine.sim
        sim.balance.when = "never"
        largest, place = sim.size_classes.largest, sim.grains.block("place")
        alike = sim.topology.sends(comm.rank, place, largest[-1:], sim.skin) if ranks > 1 else {}
        counts = sum(map(len, alike.values())), sim.ghosts.searched, sim.grains.n_ghost, put_once(sim).n_received
        counts = sim.grains.n, *counts
        steps = [_computed(comm, lambda: sim.run(1)) for _ in range(timed)]
        rebuilds = [_computed(comm, sim.rebuild) for _ in range(timed)]
        return Share(*counts, tuple(rebuilds), tuple(steps))

    return virtual_ranks(ranks, program)


def _computed(comm, act):
    """Seconds that this rank computes while all ``act``."""
    comm.barrier()
    before = comm.computed
    act()
    comm.barrier()
    return comm.computed - before


def once(sim):
    """Rows of the owned grain and of the ghost, (pairs,) each, of the pairs of two ranks that this one would compute if each were
    computed once: by the owner of the grain of the smaller class; of two of one class by the lower rank or the higher, as the
    two ranks have an even sum or an odd one."""
    contacts, n, rank, receives = sim.contacts, sim.grains.n, sim.comm.rank, sim.ghosts.get.receives
    first, second = contacts.first.astype(np.int64), contacts.second.astype(np.int64)
    border = np.maximum(first, second) >= n
    own, ghost = np.minimum(first, second)[border], np.maximum(first, second)[border]
    number = np.searchsorted(sim.size_classes.largest[:-1], sim.grains.view("radius", ghosts=True))
    other = np.repeat(np.array(list(receives), dtype=np.int64), list(receives.values()))[ghost - n]
    its_turn = (rank < other) == ((rank + other) % 2 == 0)
    here = (number[own] < number[ghost]) | ((number[own] == number[ghost]) & its_turn)
    return own[here], ghost[here]


def put_once(sim):
    """The ghost put by which forces would then be sent back. All ranks must call this."""
    _, ghost = once(sim)
    wanted = np.zeros(sim.grains.n_ghost, dtype=bool)
    wanted[ghost - sim.grains.n] = True
    return sim.ghosts.get.narrowed(wanted).reverse()


class Summary(NamedTuple):
    """All ranks together.

    ``ranks``: how many. ``received_one_class``, ``received``, ``received_once``: bytes that one receives in a step, mean over
    ranks: if all ghosts of one class of all travelled; as it is; and what it gets and is sent back if each pair were computed
    once. ``slowest``: seconds of a rebuild on the slowest rank. ``uneven_rebuild``, ``uneven_step``: largest over mean time of a
    rank. Times are the shortest of each rank.
    """

    ranks: int
    received_one_class: float
    received: float
    received_once: float
    slowest: float
    uneven_rebuild: float
    uneven_step: float


def summary(found):
    """The ``Summary`` of the ``Share`` of each rank."""
    mean = {name: np.mean([getattr(share, name) for share in found]) for name in ("of_one_class", "kept", "put")}
    rebuilds, steps = (np.min([getattr(share, name) for share in found], axis=1) for name in ("rebuilds", "steps"))
    volumes = SENT * mean["of_one_class"], SENT * mean["kept"], (SENT + RETURNED) * mean["put"]
    return Summary(len(found), *volumes, rebuilds.max(), rebuilds.max() / rebuilds.mean(), steps.max() / steps.mean())


def lines(name, summaries):
    """A table for the terminal."""
    head = (name, "kB a step, one class", "kept", "computed once", "rebuild [s]", "speed-up", "uneven rebuild", "uneven step")
    alone = summaries[0].slowest * summaries[0].ranks
    return table(
        [
            head,
            *(
                (
                    f"{one.ranks} ranks",
                    *(f"{value / 1e3:.4g}" for value in one[1:4]),
                    f"{one.slowest:.4g}",
                    f"{alone / one.slowest:.3g}",
                    f"{one.uneven_rebuild:.3f}",
                    f"{one.uneven_step:.3f}",
                )
                for one in summaries
            ),
        ]
    )


def draw(found, path):
    """The figure of name -> summaries."""
    with figure(path, columns=3, size=(10.0, 4.0)) as (_, (volume, uneven, time)):
        for (name, summaries), style in zip(found.items(), ("-", "--", ":")):
            look = {"linestyle": style, "marker": "o", "markersize": 3.0}
            for axes, colours, curves in ((volume, COLOURS[1:], VOLUMES), (uneven, COLOURS, EVENNESS), (time, COLOURS, TIME)):
                for colour, (field, what) in zip(colours, curves.items()):
                    shown = [one for one in summaries if one.ranks > 1 or axes is time]
                    values = [getattr(one, field) * (1e-3 if axes is volume else 1.0) for one in shown]
                    axes.plot([one.ranks for one in shown], values, color=colour, label=f"{name}: {what}", **look)
            ideal = [summaries[0].slowest * summaries[0].ranks / one.ranks for one in summaries]
            time.plot([one.ranks for one in summaries], ideal, color="0.5", linewidth=0.8, linestyle=style)
        for axes, what in zip((volume, uneven, time), LABELS):
            axes.set_xscale("log")
            axes.set_xticks([one.ranks for one in summaries], [str(one.ranks) for one in summaries])
            axes.xaxis.set_minor_locator(NullLocator())
            axes.set_xlabel("ranks [1]")
            axes.set_ylabel(what)
            axes.legend(fontsize=7, handlelength=4.0, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        for axes in (volume, time):
            axes.set_yscale("log")
            axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter("{x:g}")


#: Lines of the three figures: fields of a ``Summary``, and what they are; what is along their other axes.
VOLUMES = {
    "received_one_class": "one class of all",
    "received": "as it is",
    "received_once": "each pair computed once",
}
EVENNESS = {"uneven_rebuild": "rebuild", "uneven_step": "step"}
TIME = {"slowest": "slowest rank"}
LABELS = (
    "received by a rank in a step, mean [kB]",
    "time of the slowest rank over the mean [1]",
    "time of a rebuild [s] (grey: shared ideally)",
)


def main(path, *names):
    """Measure the cases of these names; print tables, draw the figure."""
    found = {}
    for name in names:
        case = cases.make(name, Journal())
        found[name] = [summary(shares(case, ranks)) for ranks in RANKS]
        print("\n".join(lines(name, found[name])), flush=True)
    draw(found, Path(path))


if __name__ == "__main__":
    main(*sys.argv[1:])
