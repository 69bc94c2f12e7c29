"""What the collapse of columns is made of: every parameter with its unit and its bounds."""

from math import pi

import numpy as np
from pydantic import Field, model_validator

from barchan.experiments.column import scaling
from barchan.experiments.scenes import LooseSand
from barchan.packing.lattice import mean_volume
from barchan.scene import quantity

#: Solid fraction with which the number of grains is found from an aspect ratio; the columns are measured when they stand.
SOLID_FRACTION = 0.57

#: How much further than published run-outs the glued floor reaches.
ROOM = 1.4


class Column(LooseSand):
    """Parameters of the collapse of columns that differ in their aspect ratios."""

    columns: int = Field(3, ge=1, le=16, description="number of columns side by side, each with an aspect ratio of its own")
    aspect_min: float = quantity(0.6, "1", "smallest ratio of height to radius", gt=0.0, le=100.0)
    aspect_max: float = quantity(2.4, "1", "largest; each is the same number of times the one before", gt=0.0, le=100.0)
    column_radius: float = quantity(0.06, "m", "radius of the columns", gt=0.0, le=1e3)
    youngs_modulus: float = quantity(6e6, "Pa", "Young's modulus of grains and walls; softer than glass", gt=0.0, le=1e15)
    friction: float = quantity(0.3, "1", "friction between grains, and at the floor; of glass beads", ge=0.0, le=1e3)
    wall_friction: float = quantity(0.3, "1", "friction at the cylinders around the columns", ge=0.0, le=1e3)
    dt: float = quantity(3e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.36, "s", "time before the cylinders are taken away", ge=0.0, le=1e4)
    duration: float = quantity(0.75, "s", "time after that", ge=0.0, le=1e4)
    frame_every: float = quantity(0.075, "s", "time between frames and profiles; duration is rounded up to it", gt=0.0)
    table_every: float = quantity(0.015, "s", "time between rows of the table", gt=0.0)

    @model_validator(mode="after")
    def _fits_together(self):
        if self.aspect_max < self.aspect_min or (self.columns > 1 and self.aspect_max == self.aspect_min):
            raise ValueError(
                f"aspect_max = {self.aspect_max:g} must exceed aspect_min = {self.aspect_min:g}, between which {self.columns} "
                f"columns lie; one column may have both the same"
            )
        if self.column_radius < 6.0 * self.radius_max:
            raise ValueError(f"column_radius = {self.column_radius:g} m must be three diameters of the largest grains at least")
        if self.aspect_min * self.column_radius < 2.0 * self.radius_max:
            raise ValueError(f"aspect_min = {self.aspect_min:g} makes a column lower than a grain; raise it or column_radius")
        return self

    @property
    def aspects(self):
        """Aspect ratios that are wanted, (columns,)."""
        return np.geomspace(self.aspect_min, self.aspect_max, self.columns)

    @property
    def grains(self):
        """Numbers of grains, one of each column."""
        volume = pi * self.column_radius**3 * SOLID_FRACTION / mean_volume(self.radius_min, self.radius_max)
        return [max(round(float(aspect) * volume), 1) for aspect in self.aspects]

    @property
    def floors(self):
        """Radii of the glued floors, (columns,) [m]."""
        return self.column_radius * (1.0 + ROOM * scaling.run_out(self.aspects)) + 4.0 * self.diameter

    @property
    def axes(self):
        """Where the axes of the columns are along x: floors touch, (columns,) [m]."""
        ends = np.cumsum(2.0 * self.floors)
        return ends - self.floors

    @property
    def release_step(self):
        """Step at which the cylinders are taken away."""
        return self.steps(self.equilibrate)

    @property
    def last_step(self):
        """Step at which the test ends, whole frames later."""
        return self.release_step + self.whole_frames(self.duration)
