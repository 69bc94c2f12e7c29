"""What acts on grains besides their contacts."""

from barchan.forces.gravity import Gravity

__all__ = ["Gravity"]
