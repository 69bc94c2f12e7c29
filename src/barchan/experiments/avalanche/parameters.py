"""What an avalanche is made of: every parameter with its unit, its bounds and the paper's value."""

from math import ceil, floor, sqrt
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from barchan.errors import SceneError
from barchan.packing.lattice import cell_edge, per_cell
from barchan.scene import Scene, quantity

#: Bounds of the coarse graining.
SMALLEST, LARGEST = 0.01, 50.0


class Avalanche(Scene):
    """Parameters of the avalanche. Where Walther & Sbalzarini 2009 state a value, it is the default; see ``PAPER``.

    The simulated grains are ``coarse_graining`` times as large as the radii given, in the same outline, at constant
    k_n d/(m g) and gamma sqrt(d/g): the same flow in fewer grains. 1 is the paper's Figure 3 with 120,000.
    """

    extendable: ClassVar = ("duration",)

    coarse_graining: float = quantity(
        4.0, "1", "size of the simulated grains relative to the radii given", ge=SMALLEST, le=LARGEST
    )
    length: float = quantity(0.740, "m", "length of the block of grains", gt=0.0, le=1e3)
    height: float = quantity(0.192, "m", "height of the block of grains on its lattice", gt=0.0, le=1e3)
    width: float = quantity(8e-3, "m", "period across, for grains of the radii given", gt=0.0, le=1e3)
    floor: float = quantity(1.300, "m", "length of the floor, from the left wall to the end wall", gt=0.0, le=1e4)
    end_wall: float = quantity(0.400, "m", "height of the end wall; what flies over it leaves through an outlet", ge=0.0, le=1e3)
    radius_min: float = quantity(1.00e-3, "m", "smallest radius", gt=0.0, le=1e2)
    radius_max: float = quantity(1.12e-3, "m", "largest radius", gt=0.0, le=1e2)
    void_fraction: float = quantity(0.468, "1", "void fraction of the lattice at the start", gt=0.0, lt=1.0)
    lattice: Literal["bcc", "fcc", "sc"] = Field("bcc", description="lattice at the start")
    density: float = quantity(1700.0, "kg/m^3", "density of the grains; derived, the paper omits it", ge=1e-3, le=1e6)
    kn: float = quantity(7849.0, "N/m", "normal stiffness", gt=0.0, le=1e15)
    kt: float = quantity(2243.0, "N/m", "tangential stiffness", gt=0.0, le=1e15)
    gamma_n: float = quantity(3401.0, "1/s", "normal damping", ge=0.0, le=1e12)
    gamma_t: float = quantity(3401.0, "1/s", "tangential damping", ge=0.0, le=1e12)
    friction: float = quantity(1.0, "1", "friction coefficient", ge=0.0, le=1e3)
    gravity: float = quantity(9.81, "m/s^2", "acceleration of gravity", gt=0.0, le=1e6)
    angle: float = quantity(31.2, "deg", "angle of the floor after the release", gt=0.0, lt=90.0)
    dt: float = quantity(5e-6, "s", "time step, for grains of the radii given", ge=1e-12, le=1.0)
    equilibrate: float = quantity(0.3, "s", "time in the horizontal position", ge=0.0, le=1e4)
    duration: float = quantity(0.7, "s", "time after the release", ge=0.0, le=1e4)
    frame_every: float = quantity(0.02, "s", "time between frames of grains after the release", gt=0.0, le=1e4)
    contacts_every: float = quantity(0.1, "s", "time between frames of contacts after the release", gt=0.0, le=1e4)
    table_every: float = quantity(0.002, "s", "time between rows of the table", gt=0.0, le=1e4)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of the radii")

    @model_validator(mode="after")
    def _fits_together(self):
        if self.radius_max < self.radius_min:
            raise ValueError(f"radius_max = {self.radius_max:g} m is below radius_min = {self.radius_min:g} m")
        if self.floor < self.length:
            raise ValueError(f"floor = {self.floor:g} m is shorter than the block of grains, length = {self.length:g} m")
        return self

    @property
    def simulated(self):
        """The values that the simulation uses, ``coarse_graining`` applied."""
        s = self.coarse_graining
        return Simulated(
            s * self.radius_min,
            s * self.radius_max,
            s * self.width,
            s**2 * self.kn,
            s**2 * self.kt,
            self.gamma_n / sqrt(s),
            self.gamma_t / sqrt(s),
            self.dt * sqrt(s),
        )

    def steps(self, seconds):
        """Number of time steps in a simulated time [s]."""
        return round(seconds / self.simulated.dt)

    @property
    def release_step(self):
        """Step at which the box is tilted and its right wall removed."""
        return self.steps(self.equilibrate)

    @property
    def last_step(self):
        """Step at which the avalanche ends."""
        return self.release_step + self.steps(self.duration)

    def with_grains(self, count):
        """The same outline in about ``count`` grains: smaller or larger ones.

        Raises:
            SceneError: the grains would be too large or too small.
        """
        fine = Outline.of(self.model_copy(update={"coarse_graining": 1.0})).flowing
        fewest, most = ceil(fine / LARGEST**2), floor(fine / SMALLEST**2)
        if not fewest <= count <= most:
            raise SceneError(f"grains = {count:,}: this outline takes {fewest:,} to {most:,} of them")
        return type(self).make(self.model_dump() | {"coarse_graining": sqrt(fine / count)})


class Simulated(NamedTuple):
    """Values of a scene with its coarse graining applied, in SI units."""

    radius_min: float
    radius_max: float
    width: float
    kn: float
    kt: float
    gamma_n: float
    gamma_t: float
    dt: float


class Outline(NamedTuple):
    """Where things stand, in whole cells of the lattice; the block of grains begins at x = z = 0.

    ``edge``: of a cell [m]. ``flowing``: number of grains that will flow.
    """

    edge: float
    across: int
    length: int
    height: int
    floor: int
    end_wall: int
    flowing: int

    @classmethod
    def of(cls, scene):
        """The outline of a scene.

        Raises:
            SceneError: the lattice would overlap.
        """
        grain = scene.simulated
        edge = cell_edge(scene.lattice, scene.void_fraction, grain.radius_min, grain.radius_max)
        across, length, height = (max(1, round(size / edge)) for size in (grain.width, scene.length, scene.height))
        floor, end_wall = max(length + 2, round(scene.floor / edge)), round(scene.end_wall / edge)
        return cls(edge, across, length, height, floor, end_wall, per_cell(scene.lattice) * across * length * height)

    @property
    def side_walls(self):
        """Height of the left and of the right wall, in cells."""
        return self.height + self.height // 4

    @property
    def immobile(self):
        """Number of grains of floor and walls."""
        in_a_layer_of_cells = self.flowing // (self.length * self.height)
        return in_a_layer_of_cells * (self.floor + 2 + 2 * self.side_walls + self.end_wall)


#: Parameters of the paper's Figure 3 that differ from the defaults, which are for a run of minutes.
FIGURE_3 = {"coarse_graining": 1.0, "equilibrate": 0.4, "duration": 1.2}

#: What the paper says, in the units of the parameters; Figure 3 where it differs from the reference system.
PAPER = {
    "radius_min": 1.00e-3,
    "radius_max": 1.12e-3,
    "length": 0.740,
    "width": 8e-3,
    "void_fraction": 0.468,
    "kn": 7849.0,
    "kt": 2243.0,
    "gamma_n": 3401.0,
    "gamma_t": 3401.0,
    "friction": 1.0,
    "angle": 31.2,
    "dt": 1e-6,
    "equilibrate": 0.4,
    "duration": 1.2,
}
