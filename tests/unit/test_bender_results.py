"""Arrivals and speeds from signals that are known, and theory of elastic packings against sums over directions."""

import numpy as np
import pytest

from barchan.experiments.bender import Bender
from barchan.experiments.bender.arrival import METHODS, arrivals, line, phase_speeds
from barchan.experiments.bender.dispersion import dispersion
from barchan.experiments.bender.elastic import affine_speeds, contact, crystal_speeds

SCENE, FREQUENCY = Bender(), 20e3
TIME = np.arange(1, 500) * 0.5e-6


@pytest.mark.parametrize("late", [10e-6, 31.3e-6, 87.77e-6])
def test_a_pulse_that_only_comes_later_is_so_late_by_every_method(late):
    sent = SCENE.pulse(FREQUENCY, TIME)
    found = arrivals(TIME, 1e-6 * SCENE.pulse(FREQUENCY, TIME - late), sent, FREQUENCY)
    assert dict(zip(METHODS, found)) == pytest.approx(dict.fromkeys(METHODS, late), abs=2e-8)


def test_a_line_through_arrivals_tells_speed_and_error():
    distance = np.array([1.0, 2.0, 3.0, 4.0])
    exact = line(distance, 0.5 + distance / 250.0)
    assert (exact.speed, exact.start) == pytest.approx((250.0, 0.5)) and exact.error < 1e-9
    rough = line(distance, distance / 250.0 + 1e-4 * np.array([1.0, -1.0, -1.0, 1.0]))
    assert rough.speed == pytest.approx(250.0)
    assert rough.error / 250.0**2 == pytest.approx(np.sqrt(4e-8 / (2 * 5.0))), "residuals over the spread of distances"
    assert line(distance, [1.0, np.nan, 2.0, np.nan]) is None


def test_speeds_of_the_phase_are_those_of_a_wave_that_disperses():
    """Of each frequency its own: k = w/c (1 + a w^2)."""
    speed, bend, distance = 300.0, 4e-13, np.arange(3e-3, 30e-3, 2e-3)
    time = np.arange(4096) * 0.5e-6
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(time), 0.5e-6)
    spectrum = np.fft.rfft(SCENE.pulse(FREQUENCY, time)) * np.exp(-((omega / 5e5) ** 2))
    wave = omega / speed * (1.0 + bend * omega**2)
    signals = np.fft.irfft(spectrum * np.exp(-1j * wave * distance[:, None]), len(time))
    frequencies = np.array([10e3, 20e3, 30e3])
    expected = speed / (1.0 + bend * (2.0 * np.pi * frequencies) ** 2)
    assert phase_speeds(distance, time, signals, frequencies) == pytest.approx(expected, rel=1e-3)


def test_a_simple_cubic_crystal_bounds_its_arrivals():
    """omega = 2 sqrt(k/m) sin(q d/2): the group runs at cos(q d/2) of the speed of long waves, d sqrt(k/m)."""
    d, rate = 1e-3, 4e5
    q = np.linspace(100.0, 500.0, 30)
    omega = 2.0 * rate * np.sin(0.5 * q * d)
    found = dispersion(omega / (2.0 * np.pi), omega / q)
    assert (found.long, found.spacing) == pytest.approx((d * rate, d), rel=5e-3)
    frequency, speed = omega[20] / (2.0 * np.pi), omega[20] / q[20]
    group = d * rate * np.cos(0.5 * q[20] * d)
    assert group == pytest.approx((omega[21] - omega[19]) / (q[21] - q[19]), rel=1e-4)
    assert found.group(frequency, speed) == pytest.approx(group, rel=2e-3)
    shares = [found.outside(frequency, speed, arrival) for arrival in (speed, 1.05 * d * rate, 0.9 * group)]
    assert shares == pytest.approx([0.0, 0.05, 0.1], abs=4e-3)
    assert dispersion(frequency * np.array([1.0, 2.0]), np.array([300.0, 310.0])).spacing == 0.0


def test_the_crystal_has_the_published_speeds():
    """FCC of glass spheres of 1 mm, G = 29.17 GPa: 749.93 and 530.28 m/s at 100 kPa; 1100.75 and 778.35 m/s at 1 MPa."""
    for pressure, fast, slow in ((1e5, 749.93, 530.28), (1e6, 1100.75, 778.35)):
        found = crystal_speeds(Bender(packing="fcc", pressure=pressure))
        assert (found.compression, found.shear) == pytest.approx((fast, slow), rel=1e-3)


def test_the_affine_speeds_are_those_of_a_sum_over_contacts_of_all_directions():
    """Energy of a strain: kn/2 (d n.e.n)^2 + kt/2 d^2 |e.n - n (n.e.n)|^2 of each contact, 3 z phi / (pi d^3) in a volume."""
    n = np.random.default_rng(1).normal(size=(200_000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    phi, z, d = 0.6, 5.0, SCENE.diameter
    each = contact(SCENE, np.pi * d**2 * 1e5 / (z * phi))
    many = 3.0 * z * phi / (np.pi * d**3)

    def modulus(strain):
        pulled = n @ strain
        along = (pulled * n).sum(axis=1)
        aside = (pulled**2).sum(axis=1) - along**2
        return many * d**2 * (each.kn * along**2 + each.kt * aside).mean()

    shear, compression = np.zeros((2, 3, 3))
    shear[0, 2] = shear[2, 0] = 0.5
    compression[2, 2] = 1.0
    found = affine_speeds(SCENE, phi, z, 1e5)
    mass = SCENE.density * phi
    assert found.shear == pytest.approx(np.sqrt(modulus(shear) / mass), rel=5e-3)
    assert found.compression == pytest.approx(np.sqrt(modulus(compression) / mass), rel=5e-3)
