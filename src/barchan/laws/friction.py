"""How the memory of a frictional contact is carried from one step to the next.

The leap-frog knows positions at full steps and velocities at half steps. Adding a half-step slip to a memory that lies in
the plane of a full-step normal makes an error that accumulates; small grains then stick between large ones once the size
ratio exceeds about three (Vyas et al., Comput. Phys. Commun. 310, 109524, 2025). ``synchronised`` adds the slip in the
plane of the half-step normal, where it belongs, and is the default of every law here; ``standard`` is what most codes do.
"""

from barchan.laws.vector import add, norm, project, scale, turn


def synchronised(memory, rate, normal_half, normal, dt):
    """Turn ``memory`` onto the half-step plane, add ``dt rate`` there, turn it onto the full-step plane."""
    return turn(add(turn(memory, normal_half), scale(dt, rate)), normal)


def standard(memory, rate, normal, dt):
    """Add ``dt rate`` and project onto the plane of the full-step normal."""
    return project(add(memory, scale(dt, rate)), normal)


def sliding_ratio(trial, limit):
    """Coulomb: the factor that shortens the trial force to ``limit`` when the contact slides, else 1. Equation (7)."""
    size = norm(trial)
    return limit / size if size > limit else 1.0
