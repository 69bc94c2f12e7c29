"""Friction and solid fraction of sheared grains over the inertial number, and laws through them.

mu(I) = mu_s + (mu_2 - mu_s) / (1 + I_0 / I): Jop, Forterre & Pouliquen, Nature 441, 727 (2006). phi(I) = phi_c - a I: GDR MiDi,
Eur. Phys. J. E 14, 341 (2004).
"""

from typing import NamedTuple

import numpy as np

#: Bends among which the best is looked for, before it is refined; where it stops.
_SOUGHT, _REFINED = np.concatenate([[0.0], np.geomspace(0.01, 1000.0, 200)]), 30


class Friction(NamedTuple):
    """mu(I) = ``mu_s`` + ``slope`` I / (1 + ``bend`` I), which is that of Jop et al. with mu_2 = mu_s + slope / bend and
    I_0 = 1 / bend, but a straight line, bend 0, is among them. ``errors``: standard errors of the three; ``miss``: root mean
    square of what it is fitted to less itself [1]."""

    mu_s: float
    slope: float
    bend: float
    errors: tuple = (0.0, 0.0, 0.0)
    miss: float = 0.0

    @property
    def determined(self):
        """Whether the rates reach far enough to tell mu_2 and I_0: the bend is three times its error at least."""
        return self.bend > 3.0 * self.errors[2]

    @property
    def mu_2(self):
        """Where it is fast [1]."""
        return self.mu_s + self.slope / self.bend

    @property
    def i_0(self):
        """Where it is half-way [1]."""
        return 1.0 / self.bend

    def at(self, inertial_number):
        """mu [1]."""
        return _jop(inertial_number, *self[:3])


class Filling(NamedTuple):
    """phi(I) = ``phi_c`` - ``slope`` I [1]; ``miss`` as that of ``Friction``."""

    phi_c: float
    slope: float
    miss: float = 0.0

    def at(self, inertial_number):
        """phi [1]."""
        return self.phi_c - self.slope * inertial_number


#: Of glass beads, from Jop et al. 2006: tan 20.9 deg, tan 32.8 deg.
GLASS_BEADS = Friction(0.382, (0.644 - 0.382) / 0.279, 1.0 / 0.279)


def friction_of(inertial_number, mu):
    """``Friction`` through measured ones by least squares; its errors are from how far they lie off it.

    Args:
        inertial_number, mu: (k,), at least four [1].

    >>> law = friction_of(np.array([0.01, 0.03, 0.1, 0.3]), GLASS_BEADS.at(np.array([0.01, 0.03, 0.1, 0.3])))
    >>> round(law.mu_s, 3), round(law.mu_2, 3), round(law.i_0, 3)
    (0.382, 0.644, 0.279)
    """
    lines = [_line(inertial_number, mu, bend) for bend in _SOUGHT]  # given the bend it is linear in the two others
    found = np.array([*min(lines, key=lambda line: line.miss)[:3]])
    for _ in range(_REFINED):  # Gauss-Newton
        slopes = _slopes(inertial_number, *found)
        off = mu - _jop(inertial_number, *found)
        found = found + np.linalg.lstsq(slopes, off, rcond=None)[0]
        found[2] = max(found[2], -0.5 / inertial_number.max())  # mu stays finite up to the largest I
    off = mu - _jop(inertial_number, *found)
    spread = np.linalg.pinv(slopes.T @ slopes) * float(off @ off) / (len(mu) - 3)
    return Friction(*found.tolist(), tuple(np.sqrt(np.diag(spread)).tolist()), float(np.sqrt(np.mean(off**2))))


def filling_of(inertial_number, solid_fraction):
    """``Filling`` through measured solid fractions by least squares.

    Args:
        inertial_number, solid_fraction: (k,), at least two [1].
    """
    slope, phi_c = np.polyfit(inertial_number, solid_fraction, 1)
    law = Filling(float(phi_c), float(-slope))
    return law._replace(miss=float(np.sqrt(np.mean((solid_fraction - law.at(inertial_number)) ** 2))))


def _jop(inertial_number, mu_s, slope, bend):
    return mu_s + slope * inertial_number / (1.0 + bend * inertial_number)


def _slopes(inertial_number, _, slope, bend):
    """What mu grows by with each of the three, (k, 3)."""
    share = inertial_number / (1.0 + bend * inertial_number)
    return np.stack([np.ones(len(share)), share, -slope * share**2], axis=1)


def _line(inertial_number, mu, bend):
    slope, mu_s = np.polyfit(inertial_number / (1.0 + bend * inertial_number), mu, 1)
    law = Friction(float(mu_s), float(slope), float(bend))
    return law._replace(miss=float(np.sqrt(np.mean((mu - law.at(inertial_number)) ** 2))))
