"""A sand avalanche down an inclined plane: the main experiment of Walther & Sbalzarini 2009.

Grains on a lattice in a box with a floor and walls of two layers of immobile grains, periodic across; they come to rest in
the horizontal position; the box is tilted and its right wall removed; they flow down the floor until a wall at its lower end.
"""

from math import cos, radians, sin

import numpy as np
from pydantic import Field, model_validator

from barchan import laws
from barchan.domain import Box
from barchan.materials import Material
from barchan.packing.lattice import cell_edge, lattice
from barchan.scene import Scene
from barchan.simulation import Simulation


class Avalanche(Scene):
    """Parameters, in SI units. The defaults are the paper's but for the size and dt (the paper's dt is 1e-6 s)."""

    grains: int = Field(5000, ge=20, le=10**9, description="number of grains that flow, about")
    aspect: float = Field(
        3.7, gt=0.1, lt=100.0, description="length / height of the block of grains [1]; Figure 3: 740 mm / 200 mm"
    )
    width: float = Field(8e-3, gt=0.0, description="period across [m]")
    runway: float = Field(1.5, gt=0.0, description="floor from the right wall to the lower end wall / length of the block [1]")
    radius_min: float = Field(1.00e-3, gt=0.0, description="smallest radius [m]")
    radius_max: float = Field(1.12e-3, gt=0.0, description="largest radius [m]")
    void_fraction: float = Field(0.47, gt=0.0, lt=1.0, description="of the lattice at the start [1]")
    lattice: str = Field("bcc", description="bcc, fcc or sc")
    density: float = Field(1700.0, gt=0.0, description="[kg/m^3]; derived, the paper omits it")
    kn: float = Field(7849.0, gt=0.0, description="normal stiffness [N/m]")
    kt: float = Field(2243.0, gt=0.0, description="tangential stiffness [N/m]")
    gamma_n: float = Field(3401.0, ge=0.0, description="normal damping [1/s]")
    gamma_t: float = Field(3401.0, ge=0.0, description="tangential damping [1/s]")
    friction: float = Field(1.0, ge=0.0, description="[1]")
    gravity: float = Field(9.81, gt=0.0, description="[m/s^2]")
    angle: float = Field(31.2, gt=0.0, lt=90.0, description="of the floor after the release [degrees]")
    dt: float = Field(5e-6, gt=0.0, description="time step [s]")
    equilibrate: float = Field(0.05, ge=0.0, description="time in the horizontal position [s]")
    duration: float = Field(0.2, ge=0.0, description="time after the release [s]")
    seed: int = Field(1, ge=0, lt=2**64, description="of the radii")

    @model_validator(mode="after")
    def _radii_are_ordered(self):
        if self.radius_max < self.radius_min:
            raise ValueError(f"radius_max = {self.radius_max:g} m is below radius_min = {self.radius_min:g} m")
        return self

    @property
    def equilibrate_steps(self):
        """Steps in the horizontal position."""
        return round(self.equilibrate / self.dt)

    @property
    def flow_steps(self):
        """Steps after the release."""
        return round(self.duration / self.dt)


#: What a grain is, in its field ``part``.
FLOWING, FIXED, RIGHT_WALL = 0, 1, 2


class Outline:
    """Where things stand, in whole cells of the lattice; the block of grains begins at x = z = 0."""

    def __init__(self, scene):
        self.edge = cell_edge(scene.lattice, scene.void_fraction, scene.radius_min, scene.radius_max)
        per_cell = {"bcc": 2, "fcc": 4, "sc": 1}[scene.lattice]
        self.across = max(round(scene.width / self.edge), 1)
        face = scene.grains / (per_cell * self.across)
        self.height = max(1, round((face / scene.aspect) ** 0.5))
        self.length = max(1, round(face / self.height))
        self.runway = max(2, round(scene.runway * self.length))

    def box(self):
        """The box: open room above the grains for spray, a cell of room around the walls."""
        low = (-2.0 * self.edge, 0.0, -2.0 * self.edge)
        right = self.length + self.runway + 2
        return Box(
            low,
            (right * self.edge, self.across * self.edge, (3.0 * self.height + 20.0) * self.edge),
            periodic=(False, True, False),
        )


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start, in the horizontal position.

    Args:
        scene: an ``Avalanche``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: the lattice would overlap, or the box is too narrow.
    """
    outline = Outline(scene)
    sand = Material(
        "sand",
        density=scene.density,
        kn=scene.kn,
        kt=scene.kt,
        gamma_n=scene.gamma_n,
        gamma_t=scene.gamma_t,
        friction=scene.friction,
    )
    sim = Simulation(outline.box(), laws.silbert, sand, scene.dt, gravity=(0.0, 0.0, -scene.gravity), threads=threads, comm=comm)
    sim.add_field("part", dtype=np.uint8)
    if with_grains:
        for part, low, cells in _blocks(outline):
            points = lattice(scene.lattice, outline.edge, np.array(low) * outline.edge, cells)
            numbers = sim.next_id + np.arange(len(points))
            sim.add_grains(points, _radii(scene, numbers), "sand", frozen=part != FLOWING, part=part)
    return sim


def _blocks(outline):
    """(part, corner, size) of the block of grains and of the walls around it, in cells."""
    across, tall = outline.across, 2 * outline.height
    yield FLOWING, (0, 0, 0), (outline.length, across, outline.height)
    yield FIXED, (-1, 0, -1), (outline.length + outline.runway + 2, across, 1)
    yield FIXED, (-1, 0, 0), (1, across, tall)
    yield RIGHT_WALL, (outline.length, 0, 0), (1, across, outline.height)
    yield FIXED, (outline.length + outline.runway, 0, 0), (1, across, tall)


def _radii(scene, numbers):
    """Uniform radii from a counter-based generator keyed by the grain's number: the same for any order or rank."""
    words = np.random.Philox(key=scene.seed, counter=0)
    uniform = np.random.Generator(words).random(int(numbers[-1]) + 1)[numbers]
    return scene.radius_min + (scene.radius_max - scene.radius_min) * uniform


def release(sim, scene):
    """Tilt the box and remove its right wall."""
    tilt = radians(scene.angle)
    sim.gravity = (scene.gravity * sin(tilt), 0.0, -scene.gravity * cos(tilt))
    sim.remove(sim.grains.view("id")[sim.grains.view("part") == RIGHT_WALL])
    sim.notes["phase"] = "flow"


def run(sim, scene, phase_writers=lambda phase, steps: ()):
    """Run what is left of the experiment: equilibrate, release, flow.

    Args:
        sim: made by ``build``, or restored from a checkpoint.
        phase_writers: function (phase, steps left in it) -> writers that watch that phase.
    """
    if sim.notes.get("phase") != "flow":
        _advance(sim, "equilibrate", scene.equilibrate_steps - sim.step_number, phase_writers)
        release(sim, scene)
    _advance(sim, "flow", scene.equilibrate_steps + scene.flow_steps - sim.step_number, phase_writers)


def _advance(sim, phase, steps, phase_writers):
    if steps <= 0:
        return
    lasting = list(sim.writers)
    own = list(phase_writers(phase, steps))
    sim.writers = lasting + own
    try:
        sim.run(steps)
    finally:
        sim.writers = lasting
        for writer in own:
            writer.close()
