"""Measures: they read the state and change nothing."""

from barchan.measure.contact_table import contact_table, wall_force
from barchan.measure.energy import KineticEnergy

__all__ = ["KineticEnergy", "contact_table", "wall_force"]
