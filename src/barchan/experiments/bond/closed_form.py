"""What a bond between two grains carries that move as told, in closed form, and when it breaks.

The normal follows the grains. Let d be the distance of the centres at the start and s = n u the way after n steps.

Pulled: the force is kn A s. Spun by s / R_b, so that the edge of the bond moves by u in a step: the moment is ks J s / R_b. Both
are exact.

Sheared at right angles to the first normal: the distance grows to sqrt(d^2 + s^2), and the part of a step that is at right
angles to the normal at its middle is u d / sqrt(d^2 + s^2). So the force along the bond is kn A (sqrt(d^2 + s^2) - d), exact, and
that in its plane ks A d asinh(s / d), which the sum over steps exceeds by a share of at most (u / d)^2 / 24. The force in its
plane acts on each grain with the arm of half the present distance.

Stresses at the edge are kn s when pulled, ks s when spun, kn (sqrt(d^2 + s^2) - d) and ks d asinh(s / d) when sheared.
"""

from math import ceil
from typing import NamedTuple

import numpy as np


class Curves(NamedTuple):
    """``pull`` along the bond and ``shear`` force in its plane [N], ``twisting`` and ``bending`` moment [N m], stresses at the
    edge in ``tension`` and in ``shear_stress`` [Pa], ``force`` [N] and ``moment`` [N m] on a grain, (n,) each."""

    pull: np.ndarray
    shear: np.ndarray
    twisting: np.ndarray
    bending: np.ndarray
    tension: np.ndarray
    shear_stress: np.ndarray
    force: np.ndarray
    moment: np.ndarray


def curves(scene, test, steps):
    """``Curves`` of a test, one of ``TESTS``, while its bond holds, after (n,) steps."""
    way, distance, nothing = scene.increment * np.asarray(steps), 2.0 * scene.radius, np.zeros(len(steps))
    kn, ks = scene.bond_normal_stiffness, scene.bond_shear_stiffness
    if test == "spin":
        twisting = ks * scene.polar_moment * way / scene.bond_radius
        return Curves(nothing, nothing, twisting, nothing, nothing, ks * way, nothing, twisting)
    if test == "pull":
        pull = kn * scene.area * way
        return Curves(pull, nothing, nothing, nothing, kn * way, nothing, pull, nothing)
    present = np.hypot(distance, way)
    stretch, slip = way * way / (present + distance), distance * np.arcsinh(way / distance)
    pull, shear = kn * scene.area * stretch, ks * scene.area * slip
    return Curves(pull, shear, nothing, nothing, kn * stretch, ks * slip, np.hypot(pull, shear), 0.5 * present * shear)


def breaks(scene, test):
    """(step, mode) in which the bond of a test breaks."""
    distance = 2.0 * scene.radius
    stretch, slip = scene.tensile_strength / scene.bond_normal_stiffness, scene.shear_strength / scene.bond_shear_stiffness
    if test == "pull":
        ways = {"tension": stretch}
    elif test == "spin":
        ways = {"torsion": slip}
    else:
        ways = {"tension": np.sqrt(stretch * (2.0 * distance + stretch)), "shear": distance * np.sinh(slip / distance)}
    mode = min(ways, key=ways.get)
    return ceil(ways[mode] / scene.increment), mode
