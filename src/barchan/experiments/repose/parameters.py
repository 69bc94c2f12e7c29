"""What a test of the angle of repose is made of: every parameter with its unit and its bounds."""

from math import pi
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from barchan.experiments.loose import LOOSEST
from barchan.experiments.scenes import LooseSand
from barchan.packing.lattice import mean_volume
from barchan.scene import quantity


class Repose(LooseSand):
    """Parameters of a test of the angle of repose."""

    method: Literal["cylinder", "plate"] = Field(
        "cylinder", description="what is lifted: a hollow cylinder around the grains, or a plate at the side of a block of them"
    )
    grains: int = Field(3000, ge=20, le=2_000_000, description="number of grains")
    youngs_modulus: float = quantity(1.5e7, "Pa", "Young's modulus of grains and walls; softer than glass", gt=0.0, le=1e15)
    restitution: float = quantity(0.5, "1", "restitution of normal impacts", gt=0.0, le=1.0)
    friction: float = quantity(0.5, "1", "friction between grains", ge=0.0, le=1e3)
    wall_friction: float = quantity(0.3, "1", "friction at the cylinder, or at plate and back wall", ge=0.0, le=1e3)
    floor_friction: float = quantity(0.5, "1", "friction at the floor, where it is smooth", ge=0.0, le=1e3)
    rough_floor: bool = Field(True, description="whether a layer of grains is glued to the floor")
    cylinder_radius: float = quantity(0.04, "m", "inner radius of the cylinder", gt=0.0, le=1e3)
    length: float = quantity(0.04, "m", "method plate: from the back wall to the plate", gt=0.0, le=1e3)
    width: float = quantity(0.12, "m", "method plate: between the smooth side walls", gt=0.0, le=1e3)
    floor: float = quantity(
        0.15, "m", "from the axis or the back wall to the edge of the floor; who rolls over it is counted", gt=0.0, le=1e4
    )
    lift_speed: float = quantity(0.05, "m/s", "speed of the cylinder or plate", ge=1e-9, le=1e3)
    dt: float = quantity(1.9e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.4, "s", "time before the lift", ge=0.0, le=1e4)
    duration: float = quantity(0.3, "s", "time after the lift", ge=0.0, le=1e4)
    frame_every: float = quantity(0.1, "s", "time between frames and profiles; lift and duration are rounded up to it", gt=0.0)
    table_every: float = quantity(0.02, "s", "time between rows of the table", gt=0.0)

    @model_validator(mode="after")
    def _fits_together(self):
        names = ("cylinder_radius",) if self.method == "cylinder" else ("length", "width")
        for name in names:
            if getattr(self, name) < 4.0 * self.radius_max:
                raise ValueError(
                    f"{name} = {getattr(self, name):g} m has no room for grains; it needs two diameters of the largest"
                )
        if self.floor < getattr(self, names[0]) + 4.0 * self.radius_max:
            raise ValueError(f"floor = {self.floor:g} m must exceed {names[0]} by two diameters of the largest grains")
        return self

    @property
    def lift_step(self):
        """Step at which the lift begins."""
        return self.steps(self.equilibrate)

    @property
    def lifted_step(self):
        """Step at which it ends, cylinder or plate above the column as it stood; whole frames later."""
        way = Outline.of(self).column + 2.0 * self.diameter
        return self.lift_step + self.whole_frames(way / self.lift_speed)

    @property
    def last_step(self):
        """Step at which the test ends, whole frames later."""
        return self.lifted_step + self.whole_frames(self.duration)


class Outline(NamedTuple):
    """Where grains stand at the start: on a lattice over their base.

    ``low``, ``high``: corners of the brick around the base, x and y [m]. ``column``: height that they do not exceed when they
    have come to rest [m].
    """

    low: tuple
    high: tuple
    column: float

    @classmethod
    def of(cls, scene):
        """The outline of a scene."""
        if scene.method == "cylinder":
            radius = scene.cylinder_radius
            low, high, area = (-radius, -radius), (radius, radius), pi * radius**2
        else:
            low, high = (0.0, -0.5 * scene.width), (scene.length, 0.5 * scene.width)
            area = scene.length * scene.width
        volume = scene.grains * mean_volume(scene.radius_min, scene.radius_max)
        return cls(low, high, volume / (LOOSEST * area))
