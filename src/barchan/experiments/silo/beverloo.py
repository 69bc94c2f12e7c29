"""The mass flow through an outlet, and the law of Beverloo, Leniger & van de Velde (1961) through several.

W = C rho_b sqrt(g) (D0 - k d)^(5/2) (Chem. Eng. Sci. 15, 260): mass flow W, bulk density rho_b, diameters of outlet D0 and of
grains d.
"""

from typing import NamedTuple

import numpy as np

#: Power of D0 - k d.
EXPONENT = 2.5

#: k of the literature, with which the exponent is looked at.
USUAL_K = 1.4

#: Parts of a steady flow whose slopes give its error.
PARTS = 5


class Flow(NamedTuple):
    """A steady mass flow: ``rate`` and its standard ``error`` [kg/s], from time ``begin`` to ``end`` [s], of so many
    ``grains``."""

    rate: float
    error: float
    begin: float
    end: float
    grains: int


class Beverloo(NamedTuple):
    """The law through several flows: constants ``c`` and ``k`` with their standard errors [1], ``r_squared`` of W, and the
    ``exponent`` of D0 - ``USUAL_K`` d that the flows themselves have."""

    c: float
    c_error: float
    k: float
    k_error: float
    r_squared: float
    exponent: float

    def rate(self, outlet, bulk_density, gravity, diameter):
        """Mass flow that the law says [kg/s]."""
        return self.c * bulk_density * gravity**0.5 * np.maximum(outlet - self.k * diameter, 0.0) ** EXPONENT


def steady(time, mass, filled, begin, most):
    """The flow out of a silo, or None if there was too little of it.

    Args:
        time, mass: (k,) when each grain left [s], and its mass [kg].
        filled: mass in the silo at the opening [kg].
        begin: time at which the flow counts as developed [s].
        most: share of ``filled`` of which it is taken: below, the surface comes near the outlet.
    """
    order = np.argsort(time, kind="stable")
    time, gone = time[order], np.cumsum(mass[order])
    within = (time >= begin) & (gone <= most * filled)
    if within.sum() < 5 * PARTS:
        return None
    time, gone = time[within], gone[within]
    slope = np.polyfit(time, gone, 1)[0]
    parts = np.linspace(time[0], time[-1], PARTS + 1)
    slopes = np.diff(np.interp(parts, time, gone)) / np.diff(parts)
    error = slopes.std(ddof=1) / PARTS**0.5
    return Flow(float(slope), float(error), float(time[0]), float(time[-1]), len(time))


def fit(outlet, rate, bulk_density, gravity, diameter):
    """The law through flows, by least squares of W^(2/5), which is straight in D0.

    Args:
        outlet: (k,) diameters of the outlets, at least three [m].
        rate: (k,) mass flows [kg/s].
        bulk_density: [kg/m^3]. gravity: [m/s^2]. diameter: of the grains [m].
    """
    (slope, origin), spread = np.polyfit(outlet, rate ** (1.0 / EXPONENT), 1, cov=True)
    c, k = slope**EXPONENT / (bulk_density * gravity**0.5), -origin / (slope * diameter)
    to_k = np.array([-k / slope, -1.0 / (slope * diameter)])  # how k changes with slope and origin
    errors = EXPONENT * c * spread[0, 0] ** 0.5 / slope, (to_k @ spread @ to_k) ** 0.5
    exponent = np.polyfit(np.log(outlet - USUAL_K * diameter), np.log(rate), 1)[0]
    law = Beverloo(*map(float, (c, errors[0], k, errors[1], 0.0, exponent)))
    rest = rate - law.rate(outlet, bulk_density, gravity, diameter)
    return law._replace(r_squared=float(1.0 - (rest**2).sum() / ((rate - rate.mean()) ** 2).sum()))
