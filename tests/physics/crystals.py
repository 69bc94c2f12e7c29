"""Crystals of equal glass spheres in a periodic box, pressed: what waves and crushing of them follow in closed form.

Stiffnesses are those of Hertz and Mindlin, kn = 2 E* a and kt = 8 G* a, with E* = G/(1 - nu) and 8 G* = 4 G/(2 - nu).
"""

from math import pi, sqrt
from typing import NamedTuple

import numpy as np

import barchan as bc

DIAMETER, SHEAR, POISSON, DENSITY = 1e-3, 29.17e9, 0.2, 2650.0
MASS = DENSITY * pi / 6.0 * DIAMETER**3

#: Edges of a cell in distances of neighbours, its grains, and the force of a contact over pressure and the distance's square.
_ROOT = sqrt(2.0)
_FACES = ((0.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5))
LATTICES = {
    "SC": ((1.0, 1.0, 1.0), ((0.0, 0.0, 0.0),), 1.0),
    "FCC [100]": ((_ROOT,) * 3, _FACES, 1.0 / (2.0 * _ROOT)),
    "FCC [110]": ((1.0, 1.0, _ROOT), ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)), 1.0 / (2.0 * _ROOT)),  # x along [110], z along [001]
}


class Contact(NamedTuple):
    """Of two grains that a force presses together: overlap [m], normal and tangential stiffness [N/m]."""

    overlap: float
    kn: float
    kt: float

    @classmethod
    def under(cls, force):
        """Hertz: a^3 = 3 F R* / (4 E*), with R* = D/4."""
        modulus, radius = SHEAR / (1.0 - POISSON), 0.25 * DIAMETER
        a = (0.75 * force * radius / modulus) ** (1.0 / 3.0)
        return cls(a * a / radius, 2.0 * modulus * a, 4.0 * SHEAR / (2.0 - POISSON) * a)


def crystal(kind, cells, pressure, friction=0.5):
    """A crystal under an isotropic pressure, at rest.

    Args:
        kind: of ``LATTICES``.
        cells: along each axis.

    Returns:
        (simulation, ``Contact``).
    """
    edges, basis, share = LATTICES[kind]
    distance = DIAMETER
    for _ in range(20):  # the force depends on the distance, hardly
        contact = Contact.under(share * pressure * distance**2)
        distance = DIAMETER - contact.overlap
    edge = distance * np.array(edges)
    glass = bc.Material(
        "glass", density=DENSITY, youngs_modulus=2.0 * SHEAR * (1.0 + POISSON), poisson_ratio=POISSON, friction=friction
    )
    box = bc.Box((0.0,) * 3, edge * cells, (True,) * 3)
    sim = bc.Simulation(box, bc.laws.hertz_mindlin, glass, 0.15 * sqrt(MASS / contact.kn), threads=1)
    corners = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    sim.add_grains(((corners + np.array(basis) + 0.25) * edge).reshape(-1, 3), 0.5 * DIAMETER)
    sim.skin, sim.check_dt = 0.05 * DIAMETER, False  # which is for overlaps of 5 %: here they are of 1e-4
    return sim, contact
