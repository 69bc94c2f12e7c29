"""What a pulse was heard as: the signals of a run, and the speeds that they tell."""

from typing import NamedTuple

import numpy as np

from barchan.experiments.bender.arrival import METHODS, arrivals, line, phase_speeds, spectra
from barchan.experiments.bender.dispersion import dispersion
from barchan.experiments.bender.elastic import affine_speeds, crystal_speeds
from barchan.writers import read_table

#: Receivers nearer than this to the layer that is shaken, in mean diameters, hear how it pushes, not a wave.
NEAR = 4.0

#: Periods that have to be heard after the first peak: the trough, and what lags behind it.
AFTER = 1.1

#: Frequencies at which the speed of the phase is told, over that of the pulse, and the share of the largest amplitude that the
#: last receiver has to hear of them.
BAND, AUDIBLE = np.linspace(0.5, 1.4, 37), 0.3

_COLUMNS = ("distance [m]", "velocity [m/s]")


class Wave(NamedTuple):
    """A pulse as receivers heard it.

    ``shot``: the ``Shot``. ``sample``: the row of the table of pulses, name of a column -> number. ``time``: since the pulse
    began, (n,) [s]. ``distance``: of the receivers, (r,) [m]. ``velocity``: along the axis of the pulse, (r, n) [m/s].
    ``limit``: until when only the wave on the shorter way is heard, (r,) [s]. ``heard``: (r,) bool, which receivers hear all of
    it by then. ``arrivals``: (k, methods) [s] at those. ``lines``: name of a method -> ``Line``, or None. ``theory``: [m/s].
    """

    shot: object
    sample: dict
    time: np.ndarray
    distance: np.ndarray
    velocity: np.ndarray
    limit: np.ndarray
    heard: np.ndarray
    arrivals: np.ndarray
    lines: dict
    theory: float

    @property
    def clean(self):
        """Velocities of the receivers that hear the wave, nothing after their limit, (k, n) [m/s]."""
        return np.where(self.time <= self.limit[:, None], self.velocity, 0.0)[self.heard]

    def phases(self, frequencies):
        """Speeds of the phase at frequencies (k,) [m/s]; None where too few receivers hear it."""
        if self.heard.sum() < 3:
            return None
        return phase_speeds(self.distance[self.heard], self.time, self.clean, np.asarray(frequencies))

    @property
    def band(self):
        """Frequencies of ``BAND`` that the last receiver hears well enough, (k,) [1/s]."""
        frequencies = BAND * self.shot.frequency
        amplitude = np.abs(spectra(self.time, self.clean[-1:], frequencies))[0]
        return frequencies[amplitude >= AUDIBLE * amplitude.max()]

    @property
    def speed(self):
        """That of the phase at the frequency of the pulse, on which no choice of a point of the signal has a part [m/s]; or
        None."""
        found = self.phases([self.shot.frequency])
        return None if found is None else float(found[0])

    @property
    def dispersion(self):
        """The ``Dispersion`` of its phases; for a wave that has a ``speed``."""
        return dispersion(self.band, self.phases(self.band))


def waves(scene, directory):
    """The ``Wave`` of each pulse that was listened to.

    Raises:
        ResultError: a table is damaged.
    """
    paths = [directory / "tables" / f"{name}.csv" for name in ("pulses", "signals")]
    if not all(path.exists() for path in paths):
        return []
    pulses, signals = map(read_table, paths)
    found = []
    for number, shot in enumerate(scene.shots):
        rows, begun = signals["shot"] == number, np.flatnonzero(pulses["step"] == shot.begin + 1)
        steps = np.unique(signals["step"][rows])
        if len(begun) and len(steps) > 2 and len(set(np.diff(steps))) == 1:
            sample = {name: float(column[begun[0]]) for name, column in pulses.items()}
            columns = [signals[name][rows].reshape(len(steps), -1).T for name in _COLUMNS]
            found.append(_heard(scene, shot, sample, (steps - shot.begin) * scene.dt, columns))
    return found


def predicted(scene, sample):
    """``Speeds`` by theory: those of the crystal, or of a random packing all of whose grains move with it."""
    if scene.packing == "fcc":
        return crystal_speeds(scene)
    pressure = np.mean([sample[f"stress {axis} [Pa]"] for axis in "xyz"])
    return affine_speeds(scene, sample["solid fraction [1]"], sample["coordination"], pressure)


def _heard(scene, shot, sample, time, columns):
    """Looks twice: who hears the wave on the shorter way only is known once its speed is; theory is faster than any."""
    distance, velocity = columns[0][:, 0], columns[1]
    theory = predicted(scene, sample).of(shot.kind)
    sent, fastest = scene.pulse(shot.frequency, time), theory
    for _ in range(2):
        limit = np.minimum((sample["edge z [m]"] - distance) / fastest, time[-1])
        times = np.full((len(distance), len(METHODS)), np.nan)
        for number in np.flatnonzero(distance >= NEAR * scene.diameter):
            until = int(np.searchsorted(time, limit[number], side="right"))
            if until > 2 and velocity[number, :until].max() > 0.0:
                times[number] = arrivals(time[:until], velocity[number, :until], sent[:until], shot.frequency)
        heard = times[:, 1] + (0.25 + AFTER) / shot.frequency <= limit
        first = line(distance[heard], times[heard, 0])
        fastest = min(first.speed, theory) if first is not None and first.speed > 0.0 else theory
    lines = {name: line(distance[heard], column) for name, column in zip(METHODS, times[heard].T)}
    return Wave(shot, sample, time, distance, velocity, limit, heard, times[heard], lines, theory)
