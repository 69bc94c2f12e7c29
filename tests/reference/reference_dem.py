"""An obvious DEM in plain NumPy: the definition of what the engine must compute.

Written from equations (1) to (12) of Walther & Sbalzarini 2009 and the papers that the laws cite, with nothing of barchan in
it: every pair is looked at in every step, a contact's memory lives in a dict, vectors are NumPy arrays. Slow on purpose.

Conventions: i is the grain with the smaller id (or the grain at a wall), all contact vectors point from j to i, velocities
are those of the half step n-1/2 and positions those of the full step n.
"""

from types import SimpleNamespace

import numpy as np

# -- vectors ---------------------------------------------------------------------------------------------------------


def norm(a):
    return np.sqrt(a @ a)


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def in_plane(a, normal):
    """The part of ``a`` that is perpendicular to ``normal``."""
    return a - (a @ normal) * normal


def laid_onto(a, normal):
    """``a`` brought into the plane of ``normal`` with its length kept, as a memory that turns with the contact is."""
    flat = in_plane(a, normal)
    return flat * (norm(a) / norm(flat)) if norm(flat) > 0.0 else np.zeros(3)


# -- how a memory is carried to the next step ------------------------------------------------------------------------


def carry_half_step(c, memory, rate_half, rate):
    """Vyas et al. 2025: the slip of the half step is added in the plane of the half-step normal, where it lies."""
    return laid_onto(laid_onto(memory, c.normal_half) + c.dt * rate_half, c.normal)


def carry_standard(c, memory, rate_half, rate):
    """Equation (4) by explicit Euler, projected onto the tangent plane of step n."""
    return in_plane(memory + c.dt * rate, c.normal)


def carry_standard_force(c, memory, rate_half, rate):
    """For a memory that is a force: turned with the contact, then incremented in the plane of step n."""
    return laid_onto(memory, c.normal) + c.dt * rate


# -- laws: contact, parameters, memory -> normal force, tangential force on i, memory, whether it slides ---------------


def coulomb(force, limit):
    """Equation (7): no tangential force exceeds ``limit``."""
    if norm(force) > limit:
        return force * (limit / norm(force)), True
    return force, False


def spring_and_dashpot(factor, carry):
    """Equations (5) to (8); ``factor`` (contact) is what multiplies both forces, sqrt(delta / (Ri + Rj)) in the paper."""

    def law(c, p, displacement):
        f = factor(c)
        displacement = carry(c, displacement, c.slip_half, c.slip)
        normal_force = f * (p["kn"] * c.overlap - p["gamma_n"] * c.mass_eff * c.normal_velocity)  # (5)
        dashpot = p["gamma_t"] * c.mass_eff * c.slip
        force, slides = coulomb(f * (-p["kt"] * displacement - dashpot), p["friction"] * abs(normal_force))  # (6), (7)
        if slides:
            displacement = -(force / f + dashpot) / p["kt"]  # (8)
        return normal_force, force, displacement, slides

    return law


def mindlin(carry):
    """Hertz's normal force, Mindlin's tangential stiffness 8 G* a in increments, Tsuji's dashpots, no tension."""

    def law(c, p, elastic):
        a = np.sqrt(c.radius_eff * c.overlap)
        elastic = carry(c, elastic, -8.0 * p["G_eff"] * a * c.slip_half, -8.0 * p["G_eff"] * a * c.slip)
        eta = p["alpha"] * np.sqrt(c.mass_eff * 4.0 / 3.0 * p["E_eff"] * a)
        normal_force = max(0.0, 4.0 / 3.0 * p["E_eff"] * a * c.overlap - eta * c.normal_velocity)
        force, slides = coulomb(elastic - eta * c.slip, p["friction"] * normal_force)
        if slides:
            elastic = force + eta * c.slip
        return normal_force, force, elastic, slides

    return law


def mix_by_geometric_mean(first, second):
    return {name: np.sqrt(first[name] * second[name]) for name in first}


def alpha_of_restitution(restitution):
    """Tsuji's alpha = sqrt(5) z for a contact that ends when its force vanishes: Schwager & Poeschel 2007, by bisection."""

    def seen(z):
        root = np.sqrt(1.0 - z * z)
        return np.exp(-z / root * (np.pi - np.arctan2(2.0 * z * root, 1.0 - 2.0 * z * z)))

    low, high = 0.0, 1.0 - 1e-9
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if seen(middle) > restitution else (low, middle)
    return np.sqrt(5.0) * low


