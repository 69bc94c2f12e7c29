"""What sets the velocity of a wall in every step: a path in time, or what grains do to the wall.

One without a memory may be given to any number of walls, one with (``Massive``, ``Servo``) to a single one. Functions of the
simulation are called on all ranks and must return the same on all.
"""

from math import copysign, isfinite

import numpy as np

from barchan.errors import SceneError
from barchan.kernels.provenance import source_hash
from barchan.walls.wall import three
from barchan.words import shown


def _number(what, value, dimension, least=None):
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not isfinite(number) or (least is not None and number <= least):
        bound = "" if least is None else f" > {least:g}"
        raise SceneError(f"{what} = {shown(value)} [{dimension}] must be a finite number{bound}")
    return number


_DIMENSIONS = {"force": "force", "stress": "force/length^2", "area": "length^2"}

#: What they must exceed.
_LEAST = {"area": 0.0}


class Control:
    """The base of controls. One of your own derives from it and has ``steer``; what it remembers stands in ``memory``.

    Attributes:
        start: the first step from which it sets a velocity; before, the wall moves on as it does.
        memory: names of attributes that a checkpoint keeps, each a number.
    """

    start, memory = 0, ()

    def steer(self, wall, sim):
        """Set the velocity of ``wall`` from step n to n+1, with ``wall.push(speed)`` or its ``drive``; loads are those of n."""
        raise NotImplementedError

    def state(self):
        """What a checkpoint keeps: a change of a function is noticed by the hash of its source."""
        given = {name: value for name, value in sorted(vars(self).items()) if name not in self.memory and value is not None}
        told = {name: source_hash(value) if callable(value) else np.array(value).tolist() for name, value in given.items()}
        return {"kind": type(self).__name__, "given": told, **{name: float(getattr(self, name)) for name in self.memory}}

    def restore(self, state):
        """Take up what ``state`` returned."""
        for name in self.memory:
            setattr(self, name, float(state[name]))


class Path(Control):
    """The wall follows a function of time: where it is in each step is where the function says, but for rounding.

    Args:
        offset: function of time [time] that returns a displacement, three numbers [length]; only its changes matter.

    Raises:
        SceneError: it is no function.
    """

    def __init__(self, offset):
        if not callable(offset):
            raise SceneError(f"Path: offset = {shown(offset)} must be a function of time that returns three numbers [length]")
        self.offset = offset

    def steer(self, wall, sim):
        """Go where the function says that the wall is in the next step."""
        here, there = (three("Path: offset", self.offset(time), "length") for time in (sim.time, sim.time + sim.dt))
        wall.drive((there - here) / sim.dt)


class Vibration(Path):
    """The wall vibrates: its displacement is amplitude sin(2 pi frequency t).

    Args:
        amplitude: three numbers [length].
        frequency: [1/time], not negative.

    Raises:
        SceneError: a value is not finite.
    """

    def __init__(self, amplitude, frequency):
        amplitude = three("Vibration: amplitude", amplitude, "length")
        if _number("Vibration: frequency", frequency, "1/time") < 0.0:
            raise SceneError(f"Vibration: frequency = {frequency!r} [1/time] must not be negative")
        self.amplitude, self.frequency = amplitude, float(frequency)

    def offset(self, time):
        """Displacement at ``time`` [length]."""
        return self.amplitude * np.sin(2.0 * np.pi * self.frequency * time)


