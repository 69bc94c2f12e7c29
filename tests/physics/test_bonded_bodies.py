"""Bodies of many bonded grains: rigid motion, beams against Euler, Bernoulli and Timoshenko, energy.

A chain of touching grains of radius r, bonded with radius_factor 1, is a beam of the round cross-section A = pi r^2, with
I = pi r^4 / 4, E = kn l and G = ks l, where l = 2 r is the distance of the centres: each bond is a spring kn A along, ks A across
and kn I in bending, for a piece of the beam of the length l.
"""

import numpy as np
import pytest
from bonded import HEAVY, glued, norms, random_directions, sized, turned, turning

import barchan as bc
from barchan.measure import KineticEnergy, bond_table

KN, KS = 2.5e4, 1e4


# -- rigid motion --------------------------------------------------------------------------------------------------------------


def cluster(count=6, seed=1):
    """Centres and radii of a compact body of grains that nearly touch."""
    rng = np.random.default_rng(seed)
    radius, place = rng.uniform(0.4, 0.5, count), np.zeros((count, 3))
    for k in range(1, count):
        while True:
            direction = random_directions(rng, 1)[0]
            place[k] = place[k % 3 if k > 3 else 0] + (radius[k] + radius[k % 3 if k > 3 else 0] + 0.01) * direction
            gaps = norms(place[:k] - place[k])[:, 0] - radius[:k] - radius[k]
            if (gaps > 0.009).all() and (gaps < 0.2).sum() >= min(k, 2):
                break
    return place - place.mean(axis=0), radius


class Body:
    """A cluster of bonded grains that moves as told; ``place`` (k, 3) of its grains."""

    def __init__(self, dt, periodic=False):
        self.place, radius = cluster()
        self.sim = glued(bc.Box((-6,) * 3, (6,) * 3, periodic=(periodic,) * 3), dt, kn=KN, ks=KS)
        self.sim.add_grains(self.place, radius, mass=HEAVY)
        assert self.sim.install_bonds(overlap=-0.2) >= 8
        self.dt, self.radius = dt, radius

    def step(self, to, omega):
        """Bring the grains to places in one step."""
        rows = self.sim.grains.row_of(np.arange(len(to)))
        self.sim.grains.velocity[rows] = (to - self.place) / self.dt
        self.sim.grains.omega[rows] = omega
        self.sim.run(1)
        self.place = to

    def turn(self, axis, angle, omega):
        """Rigid rotation about an axis through the origin by an angle in this step."""
        self.step(turned(turning(axis[None], np.array([angle])), self.place), omega * axis)

    def loads(self):
        """What bonds remember, in the order of the table."""
        table = bond_table(self.sim)
        return {name: table[name] for name in ("bond_normal_force", "bond_shear_force", "twisting_moment", "bending_moment")}

    def strained(self):
        """Give each bond all loads, by small random motions; returns what it remembers then."""
        rng = np.random.default_rng(3)
        for _ in range(20):
            way, angle = rng.uniform(-1e-4, 1e-4, (2, *self.place.shape))
            self.step(self.place + way, angle / self.dt)
        return self.loads()


def test_a_rigid_translation_makes_no_force_at_all():
    """Through periodic faces, too."""
    body = Body(1e-2, periodic=True)
    body.sim.grains.velocity[...] = (3.0, -5.0, 7.0)
    body.sim.run(1000)
    assert all(not np.any(load) for load in body.loads().values())


@pytest.mark.parametrize("seed", [0, 1])
def test_a_rigid_rotation_makes_no_force_and_carries_what_is_stored(seed):
    """Five turns in steps of 4.5 degrees. A step of the leap-frog is a chord; with spins of 2 tan(angle / 2) / dt, at which the
    ends of bonds stay together on chords, nothing but rounding is left: what was stored is as long as before, and turned with the
    body."""
    axis, angle, body = random_directions(np.random.default_rng(seed), 1)[0], np.pi / 40.0, Body(1.0)
    stored, scale = body.strained(), body.sim.grains.view("force").max()
    for _ in range(400 + 7):
        body.turn(axis, angle, 2.0 * np.tan(0.5 * angle))
    now, seven = body.loads(), turning(axis[None], np.array([7.0 * angle]))
    for name, load in stored.items():
        expected = load if load.ndim == 1 else load @ seven[0].T
        assert np.abs(now[name] - expected).max() < 1e-10 * scale, name


def test_the_error_of_spins_that_are_no_chords_falls_with_the_square_of_the_step():
    """Grains told to spin by angle / dt slip by r angle^3 / 12 in a step: pi / 6 angle^2 r a turn. Measured on the force in the
    plane of the bond after one turn, relative to ks A r, in steps of 4 and of 2 degrees."""
    errors = []
    for steps in (90, 180):
        body, angle = Body(1.0), 2.0 * np.pi / steps
        for _ in range(steps):
            body.turn(np.array([0.0, 0.6, 0.8]), angle, angle)
        table = bond_table(body.sim)
        first, second = (body.radius[table[side]] for side in ("first", "second"))
        _, area, _, _ = sized(first, second)
        arm = table["distance"] * np.sqrt(1.0 - (table["normal"] @ (0.0, 0.6, 0.8)) ** 2)
        errors.append(norms(table["bond_shear_force"])[:, 0] / (KS * area * arm))
        assert errors[-1] == pytest.approx(np.full(len(arm), np.pi / 6.0 * angle**2), rel=1e-2)
    assert errors[0] / errors[1] == pytest.approx(np.full(len(errors[0]), 4.0), rel=0.01)


