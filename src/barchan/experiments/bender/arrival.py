"""When a pulse arrives, by the methods that laboratories use, and how fast the wave then is.

All times are those that passed since the same feature of the pulse that was sent. Sources: of the methods and their names,
Viggiani & Atkinson, Geotechnique 45, 149 (1995); of speeds from phases, Sachse & Pao, J. Appl. Phys. 49, 4320 (1978).
"""

from math import asin, pi
from typing import NamedTuple

import numpy as np

#: Share of the largest velocity that counts as the first deflection.
DEFLECTION = 0.05

#: Methods by which arrivals are found, in the order of ``arrivals``.
METHODS = ("first deflection", "peak to peak", "zero crossing", "cross-correlation")


class Line(NamedTuple):
    """A straight line through arrivals: speed [m/s] with its standard error, and the time at distance 0 [s]."""

    speed: float
    error: float
    start: float


def arrivals(time, signal, sent, frequency):
    """Travel times by each of ``METHODS``, (4,) [s]; not a number where there is none.

    Args:
        time: since the beginning of the pulse, evenly spaced, (n,) [s].
        signal: velocity of a receiver, (n,).
        sent: the pulse at these times, (n,).
        frequency: of the pulse, one sine [1/s].
    """
    top = int(np.argmax(signal))
    begun = np.flatnonzero(signal[: top + 1] >= DEFLECTION * signal[top])
    after = np.flatnonzero(signal[top:] <= 0.0)
    step = time[1] - time[0]
    overlap = np.correlate(signal, sent, "full")
    lag = int(np.argmax(overlap))
    return np.array(
        [
            _between(time, signal, int(begun[0]), DEFLECTION * signal[top]) - asin(DEFLECTION) / (2.0 * pi * frequency),
            time[top] + _summit(signal, top) * step - 0.25 / frequency,
            _between(time, signal, top + int(after[0]), 0.0) - 0.5 / frequency if len(after) else np.nan,
            (lag - (len(sent) - 1) + _summit(overlap, lag)) * step,
        ]
    )


def line(distance, time):
    """The ``Line`` through arrivals at distances, by least squares; None through fewer than three.

    >>> line([1.0, 2.0, 3.0], [0.6, 1.1, 1.6]).speed
    2.0
    """
    distance, time = np.asarray(distance), np.asarray(time)
    known = np.isfinite(time)
    if known.sum() < 3:
        return None
    x, t = distance[known] - distance[known].mean(), time[known]
    slowness = float((x * t).sum() / (x * x).sum())
    left = t - t.mean() - slowness * x
    error = float(np.sqrt((left**2).sum() / ((len(t) - 2) * (x * x).sum())))
    return Line(1.0 / slowness, error / slowness**2, float(t.mean() - slowness * distance[known].mean()))


def phase_speeds(distance, time, signals, frequencies):
    """Speeds of the phase at frequencies, from how it falls behind with distance; (k,) [m/s].

    Args:
        distance: of the receivers, ascending, nearer to each other than half a wavelength, (r,) [m].
        time: evenly spaced, (n,) [s].
        signals: (r, n), which begin and end with rest.
        frequencies: (k,) [1/s].
    """
    phase = np.unwrap(np.angle(spectra(time, signals, frequencies)), axis=0)
    x = distance - distance.mean()
    return -2.0 * pi * frequencies * (x * x).sum() / (x[:, None] * phase).sum(axis=0)


def spectra(time, signals, frequencies):
    """Fourier integrals of signals (r, n) at frequencies (k,): (r, k)."""
    return signals @ np.exp(-2j * pi * np.outer(time, frequencies)) * (time[1] - time[0])


def _between(time, signal, index, value):
    """When the signal takes a value on its way to a point from the one before [s]."""
    if index == 0:
        return float(time[0])
    before, here = signal[index - 1], signal[index]
    return float(time[index] - (here - value) / (here - before) * (time[index] - time[index - 1]))


def _summit(values, index):
    """How far the top of the parabola through a maximum and its neighbours is from it, in points."""
    if not 0 < index < len(values) - 1:
        return 0.0
    before, here, after = values[index - 1 : index + 2]
    bend = before - 2.0 * here + after
    return float(0.5 * (before - after) / bend) if bend else 0.0
