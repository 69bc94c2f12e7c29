"""When the neighbour list must be rebuilt.

Stale when a pair that is not in the list could touch: when two grains, or a grain and a wall, may have approached by more
than the skin since the last rebuild. Two bounds on the approach hold, and the smaller counts: twice the largest
displacement, and the diagonal of the box that holds all displacements. The second lets a flow that moves as a whole go
further (along a chute it halves the rebuilds). Both cost a pass over the grains, so they are asked for only when a third,
the sum of twice the largest speeds, no longer tells that the list is good.
"""

from math import sqrt

import numpy as np


class Staleness:
    """Watches displacements; remembers what the summary prints.

    Attributes:
        also_when: function of the step that asks for more rebuilds than needed, or None. It changes no bit.
        rebuilds: how many rebuilds there were.
        bound_13: shortest interval in steps that equation (13) would have allowed, c - d_max = skin: skin / (2 v_max dt).
        intervals: steps between rebuilds: (shortest, sum).
        approach: bound on the approach of two surfaces since the rebuild [length].
    """

    def __init__(self):
        self.also_when = None
        self.rebuilds, self.bound_13, self.shortest, self.total = 0, np.inf, np.inf, 0
        self.last_step, self.approach, self._deformed = None, 0.0, np.eye(3)
        self._widest = 0.0

    def remember(self, step):
        """Note a rebuild at ``step``."""
        if self.last_step is not None and step > self.last_step:
            self.shortest = min(self.shortest, step - self.last_step)
            self.total += step - self.last_step
            self.rebuilds += 1
        self.last_step, self.approach, self._deformed = step, 0.0, np.eye(3)

    def restart(self):
        """Do not count the interval that ends with a change of the scene."""
        self.last_step = None

    def wants_rebuild(self, step):
        """True if more rebuilds were asked for than are needed, and one is due at ``step``."""
        return self.also_when is not None and bool(self.also_when(step))

    @staticmethod
    def allowed(skin):
        """How far two surfaces may approach."""
        return float(skin * (1.0 - 1e-9))

    @property
    def nearer(self):
        """Bound on the approach of two surfaces since the rebuild, by what they moved and as the box shrank [length]."""
        return self.approach + (1.0 - min(_stretches(self._deformed)[1], 1.0)) * self._widest

    def squeeze(self, gradient, cutoff):
        """Note that the box, and all distances with it, were deformed so (3, 3) in this step. Of pairs that are not listed,
        those whose centres were a ``cutoff`` apart come closest, and what they had approached before may grow, too."""
        self._deformed, self._widest = gradient @ self._deformed, cutoff
        self.approach *= max(1.0, _stretches(gradient)[0])

    def advance(self, speed, skin, dt):
        """Take a step of ``dt``, in which nothing was faster than ``speed``, into the bounds: of the approach, and of equation
        (13)."""
        self.take(self.approach + 2.0 * speed * dt, speed, skin, dt)

    def take(self, approach, speed, skin, dt):
        """Take ``approach`` as the bound of now; since then no step of ``dt`` saw anything faster than ``speed``."""
        self.approach = approach
        if speed > 0.0 and dt > 0.0:
            self.bound_13 = min(self.bound_13, skin / (2.0 * speed * dt))

    def measure(self, displacements, farthest):
        """Take the bounds of the present positions instead.

        Args:
            displacements: (6,) largest along x, -x, y, -y, z, -z.
            farthest: the largest.
        """
        spread = np.asarray(displacements).reshape(3, 2).sum(axis=1)
        self.approach = min(2.0 * farthest, sqrt(float((spread**2).sum())))


def _stretches(gradient):
    """The largest and the least factor by which a length grows."""
    if np.array_equal(gradient, np.eye(3)):
        return 1.0, 1.0
    if not (gradient - np.diag(np.diag(gradient))).any():
        return float(gradient.max()), float(np.diag(gradient).min())
    factors = np.linalg.svd(gradient, compute_uv=False)
    return float(factors[0]), float(factors[-1])
