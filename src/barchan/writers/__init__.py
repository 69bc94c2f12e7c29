"""Writers: what saves results when it is due. They read the simulation and change nothing.

A writer has ``due(step)`` and ``write(sim)``, which all ranks call; rank 0 writes, and where it cannot, all ranks stop.
"""

from barchan.writers.dump import LammpsDump
from barchan.writers.frames import ContactFrames, FrameFile, GrainFrame, GrainFrames, MeshFrames, frames, read_grain_frame
from barchan.writers.table import Table, read_table
from barchan.writers.wall_columns import wall_columns

__all__ = [
    "ContactFrames",
    "FrameFile",
    "GrainFrame",
    "GrainFrames",
    "LammpsDump",
    "MeshFrames",
    "Table",
    "frames",
    "read_grain_frame",
    "read_table",
    "wall_columns",
]
