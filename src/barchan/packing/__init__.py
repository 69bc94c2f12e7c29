"""Starting states: sizes of grains, places of grains, samples brought to a pressure or a solid fraction."""

from barchan.packing.compact import compact
from barchan.packing.packing import Packing
from barchan.packing.preparation import Preparation, Sample
from barchan.packing.press import hold, press
from barchan.packing.read import read_packing
from barchan.packing.sizes import Sieves

__all__ = ["Packing", "Preparation", "Sample", "Sieves", "compact", "hold", "press", "read_packing"]
