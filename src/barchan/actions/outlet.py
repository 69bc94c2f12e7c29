"""An opening through which grains leave the scene, counted."""

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError
from barchan.kernels.exact_sum import exact_sum
from barchan.triggers import trigger


class Outlet:
    """Grains whose centre is beyond a plane are removed and counted; they are not lost.

    Keep the plane inside the box, by more than the way of a grain between two looks.

    Args:
        name: under which ``sim.notes["outlets"]`` counts, so that checkpoints keep the counts: ``grains``, their ``mass``
            and their ``energy``, kinetic and potential with respect to the origin, when they left.
        point: any point of the plane [length].
        normal: direction in which grains leave.
        due: trigger, a function of the step.

    Raises:
        SceneError: point or normal are not three finite numbers.
    """

    def __init__(self, name, point, normal, due):
        self.name, self.due = str(name), trigger(due, f"outlet '{name}'")
        self.point, self.normal = (numbers(f"outlet '{name}'", value, "length") for value in (point, normal))
        for what, value in (("point", self.point), ("normal", self.normal)):
            if value.shape != (3,) or not np.isfinite(value).all() or (what == "normal" and not value.any()):
                raise SceneError(
                    f"outlet '{name}': {what} = {value.tolist()} must be three finite numbers, the normal not all zero"
                )

    def apply(self, sim):
        """Remove what is beyond the plane."""
        grains = sim.grains
        beyond = ((grains.view("position") - self.point) @ self.normal > 0.0) & (grains.view("frozen") == 0)
        leaving = int(sim.comm.sum([int(beyond.sum())])[0])
        if not leaving:
            return
        mass = grains.view("mass")[beyond]
        velocity = grains.view("velocity")[beyond]
        kinetic = 0.5 * mass * (velocity**2).sum(axis=1) + 0.5 * grains.view("inertia")[beyond] * (
            grains.view("omega")[beyond] ** 2
        ).sum(axis=1)
        followed = sim.box.unwrapped(grains.view("position")[beyond], grains.view("image")[beyond])  # as ``EnergyBudget`` does
        potential = -mass * (followed @ sim.present_gravity)
        count = sim.notes.setdefault("outlets", {}).setdefault(self.name, {"grains": 0, "mass": 0.0, "energy": 0.0})
        count["grains"] += leaving
        count["mass"] += exact_sum(mass, sim.comm)
        count["energy"] += exact_sum(kinetic + potential, sim.comm)
        sim.remove(grains.view("id")[beyond])
