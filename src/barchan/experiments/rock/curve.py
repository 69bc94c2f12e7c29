"""The stress-strain curve of a specimen, and what is read from it: strength, Young's modulus, Poisson's ratio, balance."""

from typing import NamedTuple

import numpy as np

#: Between which parts of the strength the modulus and Poisson's ratio are secants.
SECANT = (0.1, 0.5)


class Curve(NamedTuple):
    """A test; stresses are positive in the sense of the test: compression where it is compressed [Pa].

    ``step``: (k,). ``displacement``: of the ends, together [m]. ``stress``: mean of both ends, (k,). ``unequal``: of the upper
    end less that of the lower, (k,). ``strain``: axial, of the middle part, in the sense of the test, (k,). ``lateral``: the
    mean of the two across, in the opposite sense: positive where a pressed specimen gets wider, or a pulled one narrower, (k,).
    """

    step: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
    unequal: np.ndarray
    strain: np.ndarray
    lateral: np.ndarray

    @classmethod
    def of(cls, table, test, area):
        """That of a table that was written during a ``test``; forces are shared by ``area`` [m^2]."""
        bottom, top = (table[f"force {end} [N]"] / area for end in ("bottom", "top"))
        sense = 1.0 if test == "tension" else -1.0
        strain = sense * table["axial strain [1]"]
        lateral = -0.5 * sense * (table["strain along x [1]"] + table["strain along y [1]"])
        return cls(table["step"], table["displacement [m]"], 0.5 * (bottom + top), top - bottom, strain, lateral)

    @property
    def peak(self):
        """Row of the largest stress."""
        return int(self.stress.argmax())

    @property
    def strength(self):
        """The largest stress [Pa]."""
        return float(self.stress[self.peak])

    @property
    def modulus(self):
        """Secant over the rise [Pa]; not a number where nothing rises."""
        (low, high), (begin, end) = self._at_secant(self.stress), self._at_secant(self.strain)
        return (high - low) / (end - begin) if end > begin else np.nan

    @property
    def poisson(self):
        """Poisson's ratio over the same part [1]."""
        (begin, end), (narrow, wide) = self._at_secant(self.strain), self._at_secant(self.lateral)
        return (wide - narrow) / (end - begin) if end > begin else np.nan

    @property
    def imbalance(self):
        """Mean difference of both ends on the rise, from a tenth of the strength to the strength, over the strength [1]."""
        begin = self._first_above(SECANT[0])
        rise = self.unequal[begin : self.peak + 1]
        return float(np.abs(rise).mean()) / self.strength if self.strength > 0.0 else np.inf

    @property
    def residual(self):
        """Stress at the end over the strength [1]."""
        return float(self.stress[-1]) / self.strength if self.strength > 0.0 else 1.0

    def _at_secant(self, column):
        """A column where the stress on the rise is first the two parts of the strength."""
        return tuple(float(np.interp(part, *self._around(part, column))) for part in SECANT)

    def _around(self, part, column):
        row = self._first_above(part)
        rows = [max(row - 1, 0), row]
        share = self.stress[rows] / self.strength if self.strength > 0.0 else np.zeros(2)
        return share, column[rows]

    def _first_above(self, part):
        return int(np.argmax(self.stress >= part * self.strength))
