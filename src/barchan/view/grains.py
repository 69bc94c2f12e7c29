"""Grains as discs: of three dimensions seen from the side, of two as they are."""

import numpy as np
from matplotlib.collections import EllipseCollection

from barchan.view.style import COLOUR_MAP


def draw_plane(axes, box, position, radius, values, limits=None, scale=1e3, unit="mm"):
    """Draw grains of a two-dimensional box in the x-y plane: all of the box, in one scale along both axes.

    Args:
        axes, position, radius, values, limits, scale: as ``draw_grains`` takes them.
        box: of the simulation.
        unit: of the axes.

    Returns:
        What a colour bar takes.
    """
    discs = draw_grains(axes, position[:, (0, 2, 1)], radius, values, limits, scale)
    (left, bottom, _), (right, top, _) = scale * box.low, scale * box.high
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    return discs


def draw_grains(axes, position, radius, values, limits, scale=1e3):
    """Draw grains in the x-z plane as seen along +y, near ones over far ones, coloured by ``values``.

    Args:
        axes: of matplotlib.
        position: (k, 3) [length]. radius: (k,) [length].
        values: (k,) to colour by, or a colour for all, or (k,) colours.
        limits: (lowest, highest) value of the colours; None with colours.
        scale: from [length] to the unit of the axes; 1000 for metres shown in mm.

    Returns:
        What a colour bar takes.
    """
    order = np.argsort(-position[:, 1], kind="stable")
    diameter = 2.0 * scale * radius[order]
    discs = EllipseCollection(
        diameter,
        diameter,
        np.zeros(len(diameter)),
        units="xy",
        offsets=scale * position[order][:, (0, 2)],
        offset_transform=axes.transData,
        linewidths=0.0,
    )
    if limits is None:
        discs.set_facecolor(values if isinstance(values, str) else np.asarray(values)[order])
    else:
        discs.set(array=np.asarray(values)[order], cmap=COLOUR_MAP, clim=limits)
    axes.add_collection(discs)
    return discs
