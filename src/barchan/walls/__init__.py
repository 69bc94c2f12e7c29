"""Walls: distance, normal and velocity at a contact. The laws of grains hold for walls too."""

from barchan.walls.plane import Plane

__all__ = ["Plane"]
