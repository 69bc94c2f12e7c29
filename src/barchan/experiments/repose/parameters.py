"""What a test of the angle of repose is made of: every parameter with its unit and its bounds."""

from math import ceil, pi
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from barchan.experiments.loose import LOOSEST
from barchan.packing.lattice import mean_volume
from barchan.scene import Scene, quantity


class Repose(Scene):
    """Parameters of a test of the angle of repose."""

    extendable: ClassVar = ("duration",)

    method: Literal["cylinder", "plate"] = Field(
        "cylinder", description="what is lifted: a hollow cylinder around the grains, or a plate at the side of a block of them"
    )
    grains: int = Field(3000, ge=20, le=2_000_000, description="number of grains")
    radius_min: float = quantity(2.2e-3, "m", "smallest radius", gt=0.0, le=1e2)
    radius_max: float = quantity(2.8e-3, "m", "largest radius; they are uniform between", gt=0.0, le=1e2)
    density: float = quantity(2500.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)
    youngs_modulus: float = quantity(1.5e7, "Pa", "Young's modulus of grains and walls; softer than glass", gt=0.0, le=1e15)
    poisson_ratio: float = quantity(0.3, "1", "Poisson's ratio of grains and walls", ge=0.0, le=0.5)
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
    gravity: float = quantity(9.81, "m/s^2", "acceleration of gravity", gt=0.0, le=1e6)
    dt: float = quantity(1.9e-5, "s", "time step", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.4, "s", "time before the lift", ge=0.0, le=1e4)
    duration: float = quantity(0.3, "s", "time after the lift", ge=0.0, le=1e4)
    frame_every: float = quantity(0.1, "s", "time between frames and profiles; lift and duration are rounded up to it", gt=0.0)
    table_every: float = quantity(0.02, "s", "time between rows of the table", gt=0.0)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and places")

    @model_validator(mode="after")
    def _fits_together(self):
        if self.radius_max < self.radius_min:
            raise ValueError(f"radius_max = {self.radius_max:g} m is below radius_min = {self.radius_min:g} m")
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
    def diameter(self):
        """Mean diameter [m]."""
        return self.radius_min + self.radius_max

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

    @property
    def lift_step(self):
        """Step at which the lift begins."""
        return self.steps(self.equilibrate)

    @property
    def lifted_step(self):
        """Step at which it ends, cylinder or plate above the column as it stood; whole frames later."""
        way = Outline.of(self).column + 2.0 * self.diameter
        return self.lift_step + self.frame_steps * ceil(self.steps(way / self.lift_speed) / self.frame_steps)

    @property
    def last_step(self):
        """Step at which the test ends, whole frames later."""
        return self.lifted_step + self.frame_steps * ceil(self.steps(self.duration) / self.frame_steps)


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
