"""The laws beside a silo, from flows and stresses that are known."""

import numpy as np
import pytest

from barchan.experiments.silo import Silo, beverloo, janssen

OUTLETS = np.array([0.025, 0.03, 0.035, 0.04])


def test_beverloo_is_found_from_flows_that_obey_it():
    rate = 0.6 * 1500.0 * 9.81**0.5 * (OUTLETS - 1.4 * 0.005) ** 2.5
    law = beverloo.fit(OUTLETS, rate, 1500.0, 9.81, 0.005)
    assert (law.c, law.k, law.r_squared) == pytest.approx((0.6, 1.4, 1.0), rel=1e-9)
    assert law.exponent == pytest.approx(2.5, rel=1e-9)
    assert law.rate(OUTLETS, 1500.0, 9.81, 0.005) == pytest.approx(rate, rel=1e-9)


def test_flows_of_another_power_are_seen():
    law = beverloo.fit(OUTLETS, (OUTLETS - 0.007) ** 1.5, 1500.0, 9.81, 0.005)
    assert law.exponent == pytest.approx(1.5, rel=1e-9) and law.k < 0.0


def test_a_steady_flow_is_taken_from_its_development_until_too_little_is_left():
    time = np.concatenate([np.linspace(0.0, 1.0, 50, endpoint=False), np.linspace(1.0, 6.0, 1000)])
    flow = beverloo.steady(time, np.full(1050, 1e-3), 1.05, 1.0, 0.6)
    assert flow.rate == pytest.approx(0.2, rel=2e-3) and flow.error < 1e-3
    assert flow.begin == 1.0 and flow.end == pytest.approx(3.9, abs=0.02)
    assert beverloo.steady(time[:60], np.full(60, 1e-3), 1.05, 1.0, 0.6) is None


def test_stresses_of_a_silo_that_obeys_janssen_give_back_k_and_friction():
    """Slices of one density, of which each hands on what friction at the wall leaves."""
    scene, k, friction, fill = Silo(), 0.6, 0.25, 0.4
    radius, weight = 0.5 * scene.silo_diameter, 1500.0 * scene.gravity
    height = (np.arange(400) + 0.5) * 1e-3
    pressure = janssen.janssen(fill - height, weight, radius, k, friction)
    pressing = pressure * 2.0 * np.pi * radius * 1e-3
    mass = np.full(400, 1500.0 * scene.area * 1e-3)
    wall = janssen.stresses(height, mass, pressing, friction * pressing, fill, scene)
    assert (wall.k, wall.mobilised) == pytest.approx((k, friction), rel=1e-3)
    assert wall.miss < 1e-3 and wall.vertical * k == pytest.approx(pressure, rel=1e-2)
    assert wall.pressure[0] < 0.95 * k * weight * fill, "friction carries some of it"
    assert janssen.janssen(0.1, weight, radius, k, 0.0) == pytest.approx(k * weight * 0.1)