class ForceControl(Control):
    """The base of controls that let grains press on the wall with a wanted force, constant or a function of the simulation.

    Args:
        force: number, or function of the simulation, positive when grains press on the wall [force].
        stress: the same of the stress on the wall [force/length^2]; it needs ``area``.
        area: number, or function of the simulation, such as ``between(left, right, front, back)`` [length^2].
        max_speed: the wall is never faster [length/time]; None: no limit.
        start: the first step from which the wall is controlled.

    Raises:
        SceneError: neither or both of force and stress are given, stress without area, or a value that cannot be.
    """

    def __init__(self, force=None, stress=None, area=None, max_speed=None, start=0):
        if (force is None) == (stress is None) or (stress is None) != (area is None):
            raise SceneError(
                f"{type(self).__name__} needs a target: either force [force], or stress [force/length^2] and area [length^2]"
            )
        kind = type(self).__name__
        for name, value in (("force", force), ("stress", stress), ("area", area)):
            if value is not None and not callable(value):
                _number(f"{kind}: {name}", value, _DIMENSIONS[name], _LEAST.get(name))
        if not isinstance(start, (int, np.integer)) or isinstance(start, bool) or start < 0:
            raise SceneError(f"{kind}: start = {shown(start)} [steps] must be a whole number >= 0")
        self.force, self.stress, self.area, self.start = force, stress, area, int(start)
        self.max_speed = None if max_speed is None else _number(f"{kind}: max_speed", max_speed, "length/time", 0.0)

    def target(self, sim):
        """The wanted force at the present time [force].

        Raises:
            SceneError: a function returned something else than a finite number.
        """
        if self.stress is None:
            return self._value("force", sim)
        return self._value("stress", sim) * self._value("area", sim)

    def _value(self, name, sim):
        given = getattr(self, name)
        what = f"{type(self).__name__}, t = {sim.time:g}: {name}"
        return _number(what, given(sim) if callable(given) else given, _DIMENSIONS[name], _LEAST.get(name))

    def steer(self, wall, sim):
        """Push the wall with the speed that the control finds, within its limit."""
        wall.push(self.limited(self.speed(wall, self.target(sim) - wall.pressing, sim.dt)))

    def limited(self, speed):
        """The speed, or the largest that is allowed."""
        return speed if self.max_speed is None else min(max(speed, -self.max_speed), self.max_speed)

    def speed(self, wall, error, dt):
        """Speed towards the grains for the next step [length/time].

        Args:
            error: how much more than now grains shall press on the wall [force].
        """
        raise NotImplementedError


class Proportional(ForceControl):
    """v = G (F_target - F_actual), the controller of Marketos et al. (2013). The right gain is yours to find: above
    2 / (K dt), with K the stiffness of all contacts that the wall touches, it is unstable; a low one lags behind.

    Args:
        gain: G [length/time/force].
        target: ``force``, or ``stress`` and ``area``, and ``max_speed`` of a ``ForceControl``.
    """

    def __init__(self, gain, **target):
        super().__init__(**target)
        self.gain = _number("Proportional: gain", gain, "length/(time force)", 0.0)

    def speed(self, wall, error, dt):
        """G times the error."""
        return self.gain * error


