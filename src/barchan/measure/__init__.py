"""Measures: they read the state and change nothing."""

from barchan.measure.account import EnergyAccount
from barchan.measure.bond_table import bond_table
from barchan.measure.coarse_grain import CoarseFields, coarse_grain
from barchan.measure.contact_statistics import ContactStatistics
from barchan.measure.contact_table import contact_table
from barchan.measure.coordination import Coordination, coordination
from barchan.measure.energy import EnergyBudget, KineticEnergy
from barchan.measure.fabric import Fabric, fabric
from barchan.measure.fragments import Fragments, fragments
from barchan.measure.front import Front
from barchan.measure.inertial_number import inertial_number
from barchan.measure.jet import Jet
from barchan.measure.laguerre import LaguerreCells, laguerre_cells
from barchan.measure.profile import Profile
from barchan.measure.sliding import sliding_fraction
from barchan.measure.solid_fraction import solid_fraction, void_ratio
from barchan.measure.strain import Strain, strain
from barchan.measure.stress import Stress, stress
from barchan.measure.triangle_forces import triangle_forces, triangle_torques
from barchan.measure.unbalanced_force import unbalanced_force

__all__ = [
    "CoarseFields",
    "ContactStatistics",
    "Coordination",
    "EnergyAccount",
    "EnergyBudget",
    "Fabric",
    "Fragments",
    "Front",
    "Jet",
    "KineticEnergy",
    "LaguerreCells",
    "Profile",
    "Strain",
    "Stress",
    "bond_table",
    "coarse_grain",
    "contact_table",
    "coordination",
    "fabric",
    "fragments",
    "inertial_number",
    "laguerre_cells",
    "sliding_fraction",
    "solid_fraction",
    "strain",
    "stress",
    "triangle_forces",
    "triangle_torques",
    "unbalanced_force",
    "void_ratio",
]
