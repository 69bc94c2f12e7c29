"""What the tests of a bonded rock are made of: every parameter with its unit and its bounds."""

from math import cos, pi, radians
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from barchan.scene import Scene, quantity

#: The tests, in the order in which specimens stand side by side.
TESTS = ("compression", "tension", "brazilian")

#: Half the angle over which the disc is flat where the platens press [deg], the least with which it splits before it is crushed
#: there: Wang et al., Int. J. Rock Mech. Min. Sci. 41, 245 (2004).
FLAT = 10.0

#: Gap between neighbouring specimens, and from them to the faces of the box, in heights: room for what breaks off.
GAP = 0.5

#: The specimen for tension is a dumbbell, so that it breaks between the grips: parts of the height that each grip holds, and
#: that each shoulder takes, up to which it gets narrower; and the width of its waist, relative to that of its ends.
GRIP, SHOULDER, WAIST = 0.1, 0.25, 0.8

#: The part of the height in the middle of a specimen in which strains are measured.
GAUGE = 0.5


class Rock(Scene):
    """Parameters of the tests of a bonded rock. The defaults make a weak sandstone."""

    extendable: ClassVar = ("duration",)

    test: Literal["all", *TESTS] = Field("all", description="which of the three tests; all: each on its specimen, side by side")
    grains: int = Field(3600, ge=100, le=1_000_000, description="of the block from which each specimen is cut")
    height: float = quantity(50e-3, "m", "height of the specimens; they are half as wide and deep", gt=0.0, le=1e3)
    size_ratio: float = quantity(1.66, "1", "largest radius over the smallest; radii are uniform between", ge=1.0, le=5.0)
    solid_fraction: float = quantity(0.58, "1", "volume of the grains over that of the block", ge=0.3, le=0.6)
    density: float = quantity(2650.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)
    modulus: float = quantity(15e9, "Pa", "Young's modulus of bonds, and of grains that touch", gt=0.0, le=1e13)
    stiffness_ratio: float = quantity(3.0, "1", "normal over shear stiffness of bonds and contacts", gt=0.0, le=1e2)
    bond_range: float = quantity(0.6, "1", "grains are bonded whose gap is below this part of the mean radius", gt=0.0, le=1.0)
    tensile_strength: float = quantity(15e6, "Pa", "of a bond, in tension; the mean", gt=0.0, le=1e12)
    shear_strength: float = quantity(45e6, "Pa", "of a bond, in shear; the mean", gt=0.0, le=1e12)
    weibull_modulus: float = quantity(2.0, "1", "of the strengths: the larger, the more alike they are", ge=0.5, le=1e3)
    friction: float = quantity(0.5, "1", "friction coefficient of grains", ge=0.0, le=1e2)
    platen_friction: float = quantity(0.1, "1", "friction coefficient of the platens", ge=0.0, le=1e2)
    damping: float = quantity(0.7, "1", "local damping of the grains", ge=0.0, lt=1.0)
    compression_rate: float = quantity(4.0, "1/s", "rate of strain in compression", gt=0.0, le=1e6)
    tension_rate: float = quantity(0.65, "1/s", "rate of strain in tension", gt=0.0, le=1e6)
    brazilian_rate: float = quantity(3.0, "1/s", "rate at which the platens of the disc close in, by its height", gt=0.0, le=1e6)
    dt: float = quantity(6.5e-8, "s", "time step", ge=1e-15, le=1.0)
    duration: float = quantity(2e-3, "s", "time of loading; rounded to whole frames", gt=0.0, le=1e4)
    table_every: float = quantity(4e-6, "s", "time between rows of the tables", gt=0.0, le=1e4)
    frame_every: float = quantity(5e-4, "s", "time between frames of grains", gt=0.0, le=1e4)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and places")

    @model_validator(mode="after")
    def _fits_together(self):
        if self.frame_every < self.table_every:
            raise ValueError(f"frame_every = {self.frame_every:g} s must be at least table_every = {self.table_every:g} s")
        return self

    @property
    def tests(self):
        """Names of the tests that are made."""
        return TESTS if self.test == "all" else (self.test,)

    @property
    def width(self):
        """Width and depth of the specimens, and thickness of the disc [m]."""
        return 0.5 * self.height

    @property
    def disc(self):
        """Diameter of the disc [m]; flattened it is as high as the specimens."""
        return self.height / cos(radians(FLAT))

    @property
    def radii(self):
        """Smallest and largest radius [m]: so many grains fill so much of the block."""
        ratio = self.size_ratio
        volume = 4.0 / 3.0 * pi * (1.0 + ratio) * (1.0 + ratio**2) / 4.0  # mean, of a grain with smallest radius 1
        smallest = (self.solid_fraction * self.disc * self.width * self.height / (self.grains * volume)) ** (1.0 / 3.0)
        return smallest, ratio * smallest

    @property
    def radius(self):
        """Mean radius [m]."""
        return 0.5 * sum(self.radii)

    def rate(self, test):
        """At which the ends of a specimen approach, or part, over its height [1/s]."""
        return getattr(self, f"{test}_rate")

    @property
    def row_steps(self):
        """Steps between rows of the tables."""
        return max(round(self.table_every / self.dt), 1)

    @property
    def frame_steps(self):
        """Steps between frames: a whole number of rows, so that each table has a row with each."""
        return self.row_steps * max(round(self.frame_every / (self.row_steps * self.dt)), 1)

    @property
    def last_step(self):
        """Step at which it ends, after whole frames."""
        return self.frame_steps * max(round(self.duration / (self.frame_steps * self.dt)), 1)
