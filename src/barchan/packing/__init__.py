"""Starting states: sizes of grains, places of grains."""

from barchan.packing.sizes import Sieves

__all__ = ["Sieves"]
