"""barchan: granular flow and bonded grains, from a laptop to a cluster."""

from barchan import bonds, laws
from barchan.actions import Feed, Inlet, Outlet
from barchan.deformation import Deformation, StressServo
from barchan.domain import Box
from barchan.errors import BarchanError
from barchan.forces import Damping
from barchan.laws import Bond, Law, Property, bond, law
from barchan.materials import Material
from barchan.simulation import Simulation
from barchan.triggers import At, Every
from barchan.version import VERSION
from barchan.walls import Cone, Cylinder, Mesh, Plane, Sphere

__version__ = VERSION

__all__ = [
    "At",
    "BarchanError",
    "Bond",
    "Box",
    "Cone",
    "Cylinder",
    "Damping",
    "Deformation",
    "Every",
    "Feed",
    "Inlet",
    "Law",
    "Material",
    "Mesh",
    "Outlet",
    "Plane",
    "Property",
    "Simulation",
    "Sphere",
    "StressServo",
    "__version__",
    "bond",
    "bonds",
    "law",
    "laws",
]