def test_a_free_body_keeps_its_momentum_and_its_angular_momentum():
    """To rounding, however fast it spins and rings: half a turn of a body, whose bonds are strained by some per cent."""
    place, radius = cluster()
    sim = glued(bc.Box((-6,) * 3, (6,) * 3), 5e-4, kn=KN, ks=KS)
    sim.add_grains(place, radius)
    sim.install_bonds(overlap=-0.2)
    rng = np.random.default_rng(4)
    spins = np.array([5.0, -3.0, 4.0]) + rng.uniform(-1.0, 1.0, place.shape)
    rows = sim.grains.row_of(np.arange(len(place)))
    sim.grains.velocity[rows], sim.grains.omega[rows] = np.cross(spins, place), spins

    def momenta():
        mass, inertia, at, speed, spin = (sim.grains.view(name) for name in ("mass", "inertia", "position", "velocity", "omega"))
        return mass @ speed, mass @ np.cross(at, speed) + inertia @ spin

    (momentum, angular), largest = momenta(), 0.0
    for _ in range(5):
        sim.run(160)
        table = bond_table(sim)
        largest = max(largest, np.abs(table["bond_normal_force"]).max())
        now = momenta()
        assert np.abs(now[0] - momentum).max() < 1e-12 and np.abs(now[1] - angular).max() < 1e-12 * norms(angular[None]).max()
    assert largest > 10.0


# -- beams ---------------------------------------------------------------------------------------------------------------------

BONDS, R = 12, 0.5
LENGTH, AREA, INERTIA = 2.0 * R * BONDS, np.pi * R**2, 0.25 * np.pi * R**4
YOUNG, SHEAR = KN * 2.0 * R, KS * 2.0 * R  # of the material of the beam
MASS = np.pi / 6.0

#: 0.17 sqrt(m / k), less what other stiffnesses ask for.
STEP = 0.1 * np.sqrt(MASS / (KN * AREA))


def chains(ends):
    """Chains along x from a grain that is held, one above the other, and the ids of each.

    Args:
        ends: "free", "pulled" or "pushed aside" each: the last grain moves freely, or as told along x or y and turns freely.
    """
    sim = glued(bc.Box((-3, -5, -3), (LENGTH + 5, 5, 3 * len(ends) + 3)), STEP, kn=KN, ks=KS)
    along, ids = np.arange(BONDS + 1), []
    for number, end in enumerate(ends):
        place = np.stack([2.0 * R * along, 0.0 * along, 0.0 * along + 3.0 * number], axis=1)
        mass = np.where((along == BONDS) & (end != "free"), HEAVY, MASS)
        ids.append(sim.add_grains(place, R, mass=mass, inertia=0.4 * MASS * R**2, frozen=along == 0))
    assert sim.install_bonds(overlap=-1e-6) == BONDS * len(ends)
    return sim, ids


def test_a_chain_is_a_beam_under_a_tip_load_and_a_fibre_when_pulled():
    """The last grain is moved by a per cent of a radius and held until all is at rest. Cantilever P L^3 / (3 E I), after
    Euler and Bernoulli, to which shear adds P L / (G A), after Timoshenko; n bonds, springs at the middles of their pieces, give
    P L^3 / (3 E I) (1 - 1 / (4 n^2)) + P L / (G A). Fibre: P L / (E A)."""
    lowest = 15.4 / LENGTH**2 * np.sqrt(YOUNG * INERTIA / (MASS / (2.0 * R)))  # held at one end, hinged at the other
    sim, (cantilever, fibre) = chains(["pushed aside", "pulled"])
    way, steps = 0.01 * R, 500
    tips = sim.grains.row_of([cantilever[-1], fibre[-1]])
    sim.grains.velocity[tips] = [(0.0, way / (steps * STEP), 0.0), (way / (steps * STEP), 0.0, 0.0)]
    sim.run(steps)
    sim.grains.velocity[sim.grains.row_of([cantilever[-1], fibre[-1]])] = 0.0
    sim.damping = bc.Damping(viscous=1.4 * lowest)
    sim.run(int(16.0 / (lowest * STEP)))
    table = bond_table(sim)
    pushing, pulling = table["force"][np.isin(table["second"], [cantilever[-1], fibre[-1]])]
    bernoulli, by_shear = pushing[1] * LENGTH**3 / (3.0 * YOUNG * INERTIA), pushing[1] * LENGTH / (SHEAR * AREA)
    assert abs(way / bernoulli - 1.0) < 0.05, "Euler and Bernoulli"
    assert abs(way / (bernoulli + by_shear) - 1.0) < 5e-3, "Timoshenko"
    assert abs(way / (bernoulli * (1.0 - 0.25 / BONDS**2) + by_shear) - 1.0) < 5e-4, "the chain of springs itself"
    assert abs(pulling[0] * LENGTH / (AREA * way) / YOUNG - 1.0) < 1e-6, "modulus of the fibre"


