"""What the discharge of a silo is made of: every parameter with its unit and its bounds."""

from math import pi

import numpy as np
from pydantic import Field, model_validator

from barchan.experiments.scenes import LooseSand
from barchan.scene import quantity


class Silo(LooseSand):
    """Parameters of the discharge of silos that differ in their outlets."""

    grains: int = Field(7000, ge=20, le=2_000_000, description="number of grains in each silo")
    outlets: int = Field(4, ge=1, le=16, description="number of silos side by side, each with an outlet of its own")
    outlet_min: float = quantity(0.025, "m", "diameter of the smallest outlet", gt=0.0, le=1e3)
    outlet_max: float = quantity(0.04, "m", "diameter of the largest; they are evenly spaced between", gt=0.0, le=1e3)
    silo_diameter: float = quantity(0.08, "m", "inner diameter of the silos", gt=0.0, le=1e3)
    youngs_modulus: float = quantity(1e7, "Pa", "Young's modulus of grains and walls; softer than glass", gt=0.0, le=1e15)
    friction: float = quantity(0.2, "1", "friction between grains; of smooth glass beads", ge=0.0, le=1e3)
    wall_friction: float = quantity(0.3, "1", "friction at the wall of the silo", ge=0.0, le=1e3)
    floor_friction: float = quantity(0.3, "1", "friction at its floor", ge=0.0, le=1e3)
    dt: float = quantity(2.4e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.36, "s", "time to come to rest in", ge=0.0, le=1e4)
    slide: float = quantity(
        0.09, "s", "time after that in which walls slide up along the sand; half as long they then stand", ge=0.0, le=1e4
    )
    slide_speed: float = quantity(2e-3, "m/s", "their speed then; their friction points one way", ge=0.0, le=1e3)
    duration: float = quantity(0.9, "s", "time after the outlets are opened", ge=0.0, le=1e4)
    frame_every: float = quantity(0.15, "s", "time between frames and profiles; duration is rounded up to it", gt=0.0)
    table_every: float = quantity(0.015, "s", "time between rows of the table", gt=0.0)

    @model_validator(mode="after")
    def _fits_together(self):
        if self.outlet_max < self.outlet_min or (self.outlets > 1 and self.outlet_max == self.outlet_min):
            raise ValueError(
                f"outlet_max = {self.outlet_max:g} m must exceed outlet_min = {self.outlet_min:g} m, from which {self.outlets} "
                f"outlets are evenly spaced; one outlet may have both the same"
            )
        if self.outlet_max > self.silo_diameter - 4.0 * self.radius_max:
            raise ValueError(
                f"silo_diameter = {self.silo_diameter:g} m must exceed outlet_max = {self.outlet_max:g} m by two diameters of "
                f"the largest grains"
            )
        if self.slide * self.slide_speed > self.radius_min:
            raise ValueError(
                f"slide = {self.slide:g} s at slide_speed = {self.slide_speed:g} m/s lifts the walls off the floor by more than "
                f"radius_min = {self.radius_min:g} m, and grains would leave there"
            )
        return self

    @property
    def outlet_diameters(self):
        """Diameters of the outlets, (outlets,) [m]."""
        return np.linspace(self.outlet_min, self.outlet_max, self.outlets)

    @property
    def area(self):
        """Cross-section of a silo [m^2]."""
        return 0.25 * pi * self.silo_diameter**2

    @property
    def axes(self):
        """Where the axes of the silos are along x, (outlets,) [m]: two diameters of the largest grains between the walls."""
        return (self.silo_diameter + 4.0 * self.radius_max) * np.arange(self.outlets)

    @property
    def slide_step(self):
        """Step at which the walls begin to slide."""
        return self.steps(self.equilibrate)

    @property
    def stand_step(self):
        """Step at which they stop."""
        return self.slide_step + self.steps(self.slide)

    @property
    def open_step(self):
        """Step at which the outlets are opened."""
        return self.stand_step + self.steps(0.5 * self.slide)

    @property
    def last_step(self):
        """Step at which the test ends, whole frames later."""
        return self.open_step + self.whole_frames(self.duration)
