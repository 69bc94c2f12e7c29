"""Damping of grains as a whole: what is taken from the sums of forces and torques before they move the grains."""

from math import copysign

from barchan.kernels.compiler import helper, kernel, on_one_thread, prange


@helper
def damped(sum_of_all, velocity, inertia, local, viscous):
    """One component of force or torque, less alpha |F| in the direction of its velocity, less c m v."""
    taken = copysign(local * abs(sum_of_all), velocity) if velocity != 0.0 else 0.0
    return sum_of_all - taken - viscous * inertia * velocity


@kernel(parallel=True)
def damp(motion, spin, local, viscous, force, torque):
    """``force`` and ``torque`` are modified. Those on frozen grains, whose inverse mass is 0, stay: they move as told.

    Args:
        motion, spin: (n, 4) velocities at the half step before, inverse mass and inverse inertia.
        local: alpha; viscous: c [1/time].
    """
    for i in prange(force.shape[0]):
        if motion[i, 3] > 0.0:
            mass = 1.0 / motion[i, 3]
            inertia = 1.0 / spin[i, 3]
            for c in range(3):
                force[i, c] = damped(force[i, c], motion[i, c], mass, local, viscous)
                torque[i, c] = damped(torque[i, c], spin[i, c], inertia, local, viscous)


damp_alone = on_one_thread(damp)
