"""Figures of a benchmark."""

from matplotlib.ticker import LogLocator

from barchan.view.style import COLOURS, figure


def draw_ratios(result, path):
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


def draw_divisions(result, path):
    """What a rebuild takes however the size classes are cut: over the cells of the smallest, if all cut alike (Stratford et al.
    2018, Figure 3), or over the diameter between two classes (Figures 7 and 9), at the best cells. Bars are the spread."""
    told = [one for one in result["rows"] if "divisions" in one]
    by_cells = len({tuple(division["ends"]) for one in told for division in one["divisions"]}) == 1
    with figure(path, size=(6.4, 4.0)) as (_, axes):
        for colour, one in zip(COLOURS[1:], told):
            curve = _over_cells(one) if by_cells else _over_ends(one)
            if len(curve) > 1 or not by_cells:
                at, low, high = zip(*curve)
                middle = [0.5 * (a + b) for a, b in zip(low, high)]
                spread = [0.5 * (b - a) for a, b in zip(low, high)]
                axes.errorbar(at, middle, yerr=spread, marker="o", markersize=3.5, capsize=2.5, color=colour, label=one["peer"])
            several = [min(division["seconds"]) for division in one["divisions"] if len(division["ends"]) > 1]
            if several:
                axes.axhline(min(several), color=colour, linestyle=":", label=f"{one['peer']}, best of more than two classes")
        ours = result["rows"][0]
        axes.axhline(ours["seconds"], color=COLOURS[0], linestyle="--", label=f"{ours['peer']}, its own choice")
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("{x:g}")
        of_cells = "edge of the cells of the smallest class [reach of two of its grains]"
        axes.set_xlabel(of_cells if by_cells else "diameter between two size classes [smallest diameter]")
        axes.set_ylabel(f"time of a {result['of']} [s]")
        axes.set_title(f"{result['case']}: {result['grains']:,} grains, {result['machine']['cpu']}", fontsize=9)
        axes.legend(fontsize=8)


def _over_cells(one):
    """(edge of cells, least and most seconds) of each division of a code that was told its cells."""
    return sorted(
        (division["cells"], min(division["seconds"]), max(division["seconds"]))
        for division in one["divisions"]
        if division["cells"] is not None
    )


def _over_ends(one):
    """(diameter between two classes, least and most seconds at the best cells)."""
    found = {}
    for division in one["divisions"]:
        if len(division["ends"]) == 1:
            at = 2.0 * division["ends"][0]
            found[at] = min(found.get(at, division["seconds"]), division["seconds"], key=min)
    return sorted((at, min(seconds), max(seconds)) for at, seconds in found.items())
