"""Measures: they read the state and change nothing."""

from barchan.measure.contact_statistics import ContactStatistics
from barchan.measure.contact_table import contact_table
from barchan.measure.energy import EnergyBudget, KineticEnergy
from barchan.measure.front import Front
from barchan.measure.jet import Jet
from barchan.measure.profile import Profile

__all__ = ["ContactStatistics", "EnergyBudget", "Front", "Jet", "KineticEnergy", "Profile", "contact_table"]
