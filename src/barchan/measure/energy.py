"""Energies of the grains, and where energy has gone."""

import numpy as np

from barchan.forces import Gravity
from barchan.measure.base import Result, flowing_rows, full_step, squared
from barchan.measure.elastic import elastic_energies
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts


class KineticEnergy:
    """Energy of translation and of rotation at the full step n, of all grains that are not frozen.

    The sums are exact, so the values do not depend on threads or ranks.
    """

    translation = Result("energy of translation [force length]")
    rotation = Result("energy of rotation [force length]")
    total = Result("sum of both [force length]")

    def compute(self, sim):
        """Measure; returns self."""
        self.translation, self.rotation = exact_sums(_kinetic(sim, flowing_rows(sim)), sim.comm)[:, 0].tolist()
        self.total = self.translation + self.rotation
        return self


class EnergyBudget:
    """Where the energy is: that of motion, in gravity, in contacts and in bonds, of all grains that are not frozen.

    Potential energy is -m g . x with the present gravity, 0 at the origin of coordinates, with x followed through periodic
    faces. Elastic energy is that of normal forces and of tangential springs; of a law that does not tell what it stores, that of
    normal forces (``elastic.py``).

    Start a new budget when gravity changes or when grains are added, frozen or released: the energy jumps then.
    Energy that removed grains took with them, and work of moving walls, count as (negative) dissipation here: ``EnergyAccount``
    tells where it went.

    In a uniform gravity without contacts the leap-frog's full-step energy is constant to rounding: x(n) lies on the
    parabola and v(n) is its slope. In contacts it is constant up to O(dt^2), and so is ``dissipated``.

    Args:
        total_at_start: ``total`` of the budget from which dissipation counts [force length]; default: that of the state
            measured, of which nothing is dissipated yet.
    """

    translation = Result("kinetic energy of translation [force length]")
    rotation = Result("kinetic energy of rotation [force length]")
    potential = Result("potential energy in the present gravity [force length]")
    elastic = Result("energy stored in contacts [force length]")
    bonded = Result("energy stored in bonds [force length]")
    total = Result("sum of these five [force length]")
    dissipated = Result("total_at_start - total [force length]")

    def __init__(self, total_at_start=None):
        self.total_at_start = total_at_start

    def compute(self, sim):
        """Measure; returns self.

        Raises:
            SceneError: grains or walls were changed since the last run.
        """
        check_contacts(sim)
        rows = flowing_rows(sim)
        columns = (*_kinetic(sim, rows), _potential(sim, rows))
        self.translation, self.rotation, self.potential = exact_sums(columns, sim.comm)[:, 0].tolist()
        self.elastic, self.bonded = stored(sim)[0], stored_in_bonds(sim)
        self.total = self.translation + self.rotation + self.potential + self.elastic + self.bonded
        self.dissipated = 0.0 if self.total_at_start is None else self.total_at_start - self.total
        return self


def stored(sim):
    """Energy stored in all contacts, and the part of it in tangential springs [force length]."""
    normal, springs = exact_sums(elastic_energies(sim), sim.comm)[:, 0].tolist()
    return normal + springs, springs


def stored_in_bonds(sim):
    """Energy stored in all bonds that hold [force length]; 0 if their law does not tell."""
    some = np.flatnonzero(sim.bonds.holding & (sim.bonds.owners[:, 0] == sim.comm.rank))
    return float(exact_sums([sim.bonds.energies(sim.grains, some)], sim.comm)[0, 0])


def _kinetic(sim, rows):
    """Energies of translation and of rotation of each grain."""
    velocity, omega = full_step(sim, rows)
    mass, inertia = sim.grains.view("mass")[rows], sim.grains.view("inertia")[rows]
    return 0.5 * mass * squared(velocity), 0.5 * inertia * squared(omega)


def _potential(sim, rows):
    """Potential energy of each grain."""
    grains = sim.grains
    gx, gy, gz = Gravity(sim.gravity).at(sim.time)
    x, y, z = sim.box.unwrapped(grains.view("position")[rows], grains.view("image")[rows]).T
    return -grains.view("mass")[rows] * (gx * x + gy * y + gz * z)
