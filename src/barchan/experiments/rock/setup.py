"""The specimens at their start, what loads them, and the loading."""

import numpy as np

from barchan import laws
from barchan.actions import mark_places
from barchan.bonds import Weibull
from barchan.domain import Box
from barchan.experiments.experiment import Stage
from barchan.experiments.rock.block import specimens_of
from barchan.experiments.rock.parameters import GAP, GRIP, TESTS
from barchan.forces import Damping
from barchan.laws.bond import Bond
from barchan.materials import Material
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.walls import Cone

#: Up to so many grains of the block one thread is the default: where cores have other work, threads that wait for each other in
#: every step take several times as long as one (measured with 3600).
ALONE = 10_000


def build(scene, threads=None, comm=None, with_grains=True):
    """The specimens side by side, not bonded yet, between their platens.

    Args:
        scene: a ``Rock``.
        threads: of this process; by default one, of more than ``ALONE`` grains all cores.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
        RunError: the grains found no room in the block.
    """
    check_memory(2 * scene.grains, comm or world())
    threads = threads or (1 if scene.grains <= ALONE else None)
    room, last = GAP * scene.height, axis_of(scene, scene.tests[-1])
    low = (-scene.height - room, -0.5 * scene.width - room, -room)
    high = (last + scene.height + room, 0.5 * scene.width + room, scene.height + room)
    sim = Simulation(Box(low, high), laws.linear, _materials(scene), scene.dt, (0, 0, 0), threads, comm, bonds=_bond(scene))
    sim.materials.set_pair("grain", "platen", friction=scene.platen_friction)
    sim.damping = Damping(local=scene.damping)
    sim.add_field("specimen", dtype=np.uint8)
    specimens = specimens_of(scene) if with_grains else {}
    for test in scene.tests:
        if test != "tension":
            for end in specimens[test].ends if with_grains else (0.0, scene.height):
                sim.add_wall(Cone((axis_of(scene, test), 0.0, end), (0, 0, 1), 0.0, scene.height, 0.0, "platen"))
    for test, one in specimens.items():
        place = one.position + np.array([axis_of(scene, test), 0.0, 0.0])
        sim.add_grains(place, one.radius, "grain", specimen=TESTS.index(test))
    return sim


def axis_of(scene, test):
    """Where the axis of a specimen is along x [m]: platens, as wide as twice the height, do not reach the next one."""
    return scene.tests.index(test) * (2.0 + GAP) * scene.height


def platens(sim, scene, test):
    """The lower and the upper platen of a test."""
    pressed = [one for one in scene.tests if one != "tension"]
    first = 2 * pressed.index(test)
    return sim.walls[first : first + 2]


def stages(scene):
    """There is one: grains are bonded, and the platens and grips begin to move."""
    return [Stage("load", scene.last_step, lambda sim: _begin(sim, scene))]


def _begin(sim, scene):
    """Bond the grains, grip those that shall be pulled, and let all move as in a specimen that is strained evenly already: ends
    that start alone send waves."""
    strength = Weibull(scene.weibull_modulus, scene.seed)
    sim.install_bonds(overlap=-scene.bond_range * scene.radius, strength=strength)
    mark_places(sim)
    specimen, height = sim.grains.view("specimen"), sim.grains.view("position")[:, 2] - 0.5 * scene.height
    gripped = (specimen == TESTS.index("tension")) & (np.abs(height) > (0.5 - GRIP) * scene.height)
    sim.freeze(sim.grains.view("id")[gripped])
    height = np.where(gripped, np.copysign(0.5 * scene.height, height), height)
    rate = np.array([scene.rate(test) * (1.0 if test == "tension" else -1.0) for test in TESTS])[specimen]
    sim.grains.velocity = np.outer(rate * height, (0.0, 0.0, 1.0))
    for test in scene.tests:
        if test != "tension":
            for platen, way in zip(platens(sim, scene, test), (1.0, -1.0)):
                platen.velocity = (0.0, 0.0, way * 0.5 * scene.rate(test) * scene.height)


def _materials(scene):
    """Grains that touch are as stiff as the bond between two of mean size."""
    stiffness = 0.5 * np.pi * scene.modulus * scene.radius
    elastic = {"kn": stiffness, "kt": stiffness / scene.stiffness_ratio, "friction": scene.friction}
    return [Material("grain", density=scene.density, **elastic), Material("platen", **elastic)]


def _bond(scene):
    """The glue: a rod of its modulus, as long as a mean grain."""
    stiffness = 0.5 * scene.modulus / scene.radius
    strengths = {"tensile_strength": scene.tensile_strength, "shear_strength": scene.shear_strength}
    return Bond(laws.parallel_bond, "cement", kn=stiffness, ks=stiffness / scene.stiffness_ratio, **strengths)
