"""What a turning drum is made of: every parameter with its unit and its bounds."""

from math import pi
from typing import Literal

from pydantic import Field, model_validator

from barchan.experiments.scenes import LooseSand
from barchan.packing.lattice import mean_volume
from barchan.scene import quantity


class Drum(LooseSand):
    """Parameters of a turning drum. Its defaults are the grains and the speed of ``PAPER``, in a drum half as long."""

    ends: Literal["plates", "periodic"] = Field(
        "plates", description="what closes the drum: plates that turn with it, or nothing: its ends are one periodic face"
    )
    grains: int = Field(3000, ge=20, le=2_000_000, description="number of grains")
    drum_radius: float = quantity(0.069, "m", "inner radius of the drum", gt=0.0, le=1e3)
    length: float = quantity(0.0925, "m", "length of the drum between its ends", gt=0.0, le=1e4)
    rotation: float = quantity(2.198, "1/s", "angular velocity of the drum, in radians", gt=0.0, le=1e6)
    radius_min: float = quantity(2.975e-3, "m", "smallest radius of grains", gt=0.0, le=1e2)
    radius_max: float = quantity(2.975e-3, "m", "largest radius; they are uniform between", gt=0.0, le=1e2)
    density: float = quantity(1768.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)
    youngs_modulus: float = quantity(2.4e6, "Pa", "Young's modulus of grains and walls", gt=0.0, le=1e15)
    poisson_ratio: float = quantity(0.37, "1", "Poisson's ratio of grains and walls", ge=0.0, le=0.5)
    restitution: float = quantity(0.9, "1", "restitution of normal impacts", gt=0.0, le=1.0)
    friction: float = quantity(0.3, "1", "friction between grains", ge=0.0, le=1e3)
    wall_friction: float = quantity(0.3, "1", "friction at the drum and its plates", ge=0.0, le=1e3)
    rolling_friction: float = quantity(0.02, "1", "constant resistance to rolling, of grains and at walls", ge=0.0, le=1e3)
    dt: float = quantity(5e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.3, "s", "time before the drum turns", ge=0.0, le=1e4)
    develop: float = quantity(1.5, "s", "time of turning after which the flow counts as steady", ge=0.0, le=1e4)
    duration: float = quantity(5.0, "s", "time of turning", ge=0.0, le=1e4)
    frame_every: float = quantity(0.1, "s", "time between frames and profiles; duration is rounded up to it", gt=0.0)
    table_every: float = quantity(0.01, "s", "time between rows of the table", gt=0.0)

    @model_validator(mode="after")
    def _fits_together(self):
        for name in ("drum_radius", "length"):
            if getattr(self, name) < 6.0 * self.radius_max:
                raise ValueError(
                    f"{name} = {getattr(self, name):g} m has no room for a flow; it needs three diameters of the largest grains"
                )
        if self.develop >= self.duration > 0.0:
            raise ValueError(
                f"develop = {self.develop:g} s leaves nothing to measure of duration = {self.duration:g} s; it must be shorter"
            )
        return self

    @property
    def filling(self):
        """Volume of the grains over that of the drum."""
        return self.grains * mean_volume(self.radius_min, self.radius_max) / (pi * self.drum_radius**2 * self.length)

    @property
    def froude(self):
        """Centrifugal acceleration at the wall over gravity, omega^2 R / g."""
        return self.rotation**2 * self.drum_radius / self.gravity

    @property
    def turn_step(self):
        """Step at which the drum begins to turn."""
        return self.steps(self.equilibrate)

    @property
    def steady_step(self):
        """Step from which the flow counts as steady."""
        return self.turn_step + self.steps(self.develop)

    @property
    def last_step(self):
        """Step at which the test ends, whole frames later."""
        return self.turn_step + self.whole_frames(self.duration)


#: The drum whose angle was measured, with the grains calibrated to it, as the example "DEM parameter calibration in a rotating
#: drum" of the code Lethe tells.
PAPER = {
    "ends": "plates",
    "grains": 6000,
    "drum_radius": 0.069,
    "length": 0.185,
    "rotation": 2.198,
    "radius_min": 2.975e-3,
    "radius_max": 2.975e-3,
    "density": 1768.0,
    "youngs_modulus": 2.4e6,
    "poisson_ratio": 0.37,
    "restitution": 0.9,
    "friction": 0.3,
    "wall_friction": 0.3,
    "rolling_friction": 0.02,
}

#: Angle of the surface at the end plates of that drum, as measured [deg].
PAPER_ANGLE = 26.0
