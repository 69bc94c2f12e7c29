"""How waves in grains slow down as they get shorter, and what bounds that puts on arrivals.

Layers of a simple cubic crystal, h = d apart, have omega = 2 sqrt(k/m) sin(q h/2): with x = q h/2 the phase runs at
sin(x)/x, the group, which carries the energy, at cos(x) of the speed of long waves. A random packing is described by the same
law with a longer h, which its speeds of the phase tell. Source: Brillouin, Wave Propagation in Periodic Structures (1946),
chapter 1.
"""

from math import cos, pi, sqrt
from typing import NamedTuple

import numpy as np


class Dispersion(NamedTuple):
    """``long``: speed of the longest waves [m/s]; ``spacing``: of the layers that disperse alike, h [m]."""

    long: float
    spacing: float

    def group(self, frequency, speed):
        """Speed of the group at a frequency [1/s], where the phase has this speed [m/s]; [m/s]."""
        return self.long * cos(min(pi * frequency * self.spacing / speed, 0.5 * pi))

    def outside(self, frequency, speed, arrival):
        """By what share the speed of an arrival [m/s] is above that of long waves, or below that of the group; 0 between.

        Args:
            frequency: of the pulse [1/s].
            speed: of the phase at that [m/s].
        """
        return max(arrival / self.long - 1.0, 1.0 - arrival / self.group(frequency, speed), 0.0)


def dispersion(frequencies, speeds):
    """The ``Dispersion`` of speeds of the phase (k,) [m/s] at frequencies (k,) [1/s], by least squares.

    The line is c = c0 (1 - (q h)^2/24), of waves much longer than h; h = 0 where shorter waves are no slower.
    """
    square = (2.0 * np.pi * frequencies / speeds) ** 2
    slope, long = np.polyfit(square, speeds, 1)
    if slope >= 0.0:
        return Dispersion(float(np.mean(speeds)), 0.0)
    return Dispersion(float(long), sqrt(-24.0 * slope / long))
