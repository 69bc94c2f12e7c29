"""A periodic box that is stretched or sheared as the grains move: at a given rate, or so that they carry a given stress."""

from math import copysign, isfinite
from typing import NamedTuple

import numpy as np

from barchan.domain import SHEARS
from barchan.errors import SceneError
from barchan.kernels.integrate import stretch
from barchan.measure.stress import stress
from barchan.measure.sums import exact_sums
from barchan.measure.touching import dot, touching_pairs
from barchan.words import shown

#: The axes that each entry of a ``Deformation`` is about: the component of the stress and of the velocity gradient.
AXES = ((0, 0), (1, 1), (2, 2), *SHEARS)


#: Most shear in a step: no grain may be carried further than it is folded back.
MOST_SHEAR = 0.01


class Deformation(NamedTuple):
    """How the box is stretched along each axis, and sheared; ``Simulation.deformation``. None: not at all.

    A number, or a function of the simulation that returns one, is a rate [1/time]: for x, y and z that at which the logarithm of
    the edge grows, so below 0 the box shrinks; xy is the rate of a simple shear, a flow along x that grows along y, and so are xz
    and yz. One of these three at most. A ``StressServo`` finds the rate; if it stands for several edges, it is the mean of their
    stresses that it holds, and one rate for all of them.

    The box keeps its centre and its right angles: as it is sheared, what lies beyond the faces along the gradient moves aside
    (Lees & Edwards, J. Phys. C 5, 1921, 1972). While the box is deformed, the velocity of a grain is that relative to the box: a
    grain that moves with it is at rest. So grains on both sides of a periodic face, and their contacts, see each other move as
    in the middle of the box, and a deformed box does work: minus the volume times stress times rate. Walls are stretched with it
    along their plane.
    """

    x: object = None
    y: object = None
    z: object = None
    xy: object = None
    xz: object = None
    yz: object = None

    @property
    def acts(self):
        """False if there is none."""
        return any(one is not None for one in self)

    @property
    def sheared(self):
        """Number of the shear among xy, xz, yz, or None."""
        return next((number for number, one in enumerate(self[3:]) if one is not None), None)

    def check(self, box, walls):
        """Refuse what cannot be.

        Raises:
            SceneError: an axis is not periodic, what stands for it is no rate, there are several shears, a servo is to hold
                stresses that are not alike, or a wall stands in the way.
        """
        given = [(name, axes, one) for name, axes, one in zip(self._fields, AXES, self) if one is not None]
        for name, axes, one in given:
            for axis in axes:
                if not box.periodic[axis]:
                    raise SceneError(f"deformation: {name} = {shown(one)}, but the box is not periodic along {'xyz'[axis]}")
            if not callable(one) and not isinstance(one, StressServo):
                _rate(f"deformation: {name}", one)
        shears = [(name, axes, one) for name, axes, one in given if len(name) == 2]
        if len(shears) > 1:
            raise SceneError(
                f"deformation: {shears[0][0]} and {shears[1][0]} are both given; a box is sheared in one way at a time"
            )
        for name, _, one in shears:
            if isinstance(one, StressServo) and any(one is other for other in self[:3]):
                raise SceneError(f"deformation: one StressServo stands for {name} and for an edge; give each its own")
            if any(tilt != 0.0 for other, tilt in zip(self._fields[3:], box.tilt) if other != name):
                raise SceneError(
                    f"deformation: {name} = {shown(one)}, but the box tilts by {box.tilt.tolist()} [length], along xy, xz, yz"
                )
        for number, wall in enumerate(walls):
            if wall.kind != "plane" and (shears or box.tilt.any()):
                raise SceneError(
                    f"deformation: wall {number} ({wall.kind}) would have to be sheared with the box; only planes can "
                    f"stand in one that is"
                )
            if wall.kind == "mesh" and given:
                name, _, one = given[0]
                raise SceneError(
                    f"deformation: {name} = {shown(one)}, but wall {number} (mesh) cannot be stretched with the box, and "
                    f"would no longer fit its periods. Deform the box before add_wall(), or take a plane"
                )

    def rates(self, sim):
        """Rates of the step that begins, (6,) [1/time]; 0 where there is none.

        Raises:
            SceneError: a function returned something else than a finite number, or the step is too long for a shear.
        """
        known = [0.0 if one is None else _seen(sim, one).rate if isinstance(one, StressServo) else one for one in self]
        rates = [rate(sim) if callable(rate) else rate for rate in known]
        found = np.array([_rate(f"deformation, t = {sim.time:g}: {axis}", rate) for axis, rate in zip(self._fields, rates)])
        fastest = int(np.abs(found[3:]).argmax())
        strain = abs(found[3 + fastest]) * sim.dt
        if strain > MOST_SHEAR:
            raise SceneError(
                f"deformation, t = {sim.time:g}: {self._fields[3 + fastest]} = {found[3 + fastest]:g} [1/time] is a shear by "
                f"{strain:g} in a step, of at most {MOST_SHEAR}; lower the rate or dt"
            )
        return found

    def look(self, sim):
        """Let the servos see what the grains carry now, those that have to; forces must be known. All ranks must call this."""
        servos = list(dict.fromkeys(one for one in self if isinstance(one, StressServo)))
        sim.held = {one: sim.held[one] for one in servos if one in sim.held}
        for servo in servos:
            seen = _seen(sim, servo)
            if seen == NOTHING_SEEN or sim.step_number % servo.LOOK == 0:
                axes = [axes for axes, one in zip(AXES, self) if one is servo]
                sim.held[servo] = servo.look(sim, axes, seen)

    def state(self, sim):
        """What a checkpoint keeps of the servos, in the order of the rates."""
        return [_seen(sim, one)._asdict() if isinstance(one, StressServo) else None for one in self]

    def restore(self, sim, state):
        """Take up what ``state`` returned."""
        servos = [(one, known) for one, known in zip(self, state) if isinstance(one, StressServo)]
        sim.held = {one: Seen(**known) for one, known in servos}


