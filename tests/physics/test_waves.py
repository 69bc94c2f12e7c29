"""Speeds of sound in crystals of spheres, from standing waves of 40 diameters: the moduli of the lattice, and pressure^(1/6).

SC: C11 = kn/D, C44 = kt/(2D); FCC: C11 = sqrt2 (kn + kt)/D, C12 = (kn - kt)/(sqrt2 D), C44 = (kn + kt)/(sqrt2 D), with grains
that are free to turn. What these leave out is of the order of 1e-3: (q D)^2/24 of a wave that is not infinitely long, the
overlap over the diameter, and the force over kn D.
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from crystals import DIAMETER, MASS, crystal

from barchan.measure import stress

#: Cells along and across.
COLUMNS = {"SC": (40, 3, 3), "FCC [100]": (29, 2, 2), "FCC [110]": (40, 3, 2)}

#: Stiffness k of waves along x with displacements along x, y and z, whose speed is D sqrt(k/m).
STIFFNESS = {
    "SC": lambda kn, kt: (kn, kt / 2.0, kt / 2.0),
    "FCC [100]": lambda kn, kt: (kn + kt, (kn + kt) / 2.0, (kn + kt) / 2.0),
    "FCC [110]": lambda kn, kt: ((5.0 * kn + 3.0 * kt) / 4.0, (kn + 3.0 * kt) / 4.0, (kn + kt) / 2.0),
}

#: Steps between looks, and largest strain of a wave over that of the contacts at rest.
LOOK, SMALL = 8, 1e-4


def speeds(sim, contact):
    """Of the three standing waves of one wavelength that run along x, with displacements along x, y and z, (3,) [m/s]."""
    grains, length = sim.grains, float(sim.box.length[0])
    q, slowest = 2.0 * pi / length, DIAMETER * sqrt(contact.kt / (2.0 * MASS))
    phase, size = q * (grains.position[:, 0] - sim.box.low[0]), SMALL * contact.overlap / DIAMETER * slowest
    grains.velocity = size * np.repeat(np.cos(phase)[:, None], 3, axis=1)
    turn = 0.5 * size * q * np.sin(phase)  # half the curl: no grain turns against its neighbourhood
    grains.omega = np.stack([np.zeros_like(turn), turn, -turn], axis=1)
    times, waves = [], []
    while sim.time < 1.5 * length / slowest:
        sim.run(LOOK)
        phase = q * (grains.position[:, 0] - sim.box.low[0])
        waves.append((grains.velocity * np.cos(phase)[:, None]).mean(axis=0))
        times.append(sim.time)
    return np.array([length / period(np.array(times), wave) for wave in np.array(waves).T])


def period(times, wave):
    """Time between the first zero of a wave and its third."""
    last = np.flatnonzero(wave[1:] * wave[:-1] < 0.0)
    zeros = times[last] - wave[last] * (times[last + 1] - times[last]) / (wave[last + 1] - wave[last])
    return zeros[2] - zeros[0]


@pytest.mark.parametrize("kind", list(COLUMNS))
def test_waves_are_as_fast_as_the_moduli_of_the_crystal_say(kind):
    found = []
    for pressure in (1e5, 1e6):
        sim, contact = crystal(kind, COLUMNS[kind], pressure)
        found.append(speeds(sim, contact))
        assert sim.box.length[0] > 39.9 * DIAMETER
        np.testing.assert_allclose(stress(sim).contact, pressure * np.eye(3), rtol=1e-3, atol=1e-3 * pressure)
        apart = DIAMETER - contact.overlap
        expected = apart * np.sqrt(np.array(STIFFNESS[kind](contact.kn, contact.kt)) / MASS)
        np.testing.assert_allclose(found[-1], expected, rtol=2e-3)
    np.testing.assert_allclose(np.log(found[1] / found[0]) / log(10.0), 1.0 / 6.0, atol=1e-3)


def test_the_stiffness_of_a_contact_is_that_of_the_published_example():
    """FCC of glass, 1 mm, under 100 kPa and 1 MPa: 749.93 and 530.28 m/s, 1100.75 and 778.35 m/s."""
    for pressure, fast, slow in ((1e5, 749.93, 530.28), (1e6, 1100.75, 778.35)):
        _, contact = crystal("FCC [100]", COLUMNS["FCC [100]"], pressure)
        expected = DIAMETER * np.sqrt(np.array(STIFFNESS["FCC [100]"](contact.kn, contact.kt)) / MASS)
        np.testing.assert_allclose(expected[:2], (fast, slow), rtol=5e-4)
