"""Kinetic energy of the grains."""

from barchan.kernels.exact_sum import exact_sum


class KineticEnergy:
    """Energy of translation and of rotation at the full step n, of all grains that are not frozen.

    The state holds velocities at n-1/2; half a kick brings them to n: v + dt/2 F/m. The sums are exact, so the values do
    not depend on threads or ranks.

    Properties: ``translation``, ``rotation``, ``total`` [force length].
    """

    def __init__(self):
        self._result = None

    def compute(self, sim):
        """Measure; returns self."""
        grains, half = sim.grains, 0.5 * sim.dt
        moving = grains.view("frozen") == 0
        velocity = grains.view("velocity") + half * grains.view("force") * grains.view("inverse_mass")[:, None]
        omega = grains.view("omega") + half * grains.view("torque") * grains.view("inverse_inertia")[:, None]
        terms = (
            0.5 * grains.view("mass") * moving * (velocity**2).sum(axis=1),
            0.5 * grains.view("inertia") * moving * (omega**2).sum(axis=1),
        )
        self._result = tuple(exact_sum(term, sim.comm) for term in terms)
        return self

    def _get(self, index):
        if self._result is None:
            raise RuntimeError("KineticEnergy: call compute(sim) first")
        return self._result[index]

    @property
    def translation(self):
        """Energy of translation [force length]."""
        return self._get(0)

    @property
    def rotation(self):
        """Energy of rotation [force length]."""
        return self._get(1)

    @property
    def total(self):
        """Sum of both [force length]."""
        return self.translation + self.rotation
