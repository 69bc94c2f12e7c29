"""The sample, how it is pressed, and how it is shaken."""

from functools import partial
from math import ceil, pi, sqrt

import numpy as np

from barchan import laws
from barchan.actions import Change
from barchan.chance import uniform
from barchan.deformation import Deformation, StressServo
from barchan.domain import Box
from barchan.errors import SceneError
from barchan.experiments.bender.elastic import crystal_contact
from barchan.experiments.experiment import Stage
from barchan.forces import Damping
from barchan.materials import Material
from barchan.measure import coordination
from barchan.measure.sums import exact_sums
from barchan.packing import scatter
from barchan.packing.lattice import lattice, mean_volume
from barchan.parallel import world
from barchan.preflight import check_memory
from barchan.simulation import Simulation
from barchan.triggers import At

#: Solid fraction in which grains are thrown, and about that of the pressed sample.
LOOSE, PRESSED = 0.53, 0.6

#: How quickly the box may close in, and motion in it decays while the sample is pressed, and at rest, times
#: sqrt(pressure / density) / diameter.
CLOSING, PRESS_DAMPED, REST_DAMPED = 0.03, 2.0, 5.0

#: Thickness of the layer that is shaken, in mean diameters.
LAYER = 1.0

#: What the field ``receiver`` says of grains that none listens to.
NO_RECEIVER = -1


def build(scene, threads=None, comm=None, with_grains=True):
    """The simulation at its start: loose grains, or a crystal under its pressure; and all that will be done to them.

    Args:
        scene: a ``Bender``.
        with_grains: False leaves the grains to a checkpoint.

    Raises:
        SceneError: there would be more grains than this machine can hold.
    """
    elastic = {name: getattr(scene, name) for name in ("density", "youngs_modulus", "poisson_ratio", "restitution")}
    random = scene.packing == "random"
    glass = Material("glass", friction=scene.press_friction if random else scene.friction, **elastic)
    box, place, radius = _loose(scene, comm) if random else _crystal(scene, comm)
    sim = Simulation(box, laws.hertz_mindlin, glass, scene.dt, threads=threads, comm=comm)
    sim.check_dt = False  # which is for overlaps of 5 %; the scene checks that of its pressure, results that of what there was
    sim.add_field("push", dimension="length^2/mass")
    sim.add_field("receiver", dtype=np.int32, default=NO_RECEIVER)
    rate = sqrt(scene.pressure / scene.density) / scene.diameter
    damped = Damping(viscous=REST_DAMPED * rate)
    sim.damping = damped
    if random:
        servo = StressServo(scene.pressure, max_rate=CLOSING * rate)
        sim.damping, sim.deformation = Damping(viscous=PRESS_DAMPED * rate), Deformation(servo, servo, servo)
        pressed, held = scene.prepared
        sim.actions.append(Change("hold", At(pressed + 1), partial(_hold, scene, CLOSING * rate)))
        sim.actions.append(Change("stand still", At(held + 1), partial(_stand, damped)))
    for number, shot in enumerate(scene.shots):
        sim.actions.append(Change(f"pulse {number}", At(shot.begin + 1), partial(_damp, Damping())))
        sim.actions.append(Change(f"rest {number}", At(shot.end + 1), partial(_damp, damped)))
        sim.actions.append(Pulse(scene, shot))
    if with_grains:
        sim.add_grains(place(), radius)
    return sim


def stages(scene):
    """Press, hold, settle; then shake, listen and come to rest for each pulse."""
    pressed, held = scene.prepared
    shots = scene.shots
    found = [Stage("press", pressed, _nothing), Stage("hold", held, _nothing), Stage("settle", shots[0].begin, _nothing)]
    for shot in shots:
        begin = partial(_listen, scene=scene) if shot is shots[0] else _nothing
        found += [Stage(f"listen {shot.name}", shot.end, begin), Stage(f"rest {shot.name}", shot.rested, _nothing)]
    return found


