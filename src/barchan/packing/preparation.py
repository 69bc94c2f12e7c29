"""How samples are prepared: what all ways share, the friction meanwhile, and what came out."""

import math
from itertools import combinations_with_replacement
from pathlib import Path
from typing import NamedTuple

import numpy as np

from barchan.checkpoint import restore
from barchan.errors import MaterialError, RunError, SceneError
from barchan.measure import ContactStatistics, stress, unbalanced_force
from barchan.measure.base import filled_volume
from barchan.measure.sums import exact_sums
from barchan.triggers import Every
from barchan.words import shown

#: Under which ``Simulation.notes``, and so a checkpoint, keeps how far a preparation is.
NOTE = "preparation"

#: Largest overlap, relative to the diameter, up to which nothing bears: a sample too loose to carry anything is at rest then.
_BEARS_NOTHING = 1e-5


class Preparation(NamedTuple):
    """How a sample is prepared.

    ``friction``: of grains with each other meanwhile [1]; None: that of their materials. 0 makes the densest samples, more makes
    looser ones. ``rest``: unbalanced force at which it is at rest [1]. ``look``: so often it is looked at [steps].
    ``most``: it must be at rest by then [steps]. ``resume``: a checkpoint that was written meanwhile, from which to go on.
    """

    friction: float | None = None
    rest: float = 1e-3
    look: int = 500
    most: int = 1_000_000
    resume: str | Path | None = None


class Sample(NamedTuple):
    """What came out, the same on all ranks.

    ``solid_fraction``: volume of all grains over that of the room [1]. ``pressure``: mean stress of the grains over the room
    [force/length^2]. ``overlap``: the largest, relative to the smaller diameter [1]. ``unbalanced``: unbalanced force [1],
    infinite where nothing touches. ``steps``: that it took.
    """

    solid_fraction: float
    pressure: float
    overlap: float
    unbalanced: float
    steps: int

    @property
    def void_ratio(self):
        """Volume of the voids over that of the grains [1]."""
        return (1.0 - self.solid_fraction) / self.solid_fraction


def check_preparation(what, how):
    """Refuse what is no way to prepare a sample.

    Raises:
        SceneError: naming it.
    """
    if not isinstance(how, Preparation):
        raise SceneError(f"{what}: how = {shown(how)} must be a barchan.packing.Preparation")
    for name in ("look", "most"):
        value = getattr(how, name)
        if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 1:
            raise SceneError(f"{what}: {name} = {shown(value)} [steps] must be a whole number >= 1")
    if how.look > how.most:
        raise SceneError(f"{what}: look = {how.look} [steps] must be at most most = {how.most}, by when it must be at rest")
    if how.resume is not None and not isinstance(how.resume, (str, Path)):
        raise SceneError(f"{what}: resume = {shown(how.resume)} must be the path of a checkpoint")
    positive(f"{what}: rest", how.rest, "1")


def positive(what, value, dimension):
    """A user's number above 0.

    Raises:
        SceneError: it is none.
    """
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = np.nan
    if not (np.isfinite(number) and number > 0.0):
        raise SceneError(f"{what} = {shown(value)} [{dimension}] must be a finite number > 0")
    return number


def begin(sim, how, what, note, set_up):
    """Begin, or go on with what was begun: in this process, or in that which wrote ``how.resume``.

    Args:
        what: is being prepared, plain data: only the same can go on.
        note: what else to remember of the beginning, plain data.
        set_up: what sets controls and actions, which checkpoints do not keep.

    Returns:
        What was remembered; ``end`` forgets it.

    Raises:
        SceneError: the checkpoint was not written during a preparation, or something else is being prepared.
        MaterialError: the law knows no friction, or not this one.
        CheckpointError: it cannot be read, or belongs to another scene.
    """
    if NOTE not in sim.notes:
        note = {
            "begun": sim.step_number,
            "what": what,
            "pairs": sim.materials.describe()["pairs"],
            "rests": False,
            "sample": [0.0, 0.0, 0.0, math.inf],
            **note,
        }
        if how.friction is not None:
            _set_friction(sim, how.friction)
        set_up()
        sim.notes[NOTE] = note
    if how.resume is not None:
        restore(sim, how.resume)
        if NOTE not in sim.notes:
            raise SceneError(f"checkpoint {how.resume}: no sample was being prepared when it was written; restore() takes it up")
    begun = sim.notes[NOTE]
    if begun["what"] != what:
        raise SceneError(
            f"{' '.join(map(str, what))}: since step {begun['begun']} another sample is being prepared: "
            f"{' '.join(map(str, begun['what']))}. Go on with that, or make the scene anew"
        )
    return begun


def settle(sim, how, room, holds=lambda: True, after=0):
    """Run until the sample is at rest, and what is wanted holds.

    Args:
        room: that is around it.
        holds: function without arguments, called on all ranks.
        after: steps from the beginning that are over before the first look.

    Raises:
        RunError: it did not come to rest.
    """
    note = sim.notes[NOTE]
    first = note["begun"] + (after // how.look + 1) * how.look
    look = _Look(Every(how.look, start=first), how.rest, room, holds)
    sim.writers.insert(0, look)
    try:
        while not note["rests"]:
            done = sim.step_number - note["begun"]
            if done >= how.most:
                raise RunError(
                    f"step {sim.step_number}: the sample is not at rest after {done} steps: unbalanced force "
                    f"{note['sample'][-1]:.3g}, allowed {how.rest:g}. Damp more (a lower restitution, or "
                    f"Simulation.damping), or allow more (Preparation: rest, most)"
                )
            sim.run(how.look - done % how.look)
    finally:
        sim.writers.remove(look)


class _Look:
    """A writer, the first, so that a checkpoint of the same step knows what was seen: a restored state cannot be measured."""

    def __init__(self, due, rest, room, holds):
        self.due, self._rest, self._room, self._holds = due, rest, room, holds

    def write(self, sim):
        """Note what is there, and whether it is at rest."""
        note = sim.notes[NOTE]
        unbalanced, overlap, volume = unbalanced_force(sim), ContactStatistics().compute(sim).largest_overlap, self._room.volume
        pressure = stress(sim, volume=volume).mean_stress
        note["sample"] = [solid_volume(sim) / volume, pressure, overlap, unbalanced]
        note["rests"] = bool((unbalanced < self._rest or overlap < _BEARS_NOTHING) and self._holds())


def end(sim):
    """Give back the friction that was there before; the ``Sample``, as it was seen with that of the preparation."""
    note = sim.notes.pop(NOTE)
    sim.materials.replace_pairs(note["pairs"])
    return Sample(*note["sample"], sim.step_number - note["begun"])


def solid_volume(sim):
    """Volume of all grains [length^3], or in two dimensions their area [length^2].

    Raises:
        SceneError: there are none.
    """
    volume = float(exact_sums((filled_volume(sim.grains.view("radius"), sim.box.dimension),), sim.comm)[0, 0])
    if volume == 0.0:
        raise SceneError("there are no grains to prepare a sample of; add_grains() comes first, before a resume, too")
    return volume


def _set_friction(sim, friction):
    """Friction of the materials that grains have, with themselves and each other."""
    own = np.bincount(sim.grains.view("material"), minlength=len(sim.materials))
    used = np.flatnonzero(sim.comm.sum(own)).tolist()
    before = sim.materials.describe()["pairs"]
    for first, second in combinations_with_replacement(used, 2):
        sim.materials.set_pair(first, second, friction=friction)
    try:
        sim.materials.table(sim.law)
    except MaterialError:
        sim.materials.replace_pairs(before)
        raise