class Servo(ForceControl):
    """A controller that finds its own gain: v = v_0 + G (F_target - F_actual) with G = ``SHARE`` / (K dt + 2 eta).

    K and eta are stiffness and viscosity of all contacts that the wall touches; v_0 is the mean of v over the last steps, so that
    a target that grows steadily is followed without a lag. Where nothing touches it the wall has ``max_speed``.

    While grains stay where they are a step changes the force by K v dt, and at once by eta v: that is stable for a SHARE below 2.
    A wall with v = G (F_target - F) takes up waves as a dashpot 1/G does, so it calms the grains; more grains would, too, as one
    of about sqrt(K m), which is 5 to 10 K dt.

    A sample, n grains across, is about n times as soft as the contacts at its wall, and answers as much later. So v_0 is the mean
    over ``MEMORY`` n steps, with n^3 all grains of the simulation, but no fewer than for ``FEWEST`` across: with 500 steps a
    sample of 112 grains across swung about its target for as long as it was watched.

    K and eta are looked up every ``LOOK`` steps: they change slowly, and to ask the law takes as long as 500 grains. n is counted
    every ``COUNT`` steps.

    Args:
        max_speed: the wall is never faster [length/time]; it meets grains with this speed.
        target: ``force``, or ``stress`` and ``area``, of a ``ForceControl``.
    """

    SHARE, MEMORY, FEWEST, LOOK, COUNT = 1.0, 50, 10, 10, 1000
    memory = ("steady", "resistance", "patience")

    def __init__(self, max_speed, **target):
        super().__init__(max_speed=_number("Servo: max_speed", max_speed, "length/time", 0.0), **target)
        self.steady = self.resistance = self.patience = 0.0

    def steer(self, wall, sim):
        """Look up what the wall touches, and how many grains there are, from time to time, and push."""
        if sim.step_number % self.COUNT == 0 or self.patience == 0.0:
            self.patience = float(self.MEMORY * max(np.cbrt(sim.n_grains), self.FEWEST))
        if sim.step_number % self.LOOK == 0 or (self.resistance == 0.0 and wall.contacts):
            response = wall.response
            self.resistance = response.stiffness * sim.dt + 2.0 * response.viscosity
        super().steer(wall, sim)

    def speed(self, wall, error, dt):
        """From the error, what resists, and the speed of late."""
        if self.resistance == 0.0:
            self.steady = 0.0
            return copysign(self.max_speed, error)
        correction = self.SHARE / self.resistance * error
        speed = self.steady + correction
        if abs(speed) < self.max_speed:
            self.steady += correction / self.patience
        return speed


class Massive(ForceControl):
    """A wall with mass, pushed by the target force, slowed by damping, held by the grains: m dv/dt = F_target - F_actual - c v.

    Args:
        mass: m [mass].
        damping: c [force time/length], not negative.
        target: ``force``, or ``stress`` and ``area``, and ``max_speed`` of a ``ForceControl``.
    """

    memory = ("moving",)

    def __init__(self, mass, damping=0.0, **target):
        super().__init__(**target)
        self.mass, self.damping = _number("Massive: mass", mass, "mass", 0.0), _number("Massive: damping", damping, "mass/time")
        if self.damping < 0.0:
            raise SceneError(f"Massive: damping = {damping!r} [mass/time] must not be negative")
        self.moving = 0.0

    def speed(self, wall, error, dt):
        """Leap-frog, with the damping taken at the middle of the step, where it is stable for any c."""
        drag = 0.5 * dt * self.damping / self.mass
        self.moving = ((1.0 - drag) * self.moving + dt * error / self.mass) / (1.0 + drag)
        self.moving = self.limited(self.moving)
        return self.moving


def check_controls(walls):
    """Refuse controls that cannot do with the walls that have them.

    Raises:
        SceneError: two walls share one with a memory, or one is to push a wall that does not know where to.
    """
    seen = {}
    for number, wall in enumerate(walls):
        kind = type(wall.control).__name__
        first = seen.setdefault(id(wall.control), number) if getattr(wall.control, "memory", ()) else number
        if first != number:
            raise SceneError(f"walls {first} and {number} share one {kind}, whose memory is that of one wall; give each its own")
        if isinstance(wall.control, ForceControl) and not wall.can_be_pushed:
            instead = "set its towards, a direction" if wall.kind == "mesh" else "it can follow a Path"
            raise SceneError(f"wall {number} ({wall.kind}): a {kind} cannot push it, since it is not known where to; {instead}")


def between(first, second, third=None, fourth=None):
    """Area between two pairs of opposite planes, or, of one pair, their distance: for a ``ForceControl`` [length^2 or length].

    Args:
        first, second: planes that face each other.
        third, fourth: two more, across the first two.

    Returns:
        A function of the simulation.
    """

    def gap(one, other):
        (x, y, z), (a, b, c), (nx, ny, nz) = one.point.tolist(), other.point.tolist(), one.normal.tolist()
        return abs((a - x) * nx + (b - y) * ny + (c - z) * nz)

    def area(sim):
        return gap(first, second) * (1.0 if third is None else gap(third, fourth))

    return area
