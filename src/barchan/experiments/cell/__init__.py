"""A cuboid cell of six walls, and what the tests of samples in it share: parameters, rain, tables, checks, pictures."""

from barchan.experiments.cell.walls import WALLS, Cell

__all__ = ["WALLS", "Cell"]
