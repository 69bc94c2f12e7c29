"""What the scenes of several experiments share: grains of uniform radii, loose sand, and the steps at which it is looked at."""

from math import ceil
from typing import ClassVar

from pydantic import Field, model_validator

from barchan.scene import Scene, quantity


class Graded(Scene):
    """Grains whose radii are uniform between two."""

    radius_min: float = quantity(2.2e-3, "m", "smallest radius of grains", gt=0.0, le=1e2)
    radius_max: float = quantity(2.8e-3, "m", "largest radius; they are uniform between", gt=0.0, le=1e2)
    density: float = quantity(2500.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)

    @model_validator(mode="after")
    def _radii_ascend(self):
        if self.radius_max < self.radius_min:
            raise ValueError(f"radius_max = {self.radius_max:g} m is below radius_min = {self.radius_min:g} m")
        return self

    @property
    def diameter(self):
        """Mean diameter [m]."""
        return self.radius_min + self.radius_max


class LooseSand(Graded):
    """Sand that comes to rest under gravity, and then is let go; defaults are those of glass beads, but softer."""

    extendable: ClassVar = ("duration",)

    youngs_modulus: float = quantity(1e7, "Pa", "Young's modulus of grains and walls; softer than glass", gt=0.0, le=1e15)
    poisson_ratio: float = quantity(0.3, "1", "Poisson's ratio of grains and walls", ge=0.0, le=0.5)
    restitution: float = quantity(0.3, "1", "restitution of normal impacts", gt=0.0, le=1.0)
    friction: float = quantity(0.3, "1", "friction between grains", ge=0.0, le=1e3)
    gravity: float = quantity(9.81, "m/s^2", "acceleration of gravity", gt=0.0, le=1e6)
    dt: float = quantity(2.4e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.36, "s", "time to come to rest in", ge=0.0, le=1e4)
    duration: float = quantity(0.9, "s", "time after that", ge=0.0, le=1e4)
    frame_every: float = quantity(0.1, "s", "time between frames and profiles; duration is rounded up to it", gt=0.0)
    table_every: float = quantity(0.015, "s", "time between rows of the table", gt=0.0)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and places")

    def steps(self, seconds):
        """Number of time steps in a simulated time [s]."""
        return round(seconds / self.dt)

    @property
    def row_steps(self):
        """Steps between rows of the table."""
        return max(self.steps(self.table_every), 1)

    @property
    def frame_steps(self):
        """Steps between frames: a whole number of rows, so that the table has a row with each."""
        return self.row_steps * max(round(self.steps(self.frame_every) / self.row_steps), 1)

    def whole_frames(self, seconds):
        """Steps of a simulated time [s], rounded up to whole frames."""
        return self.frame_steps * ceil(self.steps(seconds) / self.frame_steps)
