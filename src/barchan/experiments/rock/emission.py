"""Acoustic emission: breaks that belong together make one event, as a microphone would hear it."""

from typing import NamedTuple

import numpy as np

#: Fewest events of which the slope of their distribution is told.
FEWEST = 50


class Events(NamedTuple):
    """Events by ascending time of their first break.

    ``time``: (k,) [s]. ``breaks``: (k,) bonds that broke in each. ``energy``: (k,) that these bonds had stored [J].
    """

    time: np.ndarray
    breaks: np.ndarray
    energy: np.ndarray

    @property
    def magnitude(self):
        """log10 of the energy in J, (k,)."""
        return np.log10(self.energy)

    @property
    def slope(self):
        """Exponent b of N(magnitude >= M) ~ 10^(-b M) from the most frequent magnitude on, by maximum likelihood, and its
        standard error; not numbers where fewer than ``FEWEST`` are that large. Source: Aki, Bull. Earthq. Res. Inst. 43, 237
        (1965)."""
        low = self.complete
        large = self.magnitude[self.magnitude >= low]
        if len(large) < FEWEST:
            return np.nan, np.nan
        b = np.log10(np.e) / (large.mean() - low)
        return float(b), float(b / np.sqrt(len(large)))

    @property
    def complete(self):
        """The most frequent magnitude, in a histogram: below it events are missing, for a bond has a least energy."""
        counts, edges = histogram(self.magnitude)
        return float(edges[counts.argmax()]) if len(counts) else np.nan


def histogram(magnitude, width=0.25):
    """Counts (k,) and edges (k + 1,) of bins of one ``width``; none without events."""
    if not len(magnitude):
        return np.zeros(0, dtype=int), np.zeros(0)
    first, last = np.floor(magnitude.min() / width), np.floor(magnitude.max() / width) + 1
    edges = width * np.arange(first, last + 1)
    return np.histogram(magnitude, edges)[0], edges


def events(time, place, energy, near, soon):
    """Breaks that are nearer than ``near`` [m] and follow each other sooner than ``soon`` [s] belong to one event, and so do
    those that others link. Source of the idea: Hazzard & Young, Int. J. Rock Mech. Min. Sci. 37, 867 (2000).

    Args:
        time: (n,) of the breaks, ascending [s]. place: (n, 3) [m]. energy: (n,) that each bond had stored [J].

    Returns:
        ``Events``.
    """
    label = np.arange(len(time))
    until = np.searchsorted(time, time + soon, side="right")
    for one, end in enumerate(until):
        others = np.arange(one + 1, end)
        linked = others[((place[others] - place[one]) ** 2).sum(axis=1) <= near**2]
        labels = np.unique(label[[one, *linked]])
        if len(labels) > 1:
            label[np.isin(label, labels)] = labels[0]
    first, number = np.unique(label, return_inverse=True)
    return Events(time[first], np.bincount(number), np.bincount(number, weights=energy, minlength=len(first)))