class Seen(NamedTuple):
    """What a servo remembers of a simulation [1/time]: the rate at which it deforms the box now, and the mean of late."""

    rate: float
    steady: float


NOTHING_SEEN = Seen(0.0, 0.0)


class StressServo:
    """Finds the rate at which a periodic box has to be stretched or sheared so that its grains carry a stress, and its own gain.

    rate = steady + SHARE (stress - target) / (M dt), with M the stiffness of the sample if all grains moved with the box:
    1/V times the sum of k l^2 n^4 of all contacts, k what the normal force is over the overlap, l the branch and n its direction
    along the axis; for a shear, of k l^2 (n_x^2 + n_z^2) / 4, as if contacts were as stiff to slide. ``steady`` is the mean of
    the rate of late, so that a target that grows steadily is followed without a lag. Stress and stiffness are looked up every
    ``LOOK`` steps.

    It may stand in several simulations: each remembers for itself what it has seen (``Simulation.held``).

    Args:
        stress: of the axes that it stands for, contacts and motion, compression positive; of a shear, positive where it resists
            a flow of positive rate. A number, or a function of the simulation [force/length^2].
        max_rate: the box is never deformed faster; where nothing touches, it shrinks so, or is sheared so [1/time].

    Raises:
        SceneError: a value is not a finite number, or the rate not above 0.
    """

    SHARE, LOOK, MEMORY = 0.02, 10, 200

    def __init__(self, stress, max_rate):
        if not callable(stress):
            _rate("StressServo: stress", stress, "force/length^2")
        self.stress, self.max_rate = stress, _rate("StressServo: max_rate", max_rate)
        if self.max_rate <= 0.0:
            raise SceneError(f"StressServo: max_rate = {shown(max_rate)} [1/time] must be above 0")

    def look(self, sim, axes, seen):
        """Find the rate from now on, a ``Seen``; all ranks must call this.

        Args:
            axes: of what it stands for, among ``AXES``.
            seen: what it found before.
        """
        target = self.stress(sim) if callable(self.stress) else self.stress
        target = _rate(f"StressServo, t = {sim.time:g}: stress", target, "force/length^2")
        rows, columns = np.transpose(axes)
        sheared = rows[0] != columns[0]
        excess = float(np.mean(stress(sim).total[rows, columns]))
        excess += target if sheared else -target  # a flow of positive rate meets a shear stress below 0
        stiffness = _stiffness(sim, rows, columns)
        if stiffness == 0.0:
            return Seen(copysign(self.max_rate, excess), 0.0)
        correction = self.SHARE * excess / (stiffness * sim.dt)
        found = seen.steady + correction
        if abs(found) >= self.max_rate:  # it can do no more: a steady rate that went on growing would be kept too long
            return Seen(copysign(self.max_rate, found), seen.steady)
        return Seen(found, seen.steady + correction * self.LOOK / self.MEMORY)


def deform(sim, rates):
    """Deform the box of ``sim`` from step n to n+1, and its grains with it; returns what it did to distances, (3, 3)."""
    moved = sim.box.stretch(rates, sim.dt)
    seen = sim.contacts.seen if sim.is_listed else np.zeros((4, sim.grains.n))
    stretch(*(sim.grains.block(name) for name in ("place", "motion", "image")), seen, *moved)
    return moved.gradient


def _stiffness(sim, rows, columns):
    """What the stress grows by for each unit of strain, were all grains to move with the box [force/length^2]."""
    terms = []
    for pairs in touching_pairs(sim):
        squares = pairs.branch**2
        along = squares[rows].sum(axis=0)
        stretched = along * along / dot(pairs.branch, pairs.branch)
        moduli = stretched if rows[0] == columns[0] else 0.25 * (squares[rows[0]] + squares[columns[0]])
        terms.append(np.maximum(pairs.normal_force, 0.0) / pairs.overlap * moduli)
    volume = float(np.prod(sim.box.span)) * len(rows) ** 2
    return float(exact_sums([np.concatenate([np.zeros(0), *terms])], sim.comm)[0, 0]) / volume


def _seen(sim, servo):
    return sim.held.get(servo, NOTHING_SEEN)


def _rate(what, value, dimension="1/time"):
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (number and isfinite(value)):
        raise SceneError(f"{what} = {shown(value)} [{dimension}] must be a finite number")
    return float(value)
