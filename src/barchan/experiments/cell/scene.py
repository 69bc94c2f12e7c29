"""What samples that rain into a cell have in common: their parameters, and the lattice from which grains rain."""

from math import pi, sqrt
from typing import NamedTuple

from pydantic import Field, model_validator

from barchan.packing.lattice import cell_edge, per_cell
from barchan.scene import Scene, quantity

#: Void fraction of the lattice from which grains rain.
RAIN_VOID_FRACTION = 0.7

#: Inertial number with which walls may close in: they meet grains that are at rest.
CLOSING = 1e-2

#: Solid fraction of the densest random packing.
DENSEST = 0.64


class CellScene(Scene):
    """Parameters of a test that loads a sample in a cell. One of your own adds ``ends``, steps at which its stages end (the first
    is the rain, the second the seating), and ``target(step)``, the stress that the controlled walls shall have [Pa].
    """

    grains: int = Field(3000, ge=10, le=10**10, description="about how many grains rain")
    radius_min: float = quantity(0.8e-3, "m", "smallest radius", gt=0.0, le=1.0)
    radius_max: float = quantity(1.2e-3, "m", "largest radius", gt=0.0, le=1.0)
    density: float = quantity(2500.0, "kg/m^3", "density of the grains", ge=1e-3, le=1e6)
    shear_modulus: float = quantity(60e6, "Pa", "shear modulus of the grains; of glass 29 GPa", gt=0.0, le=1e13)
    poisson_ratio: float = quantity(0.2, "1", "Poisson's ratio of the grains", ge=0.0, le=0.5)
    friction: float = quantity(0.3, "1", "friction coefficient of grains", ge=0.0, le=1e2)
    wall_friction: float = quantity(0.0, "1", "friction coefficient of walls", ge=0.0, le=1e2)
    restitution: float = quantity(0.5, "1", "coefficient of restitution", gt=0.0, le=1.0)
    width: float = quantity(28e-3, "m", "edge of the square base", gt=0.0, le=1e3)
    height: float = quantity(24e-3, "m", "above which grains are removed after the rain", gt=0.0, le=1e3)
    gravity: float = quantity(9.81, "m/s^2", "acceleration of gravity while grains rain", gt=0.0, le=1e6)
    rain: float = quantity(0.16, "s", "time in which grains fall and come to rest", ge=0.0, le=1e4)
    seat: float = quantity(0.015, "s", "time at the initial stress", ge=0.0, le=1e4)
    initial_stress: float = quantity(5e3, "Pa", "stress on the controlled walls before it grows", gt=0.0, le=1e12)
    stress_rate: float = quantity(2e6, "Pa/s", "rate at which the stress grows", ge=1e-3, le=1e15)
    dt: float = quantity(1.8e-6, "s", "time step", ge=1e-12, le=1.0)
    table_every: float = quantity(1e-4, "s", "time between rows of the table while the sample is loaded", gt=0.0, le=1e4)
    frame_every: float = quantity(1e-2, "s", "time between frames of grains", gt=0.0, le=1e4)
    seed: int = Field(1, ge=0, lt=2**63, description="seed of radii and of the first velocities")

    @model_validator(mode="after")
    def _is_large_enough(self):
        if self.radius_max < self.radius_min:
            raise ValueError(f"radius_max = {self.radius_max:g} m is below radius_min = {self.radius_min:g} m")
        if min(self.width, self.height) < 6.0 * self.radius_max:
            raise ValueError(f"width and height must be at least three of the largest diameters, {6.0 * self.radius_max:g} m")
        mean = (self.radius_min + self.radius_max) * (self.radius_min**2 + self.radius_max**2) / 4.0  # of radius^3
        highest = self.grains * 4.0 / 3.0 * pi * mean / (DENSEST * self.width**2)
        if highest < self.height:
            raise ValueError(
                f"grains = {self.grains:,} reach a height of at most {highest:.2g} m on a base of width = {self.width:g} m, and "
                f"height = {self.height:g} m is where they are cut; give more grains, or a smaller width or height"
            )
        return self

    def steps(self, seconds):
        """Number of time steps in a simulated time [s]."""
        return round(seconds / self.dt)

    @property
    def closing_speed(self):
        """Largest speed of a wall: ``CLOSING`` as an inertial number of the initial stress [m/s]."""
        diameter = self.radius_min + self.radius_max
        return CLOSING * min(self.width, self.height) / diameter * sqrt(self.initial_stress / self.density)


class Lattice(NamedTuple):
    """Whole cells of the lattice from which grains rain, clear of the walls.

    ``edge``: of a cell [m]. ``across``, ``up``: numbers of cells. ``grains``: on it. ``low``: its corner, (3,) [m]. ``top``:
    nothing reaches above it [m].
    """

    edge: float
    across: int
    up: int
    grains: int
    low: tuple
    top: float

    @classmethod
    def of(cls, scene):
        """The lattice of a scene, as wide as the cell allows.

        Raises:
            SceneError: the lattice would overlap.
        """
        edge = cell_edge("bcc", RAIN_VOID_FRACTION, scene.radius_min, scene.radius_max)
        room = scene.radius_max - 0.25 * edge  # points lie a quarter of an edge, or more, inside the lattice
        across = max(1, int((scene.width - 2.0 * room) / edge))
        in_a_layer = per_cell("bcc") * across**2
        up = max(1, round(scene.grains / in_a_layer))
        side, bottom = 0.5 * (scene.width - across * edge), max(room, 0.0)
        return cls(edge, across, up, in_a_layer * up, (side, side, bottom), 2.0 * bottom + up * edge)
