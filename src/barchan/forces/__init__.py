"""What acts on grains besides their contacts."""

from barchan.forces.damping import Damping
from barchan.forces.gravity import Gravity

__all__ = ["Damping", "Gravity"]
