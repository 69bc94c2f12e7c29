"""Samples under a wanted pressure: all walls of the room close in until grains press on each with it."""

from math import sqrt

import numpy as np

from barchan.errors import SceneError
from barchan.measure.sums import exact_sums
from barchan.packing.preparation import Preparation, begin, check_preparation, end, positive, settle, solid_volume
from barchan.walls.control import Servo
from barchan.walls.room import Room

#: How far the stress on each wall may be from the pressure.
_HELD = 2e-3

#: The largest speed of a wall as an inertial number of the pressure: rate of strain times diameter times sqrt(density/pressure).
_CLOSING = 1e-2


def press(sim, pressure, how=Preparation()):  # noqa: B008 (it cannot be changed)
    """Press a cloud of grains by all walls of its ``barchan.walls.Room`` until each has the wanted stress and grains are at rest.

    Each wall gets a ``Servo``, as ``hold`` gives it, which goes on holding the pressure afterwards. Gravity must be 0: walls that
    bear weight would have more than the others. All ranks must call this.

    A run that was stopped meanwhile goes on, bit for bit: make the same scene, call this with the same arguments, and give the
    checkpoint as ``how.resume``. Afterwards grains have the friction of before again; the next run computes forces with it.

    Args:
        sim: grains that do not overlap much, in a room: six planes, or a cylinder and two planes, or periodic faces instead of
            some of them.
        pressure: on each wall, within 0.2 % [force/length^2].
        how: a ``Preparation``.

    Returns:
        ``Sample``.

    Raises:
        SceneError: there is no room, or it has no walls, or gravity is on, or an argument cannot be used.
        RunError: the sample did not come to rest.
    """
    check_preparation("press", how)
    pressure, room = positive("press: pressure", pressure, "force/length^2"), Room(sim)
    room.check_has_walls("press")
    if any(sim.present_gravity):
        raise SceneError(
            f"press: gravity = {sim.present_gravity} [length/time^2] must be 0, or the floor bears more than the pressure; set "
            f"sim.gravity = (0, 0, 0), and turn it on again afterwards"
        )
    begin(sim, how, ["press", pressure], {}, lambda: hold(sim, pressure))
    settle(sim, how, room, lambda: all(abs(room.stress(sim, wall) - pressure) <= _HELD * pressure for wall in room.walls))
    return end(sim)


def hold(sim, pressure):
    """Give each wall of the ``barchan.walls.Room`` a ``Servo`` that lets grains press on it with a pressure.

    Walls close in with an inertial number of at most 0.01, of the grains and the room as they are now. A script that resumes a
    checkpoint written after ``press`` makes the same scene, calls this instead, and then ``restore``. All ranks must call this.

    Args:
        sim: grains in a room, as ``press`` takes them.
        pressure: on each wall [force/length^2].

    Raises:
        SceneError: there is no room, or no grains, or the pressure is not above 0.
    """
    pressure, room = positive("hold: pressure", pressure, "force/length^2"), Room(sim)
    rate = _rate(sim, pressure)
    for wall in room.walls:
        wall.control = Servo(max_speed=0.5 * rate * room.across(wall), stress=pressure, area=room.area(wall))


def _rate(sim, pressure):
    """The fastest rate of strain [1/time]."""
    volume, grains = solid_volume(sim), sim.grains
    mass, radius, count = exact_sums((grains.view("mass"), grains.view("radius"), np.ones(grains.n)), sim.comm)[:, 0].tolist()
    return _CLOSING * sqrt(pressure * volume / mass) / (2.0 * radius / count)
