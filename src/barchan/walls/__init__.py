"""Walls: distance, normal and velocity at a contact; what moves them, and what grains do to them. The laws of grains hold for
walls too."""

from barchan.walls.control import Control, ForceControl, Massive, Path, Proportional, Servo, Vibration, between
from barchan.walls.curved import Cone, Cylinder, Sphere
from barchan.walls.mesh import Mesh
from barchan.walls.plane import Plane
from barchan.walls.room import Room

__all__ = [
    "Cone",
    "Control",
    "Cylinder",
    "ForceControl",
    "Massive",
    "Mesh",
    "Path",
    "Plane",
    "Proportional",
    "Room",
    "Servo",
    "Sphere",
    "Vibration",
    "between",
]
