"""Damping of grains as a whole, beside what their contacts dissipate: to bring samples to rest quickly."""

from math import isfinite
from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.damp import damp


class Damping(NamedTuple):
    """Damping of all grains that are not frozen: none, unless it is asked for.

    ``local``: alpha, 0 to below 1: each component of the force on a grain, gravity included, and of its torque loses alpha times
    its size in the direction of its velocity. It takes nothing from steady motion, a share of what is out of balance from all
    others, and acts alike at all frequencies; falling grains fall too slowly. Source: Cundall 1987, in Analytical and
    Computational Methods in Engineering Rock Mechanics, chapter 4; as in PFC, with alpha 0.7.

    ``viscous``: c [1/time], of which each velocity decays as exp(-c t): the force c m v, the torque c I omega, against them.

    Velocities are those at the half step before the force; without other forces they fall by the factor 1 - c dt each step.
    """

    local: float = 0.0
    viscous: float = 0.0

    @property
    def acts(self):
        """False if there is none."""
        return self.local > 0.0 or self.viscous > 0.0

    def apply(self, grains):
        """Take it from the forces and torques of the present state, which are modified."""
        if self.acts:
            motion, spin, force, torque = (grains.block(name) for name in ("motion", "spin", "force", "torque"))
            damp(motion, spin, float(self.local), float(self.viscous), force, torque)

    @staticmethod
    def check(given, dt):
        """Refuse what means nothing, or turns velocities round.

        Raises:
            SceneError: naming the value and what is allowed.
        """
        if not isinstance(given, Damping):
            raise SceneError(f"damping = {given!r} must be a barchan.Damping, such as Damping(local=0.7)")
        for name, dimension, below in (("local", "1", 1.0), ("viscous", "1/time", 1.0 / dt)):
            value = getattr(given, name)
            number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool) and isfinite(value)
            if not (number and 0.0 <= value < below):
                limit = "1" if name == "local" else f"1/dt = {below:g}"
                raise SceneError(f"damping: {name} = {value!r} [{dimension}] must be a number from 0 to below {limit}")
