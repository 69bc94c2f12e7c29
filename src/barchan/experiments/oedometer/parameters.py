"""What an oedometer test is made of: every parameter with its unit and its bounds."""

from typing import ClassVar

import numpy as np
from pydantic import model_validator

from barchan.experiments.cell.scene import CellScene
from barchan.scene import quantity


class Oedometer(CellScene):
    """Parameters of the oedometer test. The default is a small, flat sample of grains softer and larger than sand, loaded faster
    than in a laboratory, but still slowly beside its own waves.
    """

    extendable: ClassVar = ("rest",)

    width: float = quantity(32e-3, "m", "edge of the square base", gt=0.0, le=1e3)
    height: float = quantity(18e-3, "m", "above which grains are removed after the rain", gt=0.0, le=1e3)
    rain: float = quantity(0.12, "s", "time in which grains fall and come to rest", ge=0.0, le=1e4)
    initial_stress: float = quantity(10e3, "Pa", "stress on the top before it grows", gt=0.0, le=1e12)
    stress_rate: float = quantity(1.5e6, "Pa/s", "rate at which the stress grows and is taken back", gt=0.0, le=1e15)
    max_stress: float = quantity(120e3, "Pa", "largest stress on the top", gt=0.0, le=1e12)
    hold: float = quantity(0.005, "s", "time at the largest stress", ge=0.0, le=1e4)
    end_stress: float = quantity(20e3, "Pa", "stress on the top after unloading", gt=0.0, le=1e12)
    rest: float = quantity(0.01, "s", "time at the end stress", ge=0.0, le=1e4)

    dt: float = quantity(2e-6, "s", "time step", ge=1e-12, le=1.0)
    table_every: float = quantity(2e-4, "s", "time between rows of the table while the sample is loaded", gt=0.0, le=1e4)

    @model_validator(mode="after")
    def _fits_together(self):
        for name in ("initial_stress", "end_stress"):
            if self.max_stress <= getattr(self, name):
                raise ValueError(f"max_stress = {self.max_stress:g} Pa must exceed {name} = {getattr(self, name):g} Pa")
        return self

    @property
    def ends(self):
        """Steps at which rain, seat, load, hold, unload and rest end."""
        up, down = ((self.max_stress - low) / self.stress_rate for low in (self.initial_stress, self.end_stress))
        return np.cumsum([self.steps(time) for time in (self.rain, self.seat, up, self.hold, down, self.rest)]).tolist()

    def target(self, step):
        """Stress that the top shall have at a step, once the rain is over [Pa]."""
        stresses = (self.initial_stress, self.max_stress, self.max_stress, self.end_stress)
        return float(np.interp(step, self.ends[1:5], stresses))
