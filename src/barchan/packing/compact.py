"""Samples of a wanted solid fraction: walls close in to where it is reached, or grains grow."""

from barchan.errors import SceneError
from barchan.packing.preparation import NOTE, Preparation, begin, check_preparation, end, positive, settle, solid_volume
from barchan.preflight import check_count
from barchan.triggers import Every
from barchan.walls.curved import Cylinder
from barchan.walls.room import Room
from barchan.words import shown

#: Steps between two looks at which grains grow.
_GROW_EVERY = 20


def compact(sim, solid_fraction, by, how=Preparation(), steps=20_000):  # noqa: B008 (it cannot be changed)
    """Bring a cloud of grains to a wanted solid fraction, and let it come to rest. All ranks must call this.

    The volume is that of the ``barchan.walls.Room`` around the grains, and each grain counts whole. What pressure and overlap
    remain is for the sample to say: none where it is looser than what grains of this friction can carry, much where it is
    denser. It is resumed as ``press`` is, and friction is given back as there.

    Args:
        sim: grains in a room: a box with periodic faces on all sides, six planes, a cylinder and two planes, or what is between.
        solid_fraction: wanted [1].
        by: "walls": all walls of the room close in, evenly from all sides, and stand still then; "growth": radii grow by one
            factor, masses of spheres by its cube and of discs by its square, so that the density stays.
        how: a ``Preparation``.
        steps: in so many walls close in, or grains grow, before they come to rest.

    Returns:
        ``Sample``.

    Raises:
        SceneError: there is no room, or no walls that could close in, the cloud is denser already, or an argument cannot be
            used.
        RunError: the sample did not come to rest.
    """
    check_preparation("compact", how)
    check_count("compact: steps", steps, least=_GROW_EVERY)
    wanted, room = positive("compact: solid_fraction", solid_fraction, "1"), Room(sim)
    present = solid_volume(sim) / room.volume
    if wanted >= 1.0 or (present >= wanted and NOTE not in sim.notes):
        raise SceneError(
            f"compact: solid_fraction = {wanted:g} [1] must be below 1, and above that of now, {present:.4g}; start looser"
        )
    if by not in ("walls", "growth"):
        raise SceneError(f"compact: by = {shown(by)} must be 'walls' or 'growth'")
    what = ["compact", wanted, by, int(steps)]
    return (_close_in if by == "walls" else _grow)(sim, room, wanted / present, how, what)


def _close_in(sim, room, factor, how, what):
    """Walls close in with steady velocities; in the last step they are where the room has the volume."""
    room.check_has_walls("compact")
    steps = what[-1]
    moving = sum(len(ends) > 0 for ends in room.ends) + 2 * (room.side is not None)
    strain = 1.0 - factor ** (-1.0 / moving)

    for wall in room.walls:
        if wall.control is not None:
            raise SceneError(f"compact: this {wall.kind} has a control, {type(wall.control).__name__}; set it to None first")

    def set_up():
        for wall in room.walls:
            _set_speed(wall, 0.5 * strain * room.across(wall) / (steps * sim.dt))

    note = begin(sim, how, what, {"moving": True}, set_up)
    sim.run(max(note["begun"] + steps - sim.step_number, 0))
    if note["moving"]:
        note["moving"] = False
        for wall in room.walls:
            _set_speed(wall, 0.0)
    settle(sim, how, room, after=steps)
    return end(sim)


def _set_speed(wall, speed):
    if isinstance(wall, Cylinder):
        wall.radial_velocity = -speed
    else:
        wall.velocity = speed * wall.normal


class _Growth:
    """An action: radii grow by an even part of what is left, so that in the end it is exactly the factor."""

    def __init__(self, begun, steps, factor):
        self._begun, self._times, self._factor = begun, steps // _GROW_EVERY, factor
        self.due = Every(_GROW_EVERY, start=begun + _GROW_EVERY)

    def apply(self, sim):
        """Grow, with the mass: all grains, in the same proportion."""
        looks = (sim.step_number - self._begun) // _GROW_EVERY
        now, before = (1.0 + (self._factor - 1.0) * count / self._times for count in (looks, looks - 1))
        sim.grains.radius *= now / before
        sim.grains.mass *= (now / before) ** sim.shape.dimension


def _grow(sim, room, factor, how, what):
    steps = what[-1]
    note = begin(sim, how, what, {"factor": factor ** (1.0 / sim.box.dimension)}, lambda: None)
    growth = _Growth(note["begun"], steps, note["factor"])
    sim.actions.append(growth)
    try:
        sim.run(max(note["begun"] + steps - sim.step_number, 0))
    finally:
        sim.actions.remove(growth)
    settle(sim, how, room, after=steps)
    return end(sim)
