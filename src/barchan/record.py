"""How a run went: per sitting (from a start or resume to a stop or end) where the time went and how the neighbour list fared.

Kept beside the results, outside the state: it holds wall-clock times, which differ from run to run.
"""

import json
import platform
import time
from collections import Counter
from importlib.metadata import version

from pydantic import BaseModel

from barchan import atomic
from barchan.version import VERSION


def versions():
    """What the run was made with."""
    return {
        "barchan": VERSION,
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "numba", "h5py")},
        "machine": f"{platform.system()} {platform.machine()}",
    }


class Account(BaseModel):
    """What is kept of a sitting. Times in seconds of the wall clock; ``large_overlaps`` and ``outlets`` since the run began."""

    versions: dict[str, str] = {}
    threads: int
    processes: int = 1
    first_step: int
    last_step: int
    seconds: float
    stages: dict[str, float]
    work: dict[str, float]
    rebuilds: int
    steps_between_rebuilds: int
    shortest_interval: int | None = None
    bound_13: float | None = None
    stable_dt: float | None = None
    large_overlaps: int = 0
    outlets: dict[str, dict[str, float]] = {}
    size_classes: str = ""


class Sitting:
    """Counts one sitting of a simulation."""

    def __init__(self, sim):
        self.first, self.began, self.stages, self.large_overlaps = sim.step_number, time.monotonic(), {}, 0

    def stage(self, name, seconds):
        """Book the seconds of a stage."""
        self.stages[name] = self.stages.get(name, 0.0) + seconds

    def count(self, sim):
        """Count what ranks have found until now; all must call this, after steps that went well."""
        self.large_overlaps = int(sim.comm.sum([sim.faults.large_overlaps])[0])

    def account(self, sim):
        """The account of the sitting, up to now."""
        watch = sim.staleness
        return Account(
            versions=versions(),
            threads=sim.threads,
            processes=sim.comm.size,
            first_step=self.first,
            last_step=sim.step_number,
            seconds=time.monotonic() - self.began,
            stages=self.stages,
            work=sim.clock.seconds,
            rebuilds=watch.rebuilds,
            steps_between_rebuilds=watch.total,
            shortest_interval=watch.shortest if watch.rebuilds else None,
            bound_13=watch.bound_13 if watch.bound_13 < float("inf") else None,
            stable_dt=sim.stable_dt,
            large_overlaps=max(self.large_overlaps, int(sim.faults.large_overlaps)),
            outlets=sim.notes.get("outlets", {}),
            size_classes=str(sim.size_classes),
        )


def sittings(path):
    """Accounts of all sittings recorded so far, oldest first; an unreadable record counts as none."""
    try:
        return [Account.model_validate(entry) for entry in json.loads(path.read_text())["sittings"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []


def add(path, account):
    """Record one more sitting."""
    with atomic.writing(path) as partial:
        kept = [entry.model_dump() for entry in (*sittings(path), account)]
        partial.write_text(json.dumps({"sittings": kept}, indent=1) + "\n")


def lines(path):
    """The record as lines of the summary: where the time went."""
    found = sittings(path)
    if not found:
        return ["no record of how this run went"]
    seconds = sum(s.seconds for s in found)
    steps = sum(s.last_step - s.first_step for s in found)
    processes = f"{found[-1].processes} processes of " if found[-1].processes > 1 else ""
    text = [f"{steps:,} steps in {seconds:,.1f} s on {processes}{found[-1].threads} thread(s), {len(found)} sitting(s)"]
    for title, parts in (("stages", [s.stages for s in found]), ("work", [s.work for s in found])):
        sums = Counter()
        for part in parts:
            sums.update(part)
        text.append(
            f"{title}: "
            + ", ".join(f"{name} {value:,.1f} s ({100 * value / max(seconds, 1e-9):.0f} %)" for name, value in sums.items())
        )
    rebuilds = sum(s.rebuilds for s in found)
    mean = sum(s.steps_between_rebuilds for s in found) / max(rebuilds, 1)
    shortest = min((s.shortest_interval for s in found if s.shortest_interval), default=0)
    bound = min((s.bound_13 for s in found if s.bound_13 is not None), default=None)
    text.append(
        f"neighbour list: {rebuilds} rebuilds, every {mean:.1f} steps on average, shortest {shortest}; equation (13) allows "
        f"{'any number of' if bound is None else f'{bound:.1f}'} steps at the largest speed seen"
    )
    if found[-1].size_classes:
        text.append(f"size classes: {found[-1].size_classes}")
    return text
