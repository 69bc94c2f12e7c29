"""How far a flow has come."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.base import Result, flowing_rows, number, refuse_plane, sphere_volume
from barchan.measure.sums import Bins, crossing, exact_sums, quantile


class Front:
    """Front of the grains that are not frozen, in a flow along +x.

    The flow is cut into columns ``cell`` wide. The thickness of a column is the volume of the grains whose centres it holds
    over its floor area, cell times the width of the box. The front is where the thickness falls below
    ``thickness``, on the way in +x from the thickest column, so that grains that fly ahead of the connected mass do
    not count. Between the centres of columns the thickness is interpolated: exact where it varies linearly; at a
    vertical face the front comes out up to half a cell too far, but never beyond the foremost grain.

    Args:
        origin: x from which positions count [length].
        cell: width of a column [length]; some grain diameters.
        thickness: at the front, volume per floor area [length]; default: mean volume of a grain over its mean diameter
            squared, one grain on each square of floor of the mean diameter (pi/6 d for equal grains).

    All results are 0.0 when no grain flows, and ``position`` is when no column is that thick.

    Raises:
        SceneError: an argument is not finite, or not positive where it must be.
    """

    position = Result("front of the connected mass, from the origin [length]")
    foremost = Result("centre of the farthest grain, spray and all, from the origin [length]")
    mass_99 = Result("x below which 99 % of the flowing volume lies, from the origin; error below a cell [length]")

    def __init__(self, origin, cell, thickness=None):
        self.origin, self.cell = number("Front: origin", origin), number("Front: cell", cell, positive=True)
        self.thickness = None if thickness is None else number("Front: thickness", thickness, positive=True)

    def compute(self, sim):
        """Measure; returns self.

        Raises:
            SceneError: the box is periodic along x, or has more columns than can be counted, or two dimensions.
        """
        refuse_plane(sim, "Front")
        if sim.box.periodic[0]:
            raise SceneError("Front: the box is periodic along x; a flow without end has no front")
        rows = flowing_rows(sim)
        x, radius = sim.grains.view("position")[rows, 0] - self.origin, sim.grains.view("radius")[rows]
        columns = Bins.over(sim.box.low[0] - self.origin, sim.box.high[0] - self.origin, self.cell)
        volume, diameter, count = exact_sums(
            (sphere_volume(radius), 2.0 * radius, np.ones(len(rows))), sim.comm, columns.index(x), columns.count
        )
        farthest = float(sim.comm.maximum([x.max(initial=-np.inf)])[0])
        self.foremost = farthest if np.isfinite(farthest) else 0.0
        self.mass_99 = min(quantile(columns, volume, 0.99), self.foremost)
        least = self.thickness
        if least is None and count.sum():
            least = volume.sum() * count.sum() / diameter.sum() ** 2
        thickness = volume / (self.cell * sim.box.length[1])
        found = count.sum() and thickness.max() >= least
        self.position = min(_front(columns, thickness, least), self.foremost) if found else 0.0
        return self


def _front(columns, thickness, least):
    """Where the thickness falls below ``least`` beyond the thickest column."""
    thickest = int(np.argmax(thickness))
    falling = np.append(thickness[thickest:], 0.0)
    last = int(np.argmax(falling < least)) - 1
    step = crossing(falling[last], falling[last + 1], least)
    return float(columns.centres[thickest + last] + columns.cell * step)
