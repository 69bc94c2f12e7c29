"""Bonds between grains: a list of their own, beside the neighbour list, that travels with the grains."""

from barchan.bonds.bonds import Bonds
from barchan.bonds.install import Weibull, install

__all__ = ["Bonds", "Weibull", "install"]
