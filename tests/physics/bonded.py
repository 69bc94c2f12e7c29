"""Bonded grains for the tests of this folder: pairs that move as told, chains and clusters; and the parallel bond, programmed a
second time in plain NumPy with rotation matrices."""

import numpy as np

import barchan as bc

#: So heavy that no force changes how a grain moves.
HEAVY = 1e30

#: A contact law that does nothing, so that what is left is the bond.
NOTHING = {"kn": 1e-250, "kt": 1e-250, "friction": 0.0}

#: No bond of these tests breaks, unless it is meant to.
STRONG = {"tensile_strength": 1e30, "shear_strength": 1e30}


def glued(box, dt, contact=None, **properties):
    """An empty simulation with a kind of parallel bond."""
    kind = bc.Bond(bc.laws.parallel_bond, **(STRONG | properties))
    return bc.Simulation(box, bc.laws.linear, bc.Material("m", density=1.0, **(contact or NOTHING)), dt, bonds=kind, threads=1)


def sized(radius_first, radius_second, factor=1.0):
    """Radius, area, moment of inertia and polar moment of the disc."""
    radius = factor * np.minimum(radius_first, radius_second)
    return radius, np.pi * radius**2, 0.25 * np.pi * radius**4, 0.5 * np.pi * radius**4


def random_directions(rng, count):
    """(count, 3) unit vectors."""
    directions = rng.normal(size=(count, 3))
    return directions / norms(directions)


def norms(vectors):
    """Lengths, (k, 1)."""
    return np.sqrt((vectors**2).sum(axis=1, keepdims=True))


def dots(a, b):
    """Products of vectors, (k, 1)."""
    return (a * b).sum(axis=1, keepdims=True)


def cross_matrix(v):
    """(k, 3, 3) matrices of v x."""
    matrix = np.zeros((len(v), 3, 3))
    matrix[:, [2, 0, 1], [1, 2, 0]], matrix[:, [1, 2, 0], [2, 0, 1]] = v, -v
    return matrix


def turning(axis, angle):
    """Rotation matrices about unit axes (Rodrigues)."""
    k = cross_matrix(axis)
    sine, cosine = (f(angle).reshape(-1, 1, 1) for f in (np.sin, np.cos))
    return np.eye(3) + sine * k + (1.0 - cosine) * (k @ k)


def bringing(a, b):
    """The smallest rotations that bring the unit vectors a to b: I + [a x b] + [a x b]^2 / (1 + a . b)."""
    k = cross_matrix(np.cross(a, b))
    return np.eye(3) + k + (k @ k) / (1.0 + dots(a, b))[:, :, None]


def turned(matrix, vector):
    """Vectors (k, 3) turned by matrices (k, 3, 3)."""
    return np.einsum("kij,kj->ki", matrix, vector)


class Reference:
    """Parallel bonds of pairs of grains, each (k, 3) or (k, 1): what its equations say, with the middle of the step as its place.

    Attributes:
        pressing, shear, twisting, bending: what the bonds remember.
        force, torque_first, torque_second: on the grains.
    """

    def __init__(self, position, radius, kn, ks, factor):
        self.place, self.radius = position.copy(), radius[..., None]  # (k, 2, 3), (k, 2, 1)
        self.kn, self.ks = kn, ks
        _, self.area, self.inertia, self.polar = sized(self.radius[:, 0], self.radius[:, 1], factor)
        count = len(position)
        self.pressing, self.twisting = np.zeros((count, 1)), np.zeros((count, 1))
        self.shear, self.bending = np.zeros((count, 3)), np.zeros((count, 3))

    def step(self, velocity, omega, dt):
        """Grains move by a step, with velocities (k, 2, 3)."""
        before = self.place[:, 0] - self.place[:, 1]
        self.place += dt * velocity
        branch = self.place[:, 0] - self.place[:, 1]
        middle, old, new = 0.5 * (before + branch), before / norms(before), branch / norms(branch)
        half, arms = middle / norms(middle), self.radius / self.radius.sum(axis=1, keepdims=True)
        ends = [velocity[:, side] + np.cross(omega[:, side], sign * arms[:, side] * middle) for side, sign in ((0, -1), (1, 1))]
        slip, relative = dt * (ends[0] - ends[1]), dt * (omega[:, 0] - omega[:, 1])
        slip, bend = slip - dots(slip, half) * half, relative - dots(relative, half) * half
        spin = dt * dots(0.5 * (omega[:, 0] + omega[:, 1]), middle) / norms(branch)
        with_bond, with_half = turning(new, spin) @ bringing(old, new), bringing(half, new)
        self.pressing -= self.kn * self.area * (norms(branch) - norms(before))
        self.shear = turned(with_bond, self.shear) - self.ks * self.area * turned(with_half, slip)
        self.twisting -= self.ks * self.polar * dots(relative, half)
        self.bending = turned(with_bond, self.bending) - self.kn * self.inertia * turned(with_half, bend)
        couple = self.twisting * new + self.bending
        self.force = self.pressing * new + self.shear
        self.torque_first = couple + np.cross(-arms[:, 0] * branch, self.force)
        self.torque_second = -couple + np.cross(arms[:, 1] * branch, -self.force)