class Pulse:
    """An action: a force on the grains of the layer, in proportion to their mass, as long as the pulse lasts.

    Args:
        scene: a ``Bender``.
        shot: a ``Shot`` of it.
    """

    def __init__(self, scene, shot):
        self.scene, self.shot = scene, shot
        last = shot.begin + min(ceil(1.0 / (shot.frequency * scene.dt)), shot.end - shot.begin)
        self.due = At(*range(shot.begin + 1, last + 1))

    def apply(self, sim):
        """Kick them, as a force of the step before would."""
        stress = float(self.scene.pulse(self.shot.frequency, (sim.step_number - 1 - self.shot.begin) * sim.dt))
        sim.grains.view("velocity")[:, self.shot.axis] += sim.dt * stress * sim.grains.view("push")


def mark(sim, scene):
    """Let grains know how the pulse pushes them (``push``, acceleration over stress, which is area over the mass that is shaken),
    and which receiver listens to them (``receiver``). All ranks must call this."""
    grains, width = sim.grains, sim.box.length
    place = grains.view("position") - 0.5 * (sim.box.low + sim.box.high)
    height, aside = np.abs(place[:, 2]), np.hypot(place[:, 0], place[:, 1])
    layer = height < 0.5 * LAYER * scene.diameter
    area, near = float(width[0] * width[1]), np.ones(grains.n, dtype=bool)
    if scene.patch > 0.0:
        nearest = -float(sim.comm.maximum([-np.min(aside[layer], initial=np.inf)])[0])
        area, layer = 0.25 * pi * scene.patch**2, layer & (aside <= max(0.5 * scene.patch, nearest))
        near = aside <= max(0.5 * scene.patch, scene.diameter)
    mass = float(exact_sums((grains.view("mass")[layer],), sim.comm)[0, 0])
    grains.view("push")[...] = np.where(layer, area / mass, 0.0)
    receiver = np.floor(height / scene.spacing).astype(np.int32)
    heard = near & (receiver < receivers(scene, width[2]))
    grains.view("receiver")[...] = np.where(heard, receiver, NO_RECEIVER)


def receivers(scene, length):
    """Number of receivers in a sample of a length [m]: whole layers between its middle and its end."""
    return int(0.5 * length / scene.spacing)


def _listen(sim, scene):
    """Refuse a sample through which no wave can run; let grains know their parts in the pulses.

    Raises:
        SceneError: no grains touch.
    """
    if not coordination(sim).plain:
        raise SceneError(
            f"the sample has no contacts at step {sim.step_number}, when the first pulse begins, so no wave can run "
            f"through it: press longer (press = {scene.press:g} s), or with more pressure ({scene.pressure:g} Pa)"
        )
    mark(sim, scene)


def _nothing(sim):
    """The change that begins this stage is an action, made again on a resume."""


def _hold(scene, rate, sim):
    """The friction of later, under which contacts stop sliding; and each axis has a servo of its own."""
    sim.materials.set_pair("glass", "glass", friction=scene.friction)
    sim.deformation = Deformation(*(StressServo(scene.pressure, max_rate=rate) for _ in range(3)))


def _stand(damping, sim):
    sim.deformation, sim.damping = Deformation(), damping


def _damp(damping, sim):
    sim.damping = damping


def _loose(scene, comm):
    """Box, function that returns places, and radii of as many grains as will fill the sample."""
    across, along = scene.across * scene.diameter, scene.along * scene.diameter
    count = round(PRESSED * across**2 * along / mean_volume(scene.radius_min, scene.radius_max))
    check_memory(count, comm or world())
    radius = scene.radius_min + (scene.radius_max - scene.radius_min) * uniform(scene.seed, np.arange(count))
    edges = np.array((across, across, along)) * (PRESSED / LOOSE) ** (1.0 / 3.0)
    box = Box(-0.5 * edges, 0.5 * edges, (True,) * 3)
    return box, lambda: scatter(box, radius, scene.seed).position, radius


def _crystal(scene, comm):
    """The same of a face-centred cubic crystal under the pressure, along its cubic axes: whole cells, two across at least."""
    edge = sqrt(2.0) * (scene.diameter - crystal_contact(scene).overlap)
    cells = np.maximum(np.round(np.array((scene.across, scene.across, scene.along)) * scene.diameter / edge), 2).astype(int)
    check_memory(4 * int(cells.prod()), comm or world())
    box = Box(-0.5 * edge * cells, 0.5 * edge * cells, (True,) * 3)
    return box, lambda: lattice("fcc", edge, box.low, cells), 0.5 * scene.diameter
