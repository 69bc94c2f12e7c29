"""Pictures of a broken specimen: its cracks, and its grains by fragment."""

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.lines import Line2D

from barchan.experiments.rock.setup import axis_of
from barchan.laws.parallel_bond import MODES
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure

#: Colours of the largest fragments, and of all others.
LARGEST, OTHERS = (COLOURS[5], COLOURS[4], COLOURS[2], COLOURS[3], COLOURS[0], COLOURS[1]), "#D0D0D0"

#: A fragment of fewer grains is one of the others.
FEWEST = 5


def broken(scene, test, cracks, parts, path):
    """A slice through the middle, two diameters thick: left, each crack as a disc where the bond was, seen from the side,
    coloured by mode; right, grains at the end, coloured by fragment."""
    middle = np.array([axis_of(scene, test), 0.0, 0.0])
    grains, place = parts.grains, parts.grains["position"] - middle
    half = 0.6 * scene.height if test == "brazilian" else 0.4 * scene.height
    with figure(path, 1, 2, size=(9.0 if test == "brazilian" else 6.6, 4.2), sharex=True, sharey=True) as (_, (left, right)):
        near = np.abs(cracks["y [m]"]) <= 2.0 * scene.radius
        seen = _draw_cracks(left, scene, {name: column[near] for name, column in cracks.items()}, middle)
        left.set(title=f"{np.count_nonzero(near):,} of {len(near):,} cracks")
        near = np.abs(place[:, 1]) <= 2.0 * scene.radius
        draw_grains(right, place[near], grains["radius"][near], _colours(parts)[near], None)
        for axis in (left, right):
            axis.set(xlim=(-1e3 * half, 1e3 * half), ylim=(-0.08e3 * scene.height, 1.08e3 * scene.height), aspect="equal")
            axis.set(xlabel="x [mm]")
            axis.grid(False)
        left.set(ylabel="z [mm]")
        left.legend(handles=seen, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=len(seen) or 1, fontsize=7)
        right.set(title=f"{len(parts.number):,} fragments")
    return path


def _draw_cracks(axis, scene, cracks, middle):
    """Discs of the mean radius seen along y: ellipses. Returns handles for a legend."""
    place = np.stack([cracks[f"{name} [m]"] for name in "xyz"], axis=1) - middle
    normal = np.stack([cracks[f"n{name} [1]"] for name in "xyz"], axis=1)
    order = np.argsort(-place[:, 1], kind="stable")
    across = 2e3 * scene.radius
    angle = np.degrees(np.arctan2(normal[:, 2], normal[:, 0])) + 90.0
    mode = cracks["mode"].astype(int)
    discs = EllipseCollection(
        np.full(len(place), across),
        across * np.abs(normal[order, 1]),
        angle[order],
        units="xy",
        offsets=1e3 * place[order][:, (0, 2)],
        offset_transform=axis.transData,
        facecolors=[(*_rgb(COLOURS[number - 1]), 0.35) for number in mode[order]],
        edgecolors=[COLOURS[number - 1] for number in mode[order]],
        linewidths=0.4,
    )
    axis.add_collection(discs)
    there = [number for number in range(1, len(MODES) + 1) if (mode == number).any()]
    label = {number: f"{MODES[number - 1]} ({int((mode == number).sum()):,})" for number in there}
    return [Line2D([], [], color=COLOURS[number - 1], linewidth=2.0, label=label[number]) for number in there]


def _rgb(colour):
    return tuple(int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))


def _colours(parts):
    """A colour for each grain."""
    rank = parts.grains["rank"]
    of = [LARGEST[k] if k < len(LARGEST) and number >= FEWEST else OTHERS for k, number in enumerate(parts.number)]
    return np.array(of)[rank]
