"""Free fall, sliding that turns into rolling, and rolling down an incline, against closed forms."""

from math import cos, log, pi, radians, sin, sqrt

import numpy as np
import pytest
from analytic import rolling_acceleration, rolling_starts
from impacts import BASIC_LAWS

import barchan as bc

RADIUS, DENSITY, GRAVITY, DT = 0.1, 1000.0, 9.81, 2e-5
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY
WEIGHT = MASS * GRAVITY

#: Stiffness under the sphere's own weight: it sinks in by 1e-5 of its radius.
STIFFNESS = WEIGHT / (1e-5 * RADIUS)

ALL_LAWS = pytest.mark.parametrize("law", BASIC_LAWS, ids=lambda law: law.name)


def material(law, name, friction):
    """A material that is damped to e about 0.3, so that the start's little oscillations die."""
    if law.name.startswith("hertz_mindlin"):
        poisson = 0.3
        depth = 1.5 * WEIGHT / STIFFNESS  # F = k depth / 1.5 with the tangent stiffness k
        modulus_eff = STIFFNESS / (2.0 * sqrt(RADIUS * depth))
        elastic = {"youngs_modulus": 2.0 * modulus_eff * (1.0 - poisson**2), "poisson_ratio": poisson, "restitution": 0.3}
    else:
        depth = WEIGHT / STIFFNESS
        length = {"silbert": 1.0 / sqrt(depth / (2.0 * RADIUS)), "hertz": 1.0 / sqrt(depth * RADIUS)}
        factor = length.get(law.name.removesuffix("_standard"), 1.0)  # makes f k_n the same for all laws
        damping = -log(0.3) / sqrt(pi**2 + log(0.3) ** 2)
        rate = 2.0 * damping * sqrt(STIFFNESS / MASS)
        names = ("kn", "kt", "gamma_n", "gamma_t")
        elastic = {name: factor * v for name, v in zip(names, (STIFFNESS, 2.0 / 7.0 * STIFFNESS, rate, 0.5 * rate))}
    return bc.Material(name, density=DENSITY, friction=friction, **elastic)


def spheres_on_plane(law, frictions, gravity, speed=0.0, spin=0.0):
    """Spheres that rest on the plane z = 0, sunk in by about their weight, each with friction of its own; lots along y."""
    materials = [material(law, f"mu {mu}", mu) for mu in frictions]
    box = bc.Box((-1.0, -1.0, -1.0), (20.0, 0.5 * len(frictions) + 1.0, 1.0))
    sim = bc.Simulation(box, law, [*materials, material(law, "plane", 1.0)], DT, gravity=gravity, threads=1)
    for mu, m in zip(frictions, materials):
        sim.materials.set_pair(m.name, "plane", friction=mu)
    sim.check_dt = False  # it looks at an overlap of 5 %; here it is 0.001 %, and softer by far
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), material="plane"))
    depth = (1.5 if law.name.startswith("hertz_mindlin") else 1.0) * WEIGHT / STIFFNESS
    depth *= (-gravity[2] / GRAVITY) ** (1.0 if law.name.startswith("linear") else 2.0 / 3.0)
    for number, m in enumerate(materials):
        place = [(0.0, 0.5 * number, RADIUS - depth)]
        sim.add_grains(place, RADIUS, material=m.name, velocity=(speed, 0.0, 0.0), omega=(0.0, spin, 0.0))
    return sim


