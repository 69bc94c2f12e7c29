"""What came out: rows of the JSON, the table on the terminal, the figure."""

import json
import os
import platform

import numpy as np

from barchan import atomic
from barchan.errors import SceneError
from barchan.kernels.compiler import default_threads
from barchan.record import versions
from barchan.report import table
from barchan.view.style import COLOURS, figure

#: Ratio of the largest ratio to the smallest of a code, above which something else was running.
QUIET = 1.4


def row(entry, ours, case):
    """One code's figures by name; one that was not run has its name and the reason.

    ``ratio_*``: its time over ours, of each pair of timings: median, smallest, largest. ``skin``: relative to the largest
    diameter. ``seconds``: of a step, or of a rebuild, median of ``seconds_each``, one of each round. ``memory_per_grain``:
    [bytes].
    """
    if entry.reason is not None:
        return {"peer": entry.peer.name, "reason": entry.reason}
    ratio, (seconds, rebuilds) = entry.ratios(ours), np.array(entry.timings).T
    return {
        "peer": entry.peer.name,
        "version": entry.version,
        "ratio_median": float(np.median(ratio)),
        "ratio_min": float(ratio.min()),
        "ratio_max": float(ratio.max()),
        "skin": entry.skin,
        "skin_at_border": entry.at_border,
        "scan": {f"{skin:g}": value for skin, value in entry.scan.items()},
        "seconds": float(np.median(seconds)),
        "seconds_each": seconds.tolist(),
        "rebuilds": int(rebuilds.min()),
        "grain_steps_per_second": case.count / float(np.median(seconds)),
        "contacts_per_grain": entry.contacts / case.count,
        "kinetic_energy": entry.energy,
        "memory_per_grain": None if entry.resident is None else (entry.resident - entry.idle) / case.count,
        "same_law": entry.peer.same_law,
        "same_work": entry.does_the_work_of(ours),
    }


def machine():
    """The machine and what runs on it."""
    return {"cpu": _processor(), "cores": default_threads(), "versions": versions()}


def _processor():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def lines(result):
    """The table of a result, for a terminal."""
    unit = "rebuild" if result["of"] == "rebuild" else "step"
    head = (
        "code",
        "ratio (range)",
        "skin",
        f"ms a {unit}",
        "grain-steps/s",
        "rebuilds",
        "contacts/grain",
        "B/grain",
        "same work",
    )
    cells = [head]
    for one in result["rows"]:
        if "reason" in one:
            continue
        cells.append(
            (
                one["peer"],
                f"{one['ratio_median']:.2f} ({one['ratio_min']:.2f}-{one['ratio_max']:.2f})",
                f"{one['skin']:g}{' (border)' if one['skin_at_border'] else ''}",
                f"{1e3 * one['seconds']:.3g}",
                f"{one['grain_steps_per_second']:.3g}",
                f"{one['rebuilds']:,}",
                f"{one['contacts_per_grain']:.3f}",
                "?" if one["memory_per_grain"] is None else f"{one['memory_per_grain']:,.0f}",
                "yes" if one["same_work"] else "NO",
            )
        )
    missing = [(one["peer"], f"not run: {one['reason']}") for one in result["rows"] if "reason" in one]
    about = f"{result['case']}: {result['title']} Ratio: time over that of {result['rows'][0]['peer']}."
    starts = f"first start {result['first_start_s']:.1f} s (compiles), later starts {result['second_start_s']:.1f} s"
    uneasy = [one["peer"] for one in result["rows"] if "reason" not in one and one["ratio_max"] > QUIET * one["ratio_min"]]
    warning = f"  the machine was not quiet: ratios of {', '.join(uneasy)} differ by more than {QUIET - 1:.0%}; measure again"
    medians = "  ratio: median of those of single rounds; ms: median of the rounds"
    return [about, *table(cells), *table(missing), *efficiencies(result), medians, f"  {starts}", *([warning] if uneasy else [])]


def efficiencies(result):
    """Lines with the efficiency of each code on several ranks, equation (15) of Walther & Sbalzarini (2009): the time on one rank
    over that on all of them together; the median of all rounds and its range."""
    seconds = {one["peer"]: np.array(one["seconds_each"]) for one in result["rows"] if "reason" not in one}
    found = []
    for alone, several in (("barchan-1", "barchan-mpi-"), ("lammps-1", "lammps-")):
        for peer in seconds:
            ranks = peer.removeprefix(several)
            if alone in seconds and peer != alone and ranks != peer and ranks.isdigit():
                each = seconds[alone] / seconds[peer] / int(ranks)
                spread = f"{each.min():.3f}-{each.max():.3f}"
                found.append(f"  efficiency of {peer}: {np.median(each):.3f} ({spread})")
    return found


def check_path(path):
    """Refuse a file that could not be written, before anything is measured.

    Raises:
        SceneError: it does not end in .json, or its directory cannot be written.
    """
    if path.suffix != ".json":
        raise SceneError(f"--json {path}: the name must end in .json; a figure is written beside it, ending in .png")
    above = next(parent for parent in path.absolute().parents if parent.exists())
    if not (above.is_dir() and os.access(above, os.W_OK | os.X_OK)):
        raise SceneError(f"--json {path} cannot be written: {above} is no directory that can be")
    if path.is_dir():
        raise SceneError(f"--json {path} is a directory; name a file")


def write(result, path):
    """Write the result as JSON, and its figure beside it; returns the path of the figure."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic.writing(path) as partial:
        partial.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    picture = path.with_suffix(".png")
    _draw(result, picture)
    return picture


def _draw(result, path):
    """Bars of the ratios with their ranges."""
    rows = result["rows"]
    with figure(path, size=(6.4, 0.9 + 0.32 * len(rows))) as (_, axes):
        for place, one in enumerate(rows):
            if "reason" in one:
                axes.text(0.02, place, f"not run: {one['reason'][:70]}", va="center", fontsize=7, style="italic")
                continue
            median = one["ratio_median"]
            reach = [[median - one["ratio_min"]], [one["ratio_max"] - median]]
            axes.barh(place, median, xerr=reach, color=COLOURS[place > 0], height=0.6, capsize=2.5, ecolor="0.2")
            axes.text(one["ratio_max"], place, f"  {median:.2f}", va="center", fontsize=8)
        axes.axvline(1.0, color="0.2", linewidth=0.8)
        axes.set_yticks(range(len(rows)), [one["peer"] for one in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.grid(axis="y", visible=False)
        axes.set_xlim(0.0, 1.15 * max([1.0, *(one["ratio_max"] for one in rows if "reason" not in one)]))
        axes.set_xlabel(f"time of a {result['of']} over that of {rows[0]['peer']} (median, range of {result['rounds']} pairs)")
        axes.set_title(f"{result['case']}: {result['grains']:,} grains, {result['machine']['cpu']}", fontsize=9)
