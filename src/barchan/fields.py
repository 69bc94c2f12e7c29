"""The table of fields: everything that a grain carries, in one place.

A *field* is what users see (``grains.position``). A *block* is the array that stores it. Fields that the pair loop reads
together share a block of rows of four numbers, so that one cache line serves a whole gather (measured: 4.2 ns a contact
against 6.5 with separate arrays).
"""

from typing import NamedTuple

import numpy as np


class Field(NamedTuple):
    """One property of a grain.

    ``ghosted``: sent when ghosts are built. ``updated``: may change every step, so it is sent again on every step in
    which the law reads it. ``saved``: part of a checkpoint (what can be derived from saved fields is not).
    """

    name: str
    dtype: type
    width: int
    dimension: str
    default: float
    block: str
    column: int = 0
    ghosted: bool = False
    updated: bool = False
    saved: bool = True
    help: str = ""


TABLE = (
    Field("position", np.float64, 3, "length", 0.0, "place", 0, True, True, help="centre, wrapped into the box"),
    Field("radius", np.float64, 1, "length", 0.0, "place", 3, True, help="radius"),
    Field("velocity", np.float64, 3, "length/time", 0.0, "motion", 0, True, True, help="velocity at the half step n-1/2"),
    Field("inverse_mass", np.float64, 1, "1/mass", 0.0, "motion", 3, True, saved=False, help="1/mass; 0 when frozen"),
    Field("omega", np.float64, 3, "1/time", 0.0, "spin", 0, True, True, help="angular velocity at the half step n-1/2"),
    Field(
        "inverse_inertia", np.float64, 1, "1/(mass length^2)", 0.0, "spin", 3, True, saved=False, help="1/inertia; 0 when frozen"
    ),
    Field("id", np.int64, 1, "1", -1, "id", ghosted=True, help="stable number, never used again"),
    Field("material", np.uint32, 1, "1", 0, "material", ghosted=True, help="index into the list of materials"),
    Field("frozen", np.uint8, 1, "1", 0, "frozen", ghosted=True, help="1: immobile, moves only as told"),
    Field("mass", np.float64, 1, "mass", 0.0, "mass", help="mass"),
    Field("inertia", np.float64, 1, "mass length^2", 0.0, "inertia", help="moment of inertia about any axis"),
    Field("image", np.int32, 3, "1", 0, "image", help="how often the grain has left through each periodic face"),
    Field("force", np.float64, 3, "force", 0.0, "force", help="total force at step n, equation (9)"),
    Field("torque", np.float64, 3, "force length", 0.0, "torque", help="total torque at step n, equation (10)"),
)

#: Fields that users read and barchan writes.
DERIVED = ("id", "inverse_mass", "inverse_inertia")

#: Fields whose change by the user makes the forces of the present step out of date.
PHYSICAL = ("position", "velocity", "omega", "radius", "mass", "inertia", "material", "frozen")


def block_layout(table):
    """Block name -> (dtype, number of columns), in the order of ``table``."""
    layout = {}
    for field in table:
        dtype, columns = layout.get(field.block, (field.dtype, 0))
        layout[field.block] = (dtype, max(columns, field.column + field.width))
    return layout