def follow(sim, steps, every):
    """Times, velocities along x and spins about y, (records,) and (records, spheres)."""
    times, speeds, spins = [], [], []
    sim.prepare()
    for _ in range(steps // every):
        sim.run(every)
        times.append(sim.time - 0.5 * sim.dt)
        speeds.append(sim.grains.sorted_by_id("velocity")[:, 0])
        spins.append(sim.grains.sorted_by_id("omega")[:, 1])
    return np.array(times), np.array(speeds), np.array(spins)


def rolling_time(times, slip):
    """When the slip velocity would reach 0 [1 m/s at the start], from when it passes 0.02, by linear interpolation; the last
    part is left out, where springs and dashpots round the corner off. One for each sphere."""
    after = np.argmax(slip <= 0.02, axis=0)
    columns = np.arange(slip.shape[1])
    high, low = slip[after - 1, columns], slip[after, columns]
    return (times[after - 1] + (times[after] - times[after - 1]) * (high - 0.02) / (high - low)) / 0.98


@ALL_LAWS
def test_sliding_turns_into_rolling(law):
    """A sphere set sliding at 1 m/s without spin: u = u0 - mu g t until it rolls, from t = 2 u0 / (7 mu g) on, with 5/7 u0.

    mu 0.1, 0.2, 0.4. Speed within 0.01 %, time within 0.2 %; the rolling condition u = R omega within 1e-4 u0.
    """
    frictions = np.array([0.1, 0.2, 0.4])
    start, rolling = rolling_starts(1.0, frictions, GRAVITY)
    times, speeds, spins = follow(spheres_on_plane(law, frictions, (0.0, 0.0, -GRAVITY), speed=1.0), 20000, 20)
    for column, mu in enumerate(frictions):
        sliding = times < 0.98 * start[column]
        np.testing.assert_allclose(speeds[sliding, column], 1.0 - mu * GRAVITY * times[sliding], atol=1e-4)
    np.testing.assert_allclose(rolling_time(times, speeds - RADIUS * spins), start, rtol=2e-3)
    np.testing.assert_allclose(speeds[-1], rolling, rtol=1e-4)
    np.testing.assert_allclose(RADIUS * spins[-1], speeds[-1], atol=1e-4)


@ALL_LAWS
def test_spin_turns_into_rolling(law):
    """A sphere set down with a spin R omega0 = 1 m/s and no speed rolls off with u = 2/7 R omega0, from t = 2 R omega0 / (7 mu g)
    on: the same impulse the other way round. Tolerances as above."""
    frictions = np.array([0.1, 0.2, 0.4])
    start, rolling = rolling_starts(1.0, frictions, GRAVITY)
    times, speeds, spins = follow(spheres_on_plane(law, frictions, (0.0, 0.0, -GRAVITY), spin=1.0 / RADIUS), 20000, 20)
    np.testing.assert_allclose(rolling_time(times, RADIUS * spins - speeds), start, rtol=2e-3)
    np.testing.assert_allclose(speeds[-1], 1.0 - rolling, rtol=2e-4)
    np.testing.assert_allclose(RADIUS * spins[-1], speeds[-1], atol=1e-4)


@ALL_LAWS
def test_rolling_down_an_incline(law):
    """A sphere released on an incline of 20 degrees, mu 0.3 and 0.8 (above 2/7 tan 20 = 0.104): v = 5/7 g sin(20) t within
    0.05 %; with mu = 0.05 it slides, v = g (sin - mu cos) t."""
    angle = radians(20.0)
    gravity = (GRAVITY * sin(angle), 0.0, -GRAVITY * cos(angle))
    times, speeds, _ = follow(spheres_on_plane(law, [0.3, 0.8, 0.05], gravity), 20000, 20000)
    sliding = GRAVITY * (sin(angle) - 0.05 * cos(angle))
    expected = np.array([rolling_acceleration(angle, GRAVITY)] * 2 + [sliding]) * times[-1]
    np.testing.assert_allclose(speeds[-1], expected, rtol=5e-4)


def test_spin_about_the_normal_lasts():
    """A sphere that spins about the normal of the plane it rests on: the contact point does not move, so the spin stays, exactly
    (no law here has torsional friction)."""
    sim = spheres_on_plane(bc.laws.hertz_mindlin, [0.5], (0.0, 0.0, -GRAVITY))
    sim.grains.omega = (0.0, 0.0, 3.0)
    sim.run(2000)
    assert sim.touching == 1
    assert sim.grains.omega.tolist() == [[0.0, 0.0, 3.0]]


@pytest.mark.parametrize("full_step", [False, True])
def test_free_fall(full_step):
    """A thrown grain. With velocities at the half step the leap-frog gives x0 + n dt v0 + g dt^2 n (n+1) / 2; with velocities
    given at the full step (``start_at_full_step``) the parabola x0 + v0 t + g t^2 / 2 itself. Both to rounding."""
    gravity, velocity = np.array([1.0, -2.0, -9.81]), np.array([3.0, 1.0, 4.0])
    law = bc.laws.hertz_mindlin
    box = bc.Box((-10.0, -10.0, -10.0), (10.0, 10.0, 10.0))
    sim = bc.Simulation(box, law, [material(law, n, 0.5) for n in ("a", "b")], DT, gravity=tuple(gravity), threads=1)
    sim.check_dt = False
    sim.add_grains([(0.1, 0.2, 0.3)], RADIUS, velocity=velocity, omega=(1.0, 2.0, 3.0))
    if full_step:
        sim.start_at_full_step()
    sim.run(5000)
    t = 5000 * DT
    fallen = 0.5 * gravity * (t**2 if full_step else t * (t + DT))
    np.testing.assert_allclose(sim.grains.position[0], np.array([0.1, 0.2, 0.3]) + velocity * t + fallen, rtol=1e-11)
    np.testing.assert_allclose(sim.grains.velocity[0], velocity + gravity * (t - 0.5 * DT * full_step), rtol=1e-11)
    assert sim.grains.omega[0].tolist() == [1.0, 2.0, 3.0]
