"""What a compression test is made of: every parameter with its unit, its bounds and the paper's value."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from barchan.experiments.cell.scene import CellScene
from barchan.scene import quantity


class Compression(CellScene):
    """Parameters of the compression test. Where Marketos et al. 2013 state a value, ``PAPER`` holds it: theirs ran for two days
    on 256 cores. The default is a small sample of softer, larger grains, loaded faster, but still slowly beside its own waves.
    """

    extendable: ClassVar = ("hold",)

    hold: float = quantity(0.005, "s", "time at the end stress", ge=0.0, le=1e4)
    end_stress: float = quantity(100e3, "Pa", "stress on all walls at the end", gt=0.0, le=1e12)
    controller: Literal["servo", "proportional"] = Field("servo", description="what moves the walls")
    gain: float = quantity(0.01, "m/N/s", "of the proportional controller", gt=0.0, le=1e9)

    @model_validator(mode="after")
    def _fits_together(self):
        if self.end_stress <= self.initial_stress:
            raise ValueError(f"end_stress = {self.end_stress:g} Pa must exceed initial_stress = {self.initial_stress:g} Pa")
        return self

    @property
    def ends(self):
        """Steps at which rain, seat, load and hold end."""
        times = (self.rain, self.seat, (self.end_stress - self.initial_stress) / self.stress_rate, self.hold)
        return np.cumsum([self.steps(time) for time in times]).tolist()

    def target(self, step):
        """Stress that the walls shall have at a step, once the rain is over [Pa]."""
        _, seated, loaded, _ = self.ends
        share = min(max(step - seated, 0) / max(loaded - seated, 1), 1.0)
        return self.initial_stress + share * (self.end_stress - self.initial_stress)


#: What the paper says of its sample of fine glass beads, in the units of the parameters.
PAPER = {"stress_rate": 200e3, "end_stress": 100e3, "controller": "proportional"}
