"""Starting states: sizes of grains, places of grains."""

from barchan.packing.packing import Packing
from barchan.packing.read import read_packing
from barchan.packing.sizes import Sieves

__all__ = ["Packing", "Sieves", "read_packing"]