def test_the_first_bending_frequency_is_that_of_a_cantilever():
    """Set swinging in the first mode of Euler and Bernoulli. The beam ends at the far side of the last grain: its length is half
    a diameter more than the distance of the outermost centres."""
    length = LENGTH + R
    expected = 1.8751**2 / length**2 * np.sqrt(YOUNG * INERTIA / (MASS / (2.0 * R)))
    sim, (chain,) = chains(["free"])
    rows, b = sim.grains.row_of(chain), 1.8751 / length
    x = sim.grains.view("position")[rows, 0]
    ratio = (np.cosh(b * length) + np.cos(b * length)) / (np.sinh(b * length) + np.sin(b * length))
    shape = np.cosh(b * x) - np.cos(b * x) - ratio * (np.sinh(b * x) - np.sin(b * x))
    slope = b * (np.sinh(b * x) + np.sin(b * x) - ratio * (np.cosh(b * x) - np.cos(b * x)))
    speed = 1e-3 * R * expected
    sim.grains.velocity[rows, 1], sim.grains.omega[rows, 2] = speed * shape, speed * slope
    height = []
    for _ in range(int(1.3 * 2.0 * np.pi / (expected * STEP) / 20)):
        sim.run(20)
        height.append(sim.grains.view("position")[sim.grains.row_of(chain[-1:])[0], 1])
    time, height = 20.0 * STEP * np.arange(1, len(height) + 1), np.array(height)
    zero = np.flatnonzero(height[1:] * height[:-1] < 0.0)
    crossings = time[zero] + 20.0 * STEP * height[zero] / (height[zero] - height[zero + 1])
    assert len(crossings) == 2
    assert abs(np.pi / np.diff(crossings)[0] / expected - 1.0) < 0.05


# -- energy --------------------------------------------------------------------------------------------------------------------


def ringing(dt, time, seed=2):
    """Energies of motion and of bonds of a cluster that rings, each as often as time / dt says."""
    place, radius = cluster()
    sim = glued(bc.Box((-6,) * 3, (6,) * 3), dt, kn=KN, ks=KS)
    sim.add_grains(place, radius)
    sim.install_bonds(overlap=-0.2)
    rng = np.random.default_rng(seed)
    sim.grains.velocity[...], sim.grains.omega[...] = rng.uniform(-1e-3, 1e-3, (2, *place.shape))
    sim.start_at_full_step()
    energies = []
    for _ in range(round(time / dt)):
        sim.run(1)
        energies.append((KineticEnergy().compute(sim).total, bond_table(sim)["energy"].sum()))
    return np.array(energies).T


def test_motion_and_bonds_exchange_their_energy_and_lose_none():
    """A free body rings for some thirty periods of its bonds; kinetic and stored energy together stay the same to O(dt^2)."""
    dt = 0.1 * np.sqrt(0.25 / (KN * np.pi * 0.16))
    errors = []
    for share in (1.0, 0.5):
        kinetic, stored = ringing(share * dt, 1500 * dt)
        total = kinetic + stored
        assert stored.max() > 0.3 * total.mean() > 3.0 * stored.min()
        errors.append(np.abs(total / total[0] - 1.0).max())
    assert errors[0] < 5e-3 and 3.5 < errors[0] / errors[1] < 4.5, errors


def test_a_break_takes_what_the_bond_stored_out_of_the_sum():
    """Two grains fly apart until the bond breaks: before that their energy is that of motion and of the bond, from then on that
    of motion alone, and the crack tells the difference, kn A s^2 / 2 of that step, but for half a kick of the force in it, which
    the grains do not get any more."""
    dt, radius = 1e-4, 0.5
    sim = glued(bc.Box((-6,) * 3, (6,) * 3), dt, kn=KN, ks=KS, tensile_strength=0.01 * KN)
    sim.add_grains([(-radius, 0, 0), (radius, 0, 0)], radius)
    sim.install_bonds(overlap=-1e-9)
    sim.grains.velocity[...] = [(-3.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    totals = []
    sim.run(1)
    while len(bond_table(sim)["first"]):
        totals.append(KineticEnergy().compute(sim).total + bond_table(sim)["energy"].sum())
        sim.run(1)
    crack = bc.bonds.cracks.table(sim)
    way = np.ptp(sim.grains.view("position")[:, 0]) - 2.0 * radius
    assert crack["energy"][0] == pytest.approx(0.5 * KN * np.pi * radius**2 * way**2, rel=1e-10)
    sim.run(1)
    left, half_a_kick = KineticEnergy().compute(sim).total, 0.5 * dt * KN * np.pi * radius**2 * way
    speed = np.ptp(sim.grains.view("velocity")[:, 0])
    assert len(totals) > 10 and np.ptp(totals) < 1e-4 * totals[0]
    assert left + crack["energy"][0] - half_a_kick * speed == pytest.approx(totals[0], rel=1e-4)
    assert crack["energy"][0] > 0.1 * left