def mix_elastic(first, second):
    """1/E* = sum (1 - nu^2)/E and 1/G* = sum (2 - nu)/G with G = E / (2 (1 + nu)); the rest by the geometric mean."""

    def shear_modulus(p):
        return p["youngs_modulus"] / (2.0 * (1.0 + p["poisson_ratio"]))

    both = (first, second)
    return {
        "E_eff": 1.0 / sum((1.0 - p["poisson_ratio"] ** 2) / p["youngs_modulus"] for p in both),
        "G_eff": 1.0 / sum((2.0 - p["poisson_ratio"]) / shear_modulus(p) for p in both),
        "friction": np.sqrt(first["friction"] * second["friction"]),
        "alpha": alpha_of_restitution(np.sqrt(first["restitution"] * second["restitution"])),
    }


def one(c):
    return 1.0


def hertz_factor(c):
    return np.sqrt(c.overlap * c.radius_eff)


def silbert_factor(c):
    return np.sqrt(c.overlap / (c.radius_i + c.radius_j))


#: name -> law, mixing rule, torque arm.
LAWS = {
    "silbert": (spring_and_dashpot(silbert_factor, carry_half_step), mix_by_geometric_mean, "radius"),
    "linear": (spring_and_dashpot(one, carry_half_step), mix_by_geometric_mean, "radius"),
    "hertz": (spring_and_dashpot(hertz_factor, carry_half_step), mix_by_geometric_mean, "radius"),
    "hertz_mindlin": (mindlin(carry_half_step), mix_elastic, "lens"),
    "silbert_standard": (spring_and_dashpot(silbert_factor, carry_standard), mix_by_geometric_mean, "radius"),
    "linear_standard": (spring_and_dashpot(one, carry_standard), mix_by_geometric_mean, "radius"),
    "hertz_standard": (spring_and_dashpot(hertz_factor, carry_standard), mix_by_geometric_mean, "radius"),
    "hertz_mindlin_standard": (mindlin(carry_standard_force), mix_elastic, "radius"),
}


# -- the simulation --------------------------------------------------------------------------------------------------


