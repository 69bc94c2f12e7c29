"""What a test of a bond is made of: every parameter with its unit and its bounds."""

from math import pi
from typing import ClassVar

from pydantic import Field, model_validator

from barchan.scene import Scene, quantity

#: How far a grain may be moved, in radii: further out the box ends.
LONGEST_WAY = 5.0


class BondTest(Scene):
    """Parameters of the test of a bond between two grains. In each step one grain of a pair is moved by ``increment``, or spun so
    far that the edge of the bond is. The defaults break the bond in steps 3,000, 10,000 and 10,000, as Marketos 2013 has it:
    each strength is half an increment below the stress in that step, where rounding does not decide.
    """

    extendable: ClassVar = ("steps",)

    radius: float = quantity(0.5, "m", "radius of the grains, which just touch", gt=0.0, le=1e3)
    radius_factor: float = quantity(1.0, "1", "radius of the bond, relative to that of the grains", gt=0.0, le=1e2)
    bond_normal_stiffness: float = quantity(1e10, "Pa/m", "stress of the bond by the way in which it is pulled", gt=0.0, le=1e20)
    bond_shear_stiffness: float = quantity(4e9, "Pa/m", "the same in shear", gt=0.0, le=1e20)
    tensile_strength: float = quantity(29.995e6, "Pa", "stress at which the bond breaks in tension", gt=0.0, le=1e15)
    shear_strength: float = quantity(39.998e6, "Pa", "the same in shear and in torsion", gt=0.0, le=1e15)
    contact_normal_stiffness: float = quantity(1e9, "N/m", "of the contact law", gt=0.0, le=1e20)
    contact_shear_stiffness: float = quantity(1e9, "N/m", "of the contact law", gt=0.0, le=1e20)
    friction: float = quantity(0.5, "1", "friction coefficient of the contact law", ge=0.0, le=1e3)
    increment: float = quantity(1e-6, "m", "way of a step", gt=0.0, le=1e3)
    steps: int = Field(12_000, ge=1, le=10_000_000, description="number of steps")
    dt: float = quantity(1e-4, "s", "time step", ge=1e-12, le=1.0)
    table_steps: int = Field(10, ge=1, le=10_000_000, description="steps between rows of the table")

    @model_validator(mode="after")
    def _fits_together(self):
        if self.increment * self.steps > LONGEST_WAY * self.radius:
            raise ValueError(
                f"increment = {self.increment:g} m makes {self.increment * self.steps:g} m in {self.steps} steps; at most "
                f"{LONGEST_WAY:g} radii are allowed"
            )
        if self.steps % self.table_steps:
            raise ValueError(f"steps = {self.steps} must be a multiple of table_steps = {self.table_steps}, to see the last")
        return self

    @property
    def speed(self):
        """Of the grain that is pulled or sheared [m/s]."""
        return self.increment / self.dt

    @property
    def bond_radius(self):
        """Of the disc [m]."""
        return self.radius_factor * self.radius

    @property
    def area(self):
        """Of the disc [m^2]."""
        return pi * self.bond_radius**2

    @property
    def polar_moment(self):
        """Polar moment of area of the disc [m^4]."""
        return 0.5 * self.area * self.bond_radius**2
