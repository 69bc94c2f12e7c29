"""What a test with bender elements is made of: every parameter with its unit and its bounds."""

from math import pi
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from barchan.experiments.bender.elastic import stable_step, stiffest_contact
from barchan.experiments.scenes import Graded
from barchan.packing.lattice import mean_volume
from barchan.scene import quantity


class Shot(NamedTuple):
    """A pulse and the time in which it is listened to: ``kind`` "S" or "P", ``axis`` along which grains are shaken, frequency
    [1/s], steps at which it begins and ends, and at which grains have come to rest after it."""

    kind: str
    axis: int
    frequency: float
    begin: int
    end: int
    rested: int

    @property
    def name(self):
        """For a person."""
        return f"{self.kind}, {1e-3 * self.frequency:.4g} kHz"


class Bender(Graded):
    """Parameters of waves through a sample. The default has the stiffness of glass, and a thousandth of the paper's grains."""

    extendable: ClassVar = ("sweep",)

    packing: Literal["random", "fcc"] = Field("random", description="how grains are packed: pressed sand, or a crystal")
    across: int = Field(8, ge=3, le=1000, description="width of the sample in mean diameters")
    along: int = Field(120, ge=10, le=100_000, description="its length; waves run along it both ways from the middle")
    radius_min: float = quantity(0.45e-3, "m", "smallest radius", gt=0.0, le=1e2)
    radius_max: float = quantity(0.55e-3, "m", "largest radius, uniform between; a crystal has the mean", gt=0.0, le=1e2)
    density: float = quantity(2650.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)
    youngs_modulus: float = quantity(70e9, "Pa", "Young's modulus of the grains", gt=0.0, le=1e15)
    poisson_ratio: float = quantity(0.2, "1", "Poisson's ratio of the grains", ge=0.0, le=0.5)
    restitution: float = quantity(0.7, "1", "restitution of impacts", gt=0.0, le=1.0)
    friction: float = quantity(0.5, "1", "friction between grains", ge=0.0, le=1e3)
    press_friction: float = quantity(0.1, "1", "the same while they are pressed; less makes denser samples", ge=0.0, le=1e3)
    pressure: float = quantity(100e3, "Pa", "stress on the sample, alike along all axes", gt=0.0, le=1e12)
    shear_frequency: float = quantity(20e3, "1/s", "frequency of the pulse of shear, one sine", gt=0.0, le=1e12)
    compression_frequency: float = quantity(27e3, "1/s", "frequency of the pulse of compression", gt=0.0, le=1e12)
    sweep: int = Field(1, ge=1, le=100, description="number of frequencies of each, with pulses of their own")
    sweep_ratio: float = quantity(1.25, "1", "each frequency over the one before", ge=1.0, le=10.0)
    pulse_stress: float = quantity(500.0, "Pa", "largest stress of the pulse on the layer that is shaken", gt=0.0)
    patch: float = quantity(0.0, "m", "diameter of the patch that is shaken, one grain at least; 0: all of the section", ge=0.0)
    spacing: float = quantity(2e-3, "m", "distance of receivers along the sample, each a layer as thick", gt=0.0, le=1e3)
    dt: float = quantity(1.5e-7, "s", "time step", ge=1e-12, le=1.0)
    press: float = quantity(2.4e-3, "s", "time in which the sample is pressed", gt=0.0, le=1e4)
    hold: float = quantity(0.45e-3, "s", "time under the pressure with the friction of later", gt=0.0, le=1e4)
    settle: float = quantity(1.5e-3, "s", "time after that in a box that stands still, until nothing moves", gt=0.0, le=1e4)
    listen: float = quantity(0.27e-3, "s", "time in which a pulse is listened to", gt=0.0, le=1e4)
    rest: float = quantity(0.6e-3, "s", "time to come to rest in after each pulse", gt=0.0, le=1e4)
    signal_every: float = quantity(0.6e-6, "s", "time between points of a signal", gt=0.0, le=1e4)
    table_every: float = quantity(30e-6, "s", "time between rows of the table", gt=0.0, le=1e4)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and places")

    @model_validator(mode="after")
    def _fits_together(self):
        if self.pulse_stress > 0.1 * self.pressure:
            raise ValueError(
                f"pulse_stress = {self.pulse_stress:g} Pa must be at most a tenth of the pressure, {self.pressure:g} Pa"
            )
        periods = [1.0 / shot.frequency for shot in self.shots]
        if self.signal_every > 0.1 * min(periods):
            raise ValueError(f"signal_every = {self.signal_every:g} s must be at most a tenth of a period, {min(periods):g} s")
        if self.listen < 2.0 * max(periods):
            raise ValueError(f"listen = {self.listen:g} s must be at least twice the longest period, {max(periods):g} s")
        if self.spacing > 0.1 * self.along * self.diameter:
            raise ValueError(
                f"spacing = {self.spacing:g} m must be at most a tenth of the sample's length, {self.along * self.diameter:g} m"
            )
        if self.patch > self.across * self.diameter:
            raise ValueError(
                f"patch = {self.patch:g} m must be no wider than the sample, {self.across * self.diameter:g} m (across = "
                f"{self.across} mean diameters); 0 shakes all of the section"
            )
        stable = stable_step(self, stiffest_contact(self))
        if self.dt > stable:
            raise ValueError(
                f"dt = {self.dt:g} s is above the stable time step, {stable:.3g} s (0.17 sqrt(m/k), the lightest grain and the "
                f"stiffest contact under {self.pressure:g} Pa); use a smaller dt, larger or softer grains or less pressure"
            )
        return self

    @property
    def grain_mass(self):
        """Mean mass of a grain [kg]."""
        if self.packing == "fcc":
            return self.density * pi / 6.0 * self.diameter**3
        return self.density * mean_volume(self.radius_min, self.radius_max)

    @property
    def prepared(self):
        """Steps at which pressing ends, and holding; none of a crystal, which stands under its pressure from the beginning."""
        if self.packing == "fcc":
            return 0, 0
        return tuple(np.cumsum([self.steps(self.press), self.steps(self.hold)]).tolist())

    @property
    def shots(self):
        """The pulses in their order: of each frequency one of compression, one of shear."""
        listen, rest = (self.steps(time) for time in (self.listen, self.rest))
        begin, found = self.prepared[1] + self.steps(self.settle), []
        for number in range(self.sweep):
            for kind, axis, frequency in (("P", 2, self.compression_frequency), ("S", 0, self.shear_frequency)):
                frequency *= self.sweep_ratio**number
                found.append(Shot(kind, axis, frequency, begin, begin + listen, begin + listen + rest))
                begin = found[-1].rested
        return found

    def steps(self, seconds):
        """Number of time steps in a simulated time [s], one at least."""
        return max(round(seconds / self.dt), 1)

    def pulse(self, frequency, seconds):
        """Stress of the pulse so long after its beginning: one period of a sine [Pa]."""
        seconds = np.asarray(seconds)
        inside = (seconds > 0.0) & (seconds < 1.0 / frequency)
        return np.where(inside, self.pulse_stress * np.sin(2.0 * pi * frequency * seconds), 0.0)
