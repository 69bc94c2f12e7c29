"""How a flow along x moves over its depth."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.base import Result, flowing_rows, full_step, number, refuse_plane, sphere_volume, squared
from barchan.measure.sphere_cuts import bar_volume
from barchan.measure.sums import Bins, crossing, exact_sums


class Profile:
    """Profiles over z of the grains that are not frozen, in a slab across the flow.

    The slab is ``width`` long around x = ``station`` and as wide as the box, which is periodic along y or holds all grains;
    its bins are ``cell`` high, their edges at multiples of ``cell``. A grain counts in a bin with the part
    of its volume that lies there, cut by the planes of bin and slab in closed form: no error but rounding (grains that
    overlap count their overlap twice). A grain moves as a whole, with the velocity of its centre.

    The surface is the highest z at which the solid fraction, interpolated between the centres of bins, still is half its
    bulk value; the bulk value is the mean weighted by itself, sum of phi^2 / sum of phi, so that spray hardly counts. The
    surface speed is the mean speed half a cell below the surface, that of the uppermost layer one cell thick. The
    moving layer reaches from the surface down to where the mean speed first falls to 10 % of it, interpolated likewise; where it
    never does, to z = 0, the floor. It says little while the surface creeps, and is 0.0 when it is at rest.

    Args:
        station: x of the middle of the slab [length].
        width: length of the slab along x [length].
        cell: height of the bins [length]; a grain diameter or more, or layers show as waves of the solid fraction.

    All arrays are empty and all numbers 0.0 when no grain is in the slab.

    Raises:
        SceneError: an argument is not finite, or not positive where it must be.
    """

    z = Result("centres of the bins, from the lowest grain to the highest, (bins,) [length]")
    solid_fraction = Result("volume of grains over volume of the bin, (bins,)")
    velocity = Result("mean velocity along x, by mass, (bins,), 0.0 in an empty bin [length/time]")
    speed = Result("mean speed, by mass, (bins,), 0.0 in an empty bin [length/time]")
    temperature = Result("granular temperature, a third of the mean square of v - mean v, by mass, (bins,) [length^2/time^2]")
    surface_height = Result("z of the surface [length]")
    surface_speed = Result("mean speed of the uppermost layer [length/time]")
    moving_layer = Result("depth below the surface down to which the mean speed exceeds 10 % of the surface speed [length]")

    def __init__(self, station, width, cell):
        self.station = number("Profile: station", station)
        self.width, self.cell = number("Profile: width", width, positive=True), number("Profile: cell", cell, positive=True)

    def compute(self, sim):
        """Measure; returns self.

        Raises:
            SceneError: the slab leaves the box, or has more bins than can be counted, or the box has two dimensions.
        """
        refuse_plane(sim, "Profile")
        self._check(sim.box)
        rows, x = self._slab(sim)
        z, radius = sim.grains.view("position")[rows, 2], sim.grains.view("radius")[rows]
        top, bottom = sim.comm.maximum([(z + radius).max(initial=-np.inf), (radius - z).max(initial=-np.inf)])
        self._clear()
        if top > -bottom:
            bins = Bins.over(-bottom, top, self.cell)
            self._average(bins, self._sums(sim, bins, rows, x), self.cell * self.width * sim.box.length[1])
        if self.solid_fraction.any():
            self._find_surface()
        return self

    def _check(self, box):
        low, high = self.station - 0.5 * self.width, self.station + 0.5 * self.width
        beyond = 1e-9 * box.length[0]  # a slab as long as the box may exceed it by rounding
        if low < box.low[0] - beyond or high > box.high[0] + beyond:
            raise SceneError(
                f"Profile: the slab from x = {low:g} to {high:g} [length] leaves the box, {box.low[0]:g} to {box.high[0]:g}; "
                f"move the station or make the slab shorter"
            )

    def _slab(self, sim):
        """Rows of flowing grains that reach into the slab, with all their images, and x from its middle."""
        rows, half = flowing_rows(sim), 0.5 * self.width
        place, period = sim.grains.block("place")[rows], sim.box.length[0]
        images = (-period, 0.0, period) if sim.box.periodic[0] else (0.0,)
        x = np.concatenate([place[:, 0] - self.station + image for image in images])
        inside = np.flatnonzero(np.abs(x) < half + np.tile(place[:, 3], len(images)))
        return np.tile(rows, len(images))[inside], x[inside]

    def _sums(self, sim, bins, rows, x):
        """Volume, mass, momentum (3), mass times speed and times squared speed in each bin, (7, bins)."""
        place, mass = sim.grains.block("place")[rows], sim.grains.view("mass")[rows]
        z, radius = place[:, 2], place[:, 3]
        lowest = bins.index(z - radius)
        spanned = bins.index(z + radius) - lowest + 1
        grain = np.repeat(np.arange(len(rows)), spanned)  # an entry for each bin that a grain reaches into
        index = lowest[grain] + np.arange(len(grain)) - np.repeat(np.cumsum(spanned) - spanned, spanned)
        x, z, radius = x[grain], z[grain], radius[grain]
        a = ((-0.5 * self.width - x) / radius, (0.5 * self.width - x) / radius)
        b = ((bins.edges[index] - z) / radius, (bins.edges[index + 1] - z) / radius)
        volume = bar_volume(a, b) * (radius * radius * radius)
        share = mass[grain] * volume / sphere_volume(radius)
        velocity = full_step(sim, rows)[0]
        square = squared(velocity)
        moments = (*(velocity[:, c] for c in range(3)), np.sqrt(square), square)
        columns = (volume, share, *(share * moment[grain] for moment in moments))
        return exact_sums(columns, sim.comm, index, bins.count)

    def _average(self, bins, sums, room):
        volume, mass, *moments = sums
        some = np.where(mass > 0.0, mass, 1.0)
        vx, vy, vz, speed, square = (moment / some for moment in moments)
        self.z, self.solid_fraction = bins.centres, volume / room
        self.velocity, self.speed = vx, speed
        self.temperature = np.maximum(square - (vx * vx + vy * vy + vz * vz), 0.0) / 3.0

    def _find_surface(self):
        phi, cell = self.solid_fraction, self.cell
        half = 0.5 * (phi * phi).sum() / phi.sum()
        top = int(np.flatnonzero(phi >= half)[-1])
        self.surface_height = float(self.z[top] + cell * crossing(*np.append(phi, 0.0)[top : top + 2], half))
        some, uppermost = np.flatnonzero(phi), self.surface_height - 0.5 * cell
        self.surface_speed = float(np.interp(uppermost, self.z[some], self.speed[some]))
        if self.surface_speed > 0.0:
            deep = some[self.z[some] < uppermost]
            z, speed = np.append(self.z[deep], uppermost), np.append(self.speed[deep], self.surface_speed)
            self.moving_layer = max(self.surface_height - _still(z, speed), 0.0)

    def _clear(self):
        self.z = self.solid_fraction = self.velocity = self.speed = self.temperature = np.zeros(0)
        self.surface_height = self.surface_speed = self.moving_layer = 0.0


def _still(z, speed):
    """Highest z at which the speed is down to a tenth of the uppermost; 0.0, the floor, if none is above it."""
    slow = 0.1 * speed[-1]
    below = np.flatnonzero(speed[:-1] <= slow)
    if not len(below):
        return 0.0
    at = int(below[-1])
    return max(float(z[at] + (z[at + 1] - z[at]) * crossing(speed[at], speed[at + 1], slow)), 0.0)
