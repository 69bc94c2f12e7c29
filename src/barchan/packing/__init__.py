"""Starting states: sizes of grains, places of grains, samples brought to a pressure or a solid fraction."""

from barchan.packing.compact import compact
from barchan.packing.packing import Packing
from barchan.packing.preparation import Preparation, Sample
from barchan.packing.press import hold, press
from barchan.packing.read import read_packing
from barchan.packing.scatter import scatter
from barchan.packing.sieves import Sieves
from barchan.packing.sizes import Exponential, LogNormal, Uniform

__all__ = [
    "Exponential",
    "LogNormal",
    "Packing",
    "Preparation",
    "Sample",
    "Sieves",
    "Uniform",
    "compact",
    "hold",
    "press",
    "read_packing",
    "scatter",
]
