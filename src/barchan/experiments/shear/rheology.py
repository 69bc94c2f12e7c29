"""Friction and solid fraction of sheared grains over the inertial number, and laws through them.

mu(I) = mu_s + (mu_2 - mu_s) / (1 + I_0 / I): Jop, Forterre & Pouliquen, Nature 441, 727 (2006). phi(I) = phi_c - a I: GDR MiDi,
Eur. Phys. J. E 14, 341 (2004).
"""

from typing import NamedTuple

import numpy as np

#: Where I_0 is looked for: by steps of 2 %.
_SOUGHT = np.geomspace(1e-3, 10.0, 466)


class Friction(NamedTuple):
    """mu(I), from ``mu_s`` where it is slow to ``mu_2`` where it is fast, half-way at ``i_0`` [1]. ``miss``: root mean square of
    what it is fitted to less itself [1]."""

    mu_s: float
    mu_2: float
    i_0: float
    miss: float = 0.0

    def at(self, inertial_number):
        """mu [1]."""
        return self.mu_s + (self.mu_2 - self.mu_s) / (1.0 + self.i_0 / inertial_number)


class Filling(NamedTuple):
    """phi(I) = ``phi_c`` - ``slope`` I [1]; ``miss`` as that of ``Friction``."""

    phi_c: float
    slope: float
    miss: float = 0.0

    def at(self, inertial_number):
        """phi [1]."""
        return self.phi_c - self.slope * inertial_number


#: Of glass beads, from Jop et al. 2006: tan 20.9 deg, tan 32.8 deg.
GLASS_BEADS = Friction(0.382, 0.644, 0.279)


def friction_of(inertial_number, mu):
    """``Friction`` through measured ones by least squares.

    Args:
        inertial_number, mu: (k,), at least three [1].

    >>> law = friction_of(np.array([0.01, 0.03, 0.1, 0.3]), GLASS_BEADS.at(np.array([0.01, 0.03, 0.1, 0.3])))
    >>> round(law.mu_s, 3), round(law.mu_2, 2), round(law.i_0, 2)
    (0.382, 0.64, 0.28)
    """
    best = None
    for i_0 in _SOUGHT:  # given I_0 it is linear in the two others
        share = 1.0 / (1.0 + i_0 / inertial_number)
        rise, mu_s = np.polyfit(share, mu, 1)
        miss = float(np.sqrt(np.mean((mu - mu_s - rise * share) ** 2)))
        if best is None or miss < best.miss:
            best = Friction(float(mu_s), float(mu_s + rise), float(i_0), miss)
    return best


def filling_of(inertial_number, solid_fraction):
    """``Filling`` through measured solid fractions by least squares.

    Args:
        inertial_number, solid_fraction: (k,), at least two [1].
    """
    slope, phi_c = np.polyfit(inertial_number, solid_fraction, 1)
    law = Filling(float(phi_c), float(-slope))
    return law._replace(miss=float(np.sqrt(np.mean((solid_fraction - law.at(inertial_number)) ** 2))))
