"""Grains as discs, seen from the side."""

import numpy as np
from matplotlib.collections import EllipseCollection

from barchan.view.style import COLOUR_MAP


def draw_grains(axes, position, radius, values, limits, scale=1e3):
    """Draw grains in the x-z plane as seen along +y, near ones over far ones, coloured by ``values``.

    Args:
        axes: of matplotlib.
        position: (k, 3) [length]. radius: (k,) [length].
        values: (k,) to colour by, or one colour for all.
        limits: (lowest, highest) value of the colours; None with one colour.
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
        discs.set_facecolor(values)
    else:
        discs.set(array=np.asarray(values)[order], cmap=COLOUR_MAP, clim=limits)
    axes.add_collection(discs)
    return discs
