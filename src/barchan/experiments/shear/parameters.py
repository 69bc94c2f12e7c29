"""What simple shear is made of: every parameter with its unit and its bounds."""

from bisect import bisect_right
from math import log, pi, sqrt
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from barchan.experiments.scenes import Graded
from barchan.packing.lattice import mean_volume
from barchan.scene import quantity

#: Rows of the table while a stage is averaged, and how many of them make one row of profiles.
ROWS, ROWS_OF_PROFILE = 100, 2


class Shear(Graded):
    """Parameters of simple shear: x is the flow, z the gradient. The default are grains softer than glass."""

    extendable: ClassVar = ("rates",)

    grains: int = Field(1500, ge=100, le=10**9, description="number of grains")
    radius_min: float = quantity(0.45e-3, "m", "smallest radius", gt=0.0, le=1e2)
    radius_max: float = quantity(0.55e-3, "m", "largest radius; they are uniform between", gt=0.0, le=1e2)
    pressure: float = quantity(1e3, "Pa", "normal stress along the gradient; it is held", gt=0.0, le=1e12)
    stiffness: float = quantity(2e3, "N/m", "normal stiffness of contacts", gt=0.0, le=1e15)
    stiffness_ratio: float = quantity(3.5, "1", "normal over tangential stiffness", gt=0.0, le=1e2)
    restitution: float = quantity(0.7, "1", "restitution of normal impacts of grains of the mean size", gt=0.0, le=1.0)
    friction: float = quantity(0.5, "1", "friction between grains", ge=0.0, le=1e3)
    inertial_number: float = quantity(0.3, "1", "of the first stage", gt=0.0, le=10.0)
    rates: int = Field(6, ge=1, le=30, description="number of stages; the shear rate of each is half of that before")
    start: float = quantity(1.0, "1", "strain of the loose grains before the first stage, at its rate", ge=0.0, le=1e3)
    settle: float = quantity(0.6, "1", "strain of each stage before it is averaged", ge=0.0, le=1e3)
    strain: float = quantity(1.5, "1", "strain over which each stage is averaged", gt=0.0, le=1e4)
    dt: float = quantity(3.5e-6, "s", "time step", ge=1e-12, le=1.0)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and places")

    @model_validator(mode="after")
    def _fits_together(self):
        steps = self.strain / (self.shear_rates[0] * self.dt)
        if steps < ROWS:
            raise ValueError(
                f"strain = {self.strain:g} at inertial_number = {self.inertial_number:g} takes {steps:.3g} steps; the average of "
                f"a stage is over {ROWS} rows, so it must be {ROWS} steps at least: give a smaller dt, or a larger strain"
            )
        return self

    @property
    def mass(self):
        """Mean mass of a grain [kg]."""
        return self.density * mean_volume(self.radius_min, self.radius_max)

    @property
    def dashpot(self):
        """gamma_n of the law, with which two grains of the mean mass part with the ``restitution`` of a linear spring:
        e = exp(-pi b / sqrt(w^2 - b^2)), with b = gamma_n / 2 and w^2 = 2 stiffness / mass [1/s]."""
        loss = -log(self.restitution)
        return 2.0 * loss * sqrt(2.0 * self.stiffness / self.mass) / sqrt(pi * pi + loss * loss)

    @property
    def inertial_numbers(self):
        """Those of the stages, (rates,) [1]."""
        return self.inertial_number * 0.5 ** np.arange(self.rates)

    @property
    def shear_rates(self):
        """I sqrt(pressure / density) / diameter, (rates,) [1/s]."""
        return self.inertial_numbers * sqrt(self.pressure / self.density) / self.diameter

    def steps(self, strain, stage):
        """Number of time steps in a strain at the rate of a stage."""
        return round(strain / (float(self.shear_rates[stage]) * self.dt))

    @property
    def row_steps(self):
        """Steps between rows of the table in each stage, (rates,)."""
        return [max(self.steps(self.strain, stage) // ROWS, 1) for stage in range(self.rates)]

    @property
    def begins(self):
        """Steps from which on each stage is averaged, (rates,)."""
        return [end - ROWS * every for end, every in zip(self.ends, self.row_steps)]

    @property
    def ends(self):
        """Steps at which the stages end, (rates,)."""
        lengths = [self.steps(self.settle, stage) + ROWS * every for stage, every in enumerate(self.row_steps)]
        return (self.steps(self.start, 0) + np.cumsum(lengths)).tolist()

    def stage(self, step):
        """The stage that goes on after a step."""
        return min(bisect_right(self.ends, step), self.rates - 1)
