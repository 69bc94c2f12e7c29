"""Loose grains in a periodic box, and how it is sheared."""

import numpy as np

from barchan import laws
from barchan.chance import uniform
from barchan.deformation import Deformation, StressServo
from barchan.domain import Box
from barchan.experiments.experiment import Stage
from barchan.materials import Material
from barchan.packing.lattice import mean_volume
from barchan.packing.scatter import scatter
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation

#: Solid fraction at the start, and edges of the box then, relative to that along y.
LOOSE, SHAPE = 0.5, (1.25, 1.0, 1.25)


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: loose grains at random places in a box that is sheared.

    Args:
        scene: a ``Shear``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
    """
    check_memory(scene.grains, comm or world())
    edges = np.array(SHAPE) * (scene.grains * mean_volume(scene.radius_min, scene.radius_max) / LOOSE / np.prod(SHAPE)) ** (1 / 3)
    box = Box((0.0, 0.0, 0.0), edges, (True, True, True))
    stiffness = {"kn": scene.stiffness, "kt": scene.stiffness / scene.stiffness_ratio}
    grain = Material("grain", scene.density, **stiffness, gamma_n=scene.dashpot, gamma_t=0.0, friction=scene.friction)
    sim = Simulation(box, laws.linear, grain, scene.dt, threads=threads, comm=comm)
    rates = scene.shear_rates
    held = StressServo(scene.pressure, max_rate=float(rates[0]))
    sim.deformation = Deformation(z=held, xz=lambda sim: float(rates[scene.stage(sim.step_number)]))
    if with_grains:
        radius = scene.radius_min + (scene.radius_max - scene.radius_min) * uniform(scene.seed, np.arange(scene.grains))
        sim.add_grains(scatter(box, radius, seed=scene.seed).position, radius, "grain")
    return sim


def stages(scene):
    """One for each shear rate, the fastest first."""
    names = (f"I = {number:.3g}" for number in scene.inertial_numbers)
    return [Stage(name, end, lambda sim: None) for name, end in zip(names, scene.ends)]