class ReferenceDEM:
    """Grains with ids 0, 1, ... in a box.

    Args:
        law: a name out of ``LAWS``.
        materials: list of dicts of properties; ``overrides``: (a, b) -> properties that both have when they meet.
        low, high, periodic: the box.
        grains: arrays position, velocity, omega, radius, mass, inertia, material, frozen.
        walls: namespaces with point, unit normal, velocity and material; wall k is the partner -1 - k.
        gravity: function of time.

    Attributes: ``force``, ``torque``; ``contacts``: (id, partner) -> overlap, force on the grain, whether it slides;
    ``memory``: (id, partner) -> vector.
    """

    def __init__(self, law, materials, overrides, low, high, periodic, grains, walls, dt, gravity):
        self.law, mix, self.lever = LAWS[law]
        self.parameters = {}
        for a in range(len(materials)):
            for b in range(len(materials)):
                own = overrides.get((a, b), overrides.get((b, a), {}))
                self.parameters[a, b] = mix({**materials[a], **own}, {**materials[b], **own})
        self.low, self.length, self.periodic = np.array(low), np.array(high) - np.array(low), np.array(periodic)
        for name, values in grains.items():
            setattr(self, name, np.array(values))
        self.count = len(self.radius)
        self.inverse_mass = np.where(self.frozen, 0.0, 1.0 / self.mass)  # an immobile grain is infinitely heavy
        self.inverse_inertia = np.where(self.frozen, 0.0, 1.0 / self.inertia)
        self.image = np.zeros((self.count, 3), dtype=int)
        self.walls, self.dt, self.gravity, self.time = walls, dt, gravity, 0.0
        self.memory = {}
        self.compute_forces(0.0)  # F(0); the memory does not advance

    def step(self):
        self.velocity = self.velocity + self.dt * self.inverse_mass[:, None] * self.force  # (11)
        self.omega = self.omega + self.dt * self.inverse_inertia[:, None] * self.torque  # (12)
        self.position = self.position + self.dt * self.velocity  # (11)
        turns = np.where(self.periodic, np.floor((self.position - self.low) / self.length), 0.0)
        self.position, self.image = self.position - turns * self.length, self.image + turns.astype(int)
        for wall in self.walls:
            wall.point = wall.point + self.dt * wall.velocity
        self.time += self.dt
        self.compute_forces(self.dt)

    def compute_forces(self, dt):
        """Equations (9) and (10): weight and all contacts."""
        self.force = self.mass[:, None] * np.asarray(self.gravity(self.time))
        self.torque = np.zeros((self.count, 3))
        before, self.memory, self.contacts = self.memory, {}, {}
        for i, j, branch in self.touching_pairs():
            c = self.pair_contact(i, j, branch, dt)
            on_i = self.evaluate(c, (i, j), self.parameters[self.material[i], self.material[j]], before)
            self.force[i] += on_i
            self.force[j] -= on_i
            self.torque[i] -= c.arm_i * cross(c.normal, c.tangential)
            self.torque[j] -= c.arm_j * cross(c.normal, c.tangential)
        for i, k, distance in self.touching_walls():
            c = self.wall_contact(i, self.walls[k], distance, dt)
            self.force[i] += self.evaluate(c, (i, -1 - k), self.parameters[self.material[i], self.walls[k].material], before)
            self.torque[i] -= c.arm_i * cross(c.normal, c.tangential)

    def touching_pairs(self):
        """(i, j, r_i - r_j) of all pairs that overlap, over the nearest periodic image; two immobile grains feel nothing."""
        branch = self.position[:, None, :] - self.position[None, :, :]
        branch -= np.where(self.periodic, self.length * np.round(branch / self.length), 0.0)
        overlap = self.radius[:, None] + self.radius[None, :] - np.sqrt((branch**2).sum(axis=2))
        for i, j in np.argwhere(overlap > 0.0):
            if i < j and not (self.frozen[i] and self.frozen[j]):
                yield int(i), int(j), branch[i, j]

    def touching_walls(self):
        for k, wall in enumerate(self.walls):
            distance = (self.position - wall.point) @ wall.normal
            for i in np.flatnonzero((self.radius > distance) & ~self.frozen):
                yield int(i), k, distance[i]

    def pair_contact(self, i, j, branch, dt):
        """What a law may know of the contact of two grains: equations (1) to (3)."""
        r = norm(branch)
        c = SimpleNamespace(
            dt=dt,
            overlap=self.radius[i] + self.radius[j] - r,
            normal=branch / r,
            radius_i=self.radius[i],
            radius_j=self.radius[j],
            radius_eff=self.radius[i] * self.radius[j] / (self.radius[i] + self.radius[j]),
            mass_eff=1.0 / (self.inverse_mass[i] + self.inverse_mass[j]),
        )
        c.arm_i, c.arm_j = self.radius[i], self.radius[j]
        if self.lever == "lens":  # to the plane of the circle in which the two spheres cut each other
            c.arm_i = (r**2 + self.radius[i] ** 2 - self.radius[j] ** 2) / (2.0 * r)
            c.arm_j = (r**2 + self.radius[j] ** 2 - self.radius[i] ** 2) / (2.0 * r)
        velocity = self.velocity[i] - self.velocity[j]
        back = branch - 0.5 * dt * velocity
        c.normal_half = back / norm(back)
        self.add_velocities(c, velocity, c.arm_i * self.omega[i] + c.arm_j * self.omega[j])
        return c

    def wall_contact(self, i, wall, distance, dt):
        """The same at a flat wall: an immobile grain of equal radius in the paper's law, flat and infinitely heavy in others."""
        c = SimpleNamespace(
            dt=dt,
            overlap=self.radius[i] - distance,
            normal=wall.normal,
            normal_half=wall.normal,
            radius_i=self.radius[i],
            radius_j=self.radius[i],
            radius_eff=self.radius[i],
            mass_eff=1.0 / self.inverse_mass[i],
        )
        c.arm_i = distance if self.lever == "lens" else self.radius[i]  # a sphere is cut in the plane of the wall
        self.add_velocities(c, self.velocity[i] - wall.velocity, c.arm_i * self.omega[i])
        return c

    @staticmethod
    def add_velocities(c, velocity, rolling):
        c.normal_velocity = velocity @ c.normal  # (2)
        c.slip = in_plane(velocity, c.normal) - cross(rolling, c.normal)  # (3)
        c.slip_half = in_plane(velocity, c.normal_half) - cross(rolling, c.normal_half)

    def evaluate(self, c, key, parameters, before):
        """Force on the first grain of a contact; notes the contact and its memory, which starts at 0 with the contact."""
        memory = before.get(key, np.zeros(3))
        normal_force, c.tangential, carried, slides = self.law(c, parameters, memory)
        self.memory[key] = carried if c.dt > 0.0 else memory
        total = normal_force * c.normal + c.tangential
        self.contacts[key] = SimpleNamespace(overlap=c.overlap, force=total, slides=slides)
        return total
