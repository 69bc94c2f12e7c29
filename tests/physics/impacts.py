"""Many independent impacts in one box: a step costs the same for one pair as for fifty."""

import numpy as np

import barchan as bc

#: The laws of which all others that are shipped are made; what those add has tests of its own.
BASIC_LAWS = [
    law
    for law in bc.laws.SHIPPED.values()
    if law.name.removesuffix("_standard") in ("linear", "silbert", "hertz", "hertz_mindlin")
]

#: Orthonormal frame that is aligned with no axis: rows are the normal, the tangent and their cross product.
TILTED = np.array([[2.0, 3.0, 6.0], [-6.0, -2.0, 3.0], [3.0, -6.0, 2.0]]) / 7.0


def advance(sim, steps):
    """Steps without the checks that begin a ``run``, which would cost more than a step of a few grains. Needs ``prepare``."""
    for _ in range(steps):
        sim.step()


class Impacts:
    """Spheres that hit a plane, or spheres that hit spheres, each impact alone in its lot.

    All start touching, with overlap 0, so that half-step and full-step velocities are equal. Arrays have one row an impact,
    in the order given. Vectors are given and returned in the frame (normal, tangent, normal x tangent); the normal points
    from the second body to the first.

    Args:
        law, materials, dt: as for ``Simulation``.
        radius, material: of the first sphere, numbers or one for each impact; ``material`` is its name.
        velocity, omega: of the first sphere, (k, 3).
        second: dict with the same entries for a second sphere (and ``frozen``); None: a plane of material ``wall``.
        pairs: values of a pair of materials: (name, name) -> dict.
    """

    def __init__(self, law, materials, dt, radius, material, velocity, omega=0.0, second=None, wall=None, pairs=(), frame=TILTED):
        velocity = np.atleast_2d(velocity).astype(float)
        self.count, self.frame = len(velocity), frame
        radius = np.broadcast_to(np.asarray(radius, dtype=float), self.count)
        names = np.broadcast_to(material, self.count)
        reach = radius.max() if second is None else max(radius.max(), np.max(second["radius"]))
        lots = self._lots(8.0 * reach, spread_normal=second is not None)
        edge = np.abs(lots).max() + 20.0 * reach
        self.sim = bc.Simulation(bc.Box((-edge,) * 3, (edge,) * 3), law, materials, dt, threads=1)
        for (one, other), values in dict(pairs).items():
            self.sim.materials.set_pair(one, other, **values)
        if second is None:
            self.sim.add_wall(bc.Plane((0.0, 0.0, 0.0), frame[0], material=wall))
        self.sim.skin = 0.2 * reach
        self.first = self._add(lots + radius[:, None] * frame[0], radius, names, velocity, omega)
        self.second = None
        if second is not None:
            other = np.broadcast_to(np.asarray(second["radius"], dtype=float), self.count)
            self.second = self._add(
                lots - other[:, None] * frame[0],
                other,
                np.broadcast_to(second["material"], self.count),
                second.get("velocity", 0.0),
                second.get("omega", 0.0),
                second.get("frozen", False),
            )
        self.sim.prepare()

    def _lots(self, spacing, spread_normal):
        side = int(np.ceil(self.count ** (1.0 / 3.0))) if spread_normal else int(np.ceil(self.count**0.5))
        number = np.arange(self.count)
        a, b, c = number % side, (number // side) % side, number // side**2
        middle = 0.5 * (side - 1)
        lots = spacing * np.stack([(c - middle) * spread_normal, a - middle, b - middle], axis=1)
        return lots @ self.frame

    def _add(self, position, radius, names, velocity, omega, frozen=False):
        shape = (self.count, 3)
        velocity, omega = (np.broadcast_to(np.asarray(v, dtype=float), shape) @ self.frame for v in (velocity, omega))
        ids = np.zeros(self.count, dtype=np.int64)
        for name in dict.fromkeys(names):
            rows = np.flatnonzero(names == name)
            ids[rows] = self.sim.add_grains(
                position[rows], radius[rows], material=str(name), velocity=velocity[rows], omega=omega[rows], frozen=frozen
            )
        return ids

    def get(self, field, body="first"):
        """A field of the first or second bodies, vectors in the impact's frame."""
        values = self.sim.grains.sorted_by_id(field)[getattr(self, body)]
        return values @ self.frame.T if values.ndim == 2 else values

    def overlap(self):
        """Overlaps now; negative when apart."""
        if self.second is None:
            distance = self.sim.grains.sorted_by_id("position")[self.first] @ self.frame[0]
            return self.get("radius") - distance
        branch = self.get("position") - self.get("position", "second")
        return self.get("radius") + self.get("radius", "second") - np.sqrt((branch**2).sum(axis=1))

    def kinetic_energy(self):
        """Of both bodies, translation and rotation, with the half-step velocities: exact while nothing touches."""
        total = 0.0
        for body in ("first", "second")[: 1 if self.second is None else 2]:
            moving = self.get("frozen", body) == 0
            total = total + 0.5 * moving * (
                self.get("mass", body) * (self.get("velocity", body) ** 2).sum(axis=1)
                + self.get("inertia", body) * (self.get("omega", body) ** 2).sum(axis=1)
            )
        return total

    def run_apart(self, steps):
        """Run, and check that all contacts have ended."""
        self.sim.run(steps)
        assert self.sim.touching == 0, f"{self.sim.touching} contact(s) still touch after {steps} steps"
        return self

    def run_until_apart(self, most):
        """Run until all contacts have ended, at most ``most`` steps."""
        for _ in range(0, most, 500):
            self.sim.run(500)
            if self.sim.touching == 0:
                return self
        raise AssertionError(f"{self.sim.touching} contact(s) still touch after {most} steps")

    def peaks(self, steps):
        """Largest overlap and normal force of each impact over ``steps`` steps, from parabolas through the three values
        around each maximum; and that all contacts have ended."""
        overlaps, forces = np.zeros((steps, self.count)), np.zeros((steps, self.count))
        for number in range(steps):
            self.sim.step()
            overlaps[number], forces[number] = self.overlap(), self.get("force")[:, 0]
        assert self.sim.touching == 0
        return _peak(overlaps), _peak(forces)


def _peak(series):
    top = np.argmax(series, axis=0)
    columns = np.arange(series.shape[1])
    before, at, after = series[top - 1, columns], series[top, columns], series[top + 1, columns]
    return at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after))
