"""What came out: rows of the JSON, the table on the terminal."""

import json
import os
import platform

import numpy as np

from barchan import atomic
from barchan.bench import figures
from barchan.errors import SceneError
from barchan.kernels.compiler import default_threads
from barchan.record import versions
from barchan.report import table

#: Ratio of the largest ratio to the smallest of a code, above which something else was running.
QUIET = 1.4


def row(entry, ours, case):
    """One code's figures by name; one that was not run has its name and the reason.

    ``ratio_*``: its time over ours, of each pair of timings: median, smallest, largest. ``skin``: relative to the largest
    diameter. ``seconds``: of a step, or of a rebuild, median of ``seconds_each``, one of each round. ``memory_per_grain``:
    [bytes]. Of a code that was told its size classes: ``division``, the fastest, and ``divisions``, the seconds of
    all. On several ranks: ``ghosts`` of the first.
    """
    if entry.reason is not None:
        return {"peer": entry.peer.name, "reason": entry.reason}
    ratio, (seconds, rebuilds) = entry.ratios(ours), np.array(entry.timings).T
    told = {
        "division": str(entry.division),
        "divisions": [one._asdict() | {"seconds": took} for one, took in entry.trials.items()],
    }
    return (
        {
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
        | (told if entry.trials else {})
        | ({"ghosts": entry.ghosts} if entry.ghosts is not None else {})
    )


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
    divided = [(one["peer"], f"searched in {one['division']}") for one in result["rows"] if "division" in one]
    divided += [(one["peer"], f"{one['ghosts']:,} ghosts on the first rank") for one in result["rows"] if "ghosts" in one]
    missing = [(one["peer"], f"not run: {one['reason']}") for one in result["rows"] if "reason" in one]
    about = f"{result['case']}: {result['title']} Ratio: time over that of {result['rows'][0]['peer']}."
    starts = f"first start {result['first_start_s']:.1f} s (compiles), later starts {result['second_start_s']:.1f} s"
    uneasy = [one["peer"] for one in result["rows"] if "reason" not in one and one["ratio_max"] > QUIET * one["ratio_min"]]
    warning = f"  the machine was not quiet: ratios of {', '.join(uneasy)} differ by more than {QUIET - 1:.0%}; measure again"
    medians = "  ratio: median of those of single rounds; ms: median of the rounds"
    below = [medians, f"  {starts}", *([warning] if uneasy else [])]
    return [about, *table(cells), *table(divided), *table(missing), *efficiencies(result), *below]


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
    """Write the result as JSON, and its figures beside it; returns the paths of the figures."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic.writing(path) as partial:
        partial.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    pictures = [path.with_suffix(".png")]
    figures.draw_ratios(result, pictures[0])
    if any("divisions" in one for one in result["rows"]):
        pictures.append(path.with_name(f"{path.stem}-divisions.png"))
        figures.draw_divisions(result, pictures[1])
    return pictures
