"""A part of space in which new grains appear while the simulation runs, where they overlap nobody."""

import warnings
from math import fsum, inf, isfinite
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from barchan.actions.room import TRIALS, find_room
from barchan.domain import numbers as as_numbers
from barchan.errors import SceneError
from barchan.triggers import trigger
from barchan.words import shown

#: Most grains that seek a place together: each is compared with all others.
AT_A_TIME = 1000

#: Room for rounding in what is due: the last of n grains of equal mass comes, too.
_ROUNDING = 1e-12


class Feed(NamedTuple):
    """What an ``Inlet`` lets in.

    ``radius``: of all grains [length], or a distribution such as ``barchan.packing.Sieves``. ``rate``: how much a time
    [1/time or mass/time]; infinite: all at once, or as soon as there is room. ``total``: how much in all [1 or mass]. ``by``:
    "number" or "mass": what rate and total count. ``material``: name or number. ``velocity``: three numbers, at the half step
    [length/time].
    """

    radius: Any
    rate: float
    total: float
    by: str = "number"
    material: Any = 0
    velocity: Any = (0.0, 0.0, 0.0)


class Inlet:
    """New grains at random places in a brick, where they overlap neither grains, nor walls, nor each other. The same grains come
    at the same places on any number of ranks and threads, and after a resume.

    Grain number k of an inlet has the radius number k of its distribution. At each look the grains that are due are tried at
    up to 50 places each, 1000 grains at a time; those that find none stay owed and are the first to be tried at the next look,
    and no further ones are until they are in: so the sizes that come are those of the distribution, also where large grains
    find a place less often. A warning says so the first time.

    Args:
        name: its own, under which ``sim.notes["inlets"]`` keeps, so that checkpoints do: ``grains`` that came, their ``mass``,
            what is ``owed`` (due by the last look and not in yet, in the unit of the total), and what the next look needs.
        region: low and high corner of the brick in which centres may lie [length]; inside the box, it may be flat.
        feed: a ``Feed``.
        due: trigger, a function of the step. The rate counts from the first step at which it is due.
        seed: of radii and places, a whole number >= 0.

    Raises:
        SceneError: an argument cannot be used.
    """

    def __init__(self, name, region, feed, due, seed=0):
        self.name, self.due, self.feed, self.seed = str(name), trigger(due, f"inlet '{name}'"), feed, seed
        self.brick, self._has_warned = as_numbers(f"inlet '{name}': region", region, "length"), False
        fault = _region_fault(self.brick) or _feed_fault(feed)
        if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or not 0 <= seed < 2**63:
            fault = fault or f"seed = {shown(seed)} must be a whole number from 0 to below 2^63"
        if fault:
            raise SceneError(f"inlet '{name}': {fault}")

    def apply(self, sim):
        """Let in what is due.

        Raises:
            SceneError: the region reaches out of the box, the box is sheared, or the material has no density.
        """
        if sim.box.tilt.any() or sim.deformation.sheared is not None:
            raise SceneError(f"inlet '{self.name}': in a box that is sheared there is none; add the grains before it is")
        if (self.brick[0] < sim.box.low).any() or (self.brick[1] > sim.box.high).any():
            raise SceneError(
                f"inlet '{self.name}': region {self.brick.tolist()} reaches out of the box {sim.box.low.tolist()} to "
                f"{sim.box.high.tolist()} [length]; centres of grains belong inside"
            )
        new = {"grains": 0, "mass": 0.0, "owed": 0.0, "begun": sim.time, "drawn": 0, "drawn_amount": 0.0, "waiting": []}
        note = sim.notes.setdefault("inlets", {}).setdefault(self.name, new)
        due = self.feed.total if self.feed.rate == inf else min(self.feed.total, self.feed.rate * (sim.time - note["begun"]))
        random = np.random.Generator(np.random.Philox([self.seed, crc32(self.name.encode()), sim.step_number]))
        while True:
            seeking = self._draw(sim, note, due)
            if not len(seeking):
                break
            note["waiting"] = self._let_in(sim, note, seeking, random)
            if note["waiting"]:
                self._warn(sim, len(note["waiting"]))
                break
        note["owed"] = max(0.0, due - note["mass" if self.feed.by == "mass" else "grains"])

    def _draw(self, sim, note, due):
        """Numbers of the grains that seek a place: those that wait, then the next that are due."""
        numbers = note["drawn"] + np.arange(AT_A_TIME - len(note["waiting"]))
        amount = self._mass(sim, self._radii(numbers)) if self.feed.by == "mass" else np.ones(len(numbers))
        after = note["drawn_amount"] + np.cumsum(amount)
        count = int(np.searchsorted(after, due * (1.0 + _ROUNDING), side="right"))
        if count:
            note["drawn"], note["drawn_amount"] = note["drawn"] + count, float(after[count - 1])
        return np.append(np.array(note["waiting"], dtype=np.int64), numbers[:count])

    def _let_in(self, sim, note, seeking, random):
        """Add those of the grains that find a place; returns the numbers of the others."""
        radius = self._radii(seeking)
        place, found = find_room(sim, self.brick, radius, random)
        if found.any():
            note["mass"] += fsum(self._mass(sim, radius[found]))
            note["grains"] += int(found.sum())
            sim.add_grains(place[found], radius[found], self.feed.material, self.feed.velocity)
        return seeking[~found].tolist()

    def _radii(self, numbers):
        if hasattr(self.feed.radius, "radii"):
            return self.feed.radius.radii(self.seed, numbers)
        return np.full(len(numbers), float(self.feed.radius))

    def _mass(self, sim, radius):
        material = sim.materials.list[sim.materials.index(self.feed.material)]
        if material.density is None:
            raise SceneError(f"inlet '{self.name}': material '{material.name}' has no density; give it one")
        return sim.shape.mass(radius, material.density)

    def _warn(self, sim, waiting):
        if not self._has_warned and sim.comm.rank == 0:
            warnings.warn(
                f"step {sim.step_number}: inlet '{self.name}': {waiting} grain(s) found no free place in {TRIALS} trials each; "
                f"they stay owed and are tried again. A larger region, a lower rate or a higher velocity makes room",
                stacklevel=2,
            )
        self._has_warned = True


def _region_fault(brick):
    if brick.shape != (2, 3) or not np.isfinite(brick).all() or (brick[0] > brick[1]).any():
        return f"region = {shown(brick.tolist())} [length] must be a low and a high corner, three finite numbers each"
    return None


def _feed_fault(feed):
    if not isinstance(feed, Feed):
        return f"feed = {shown(feed)} must be a barchan.actions.Feed(radius, rate, total, ...)"
    if feed.by not in ("number", "mass"):
        return f"by = {shown(feed.by)} must be 'number' or 'mass'"
    if not hasattr(feed.radius, "radii") and not (_is_above_zero(feed.radius) and isfinite(feed.radius)):
        return f"radius = {shown(feed.radius)} [length] must be a number > 0, or a distribution such as barchan.packing.Sieves"
    for name, dimension in (("rate", "1/time or mass/time"), ("total", "1 or mass")):
        if not _is_above_zero(getattr(feed, name)):
            return f"{name} = {shown(getattr(feed, name))} [{dimension}] must be a number > 0"
    if feed.rate == feed.total == inf:
        return "rate and total cannot both be infinite; give how much comes in all, or how much a time"
    velocity = as_numbers("inlet: velocity", feed.velocity, "length/time")
    if velocity.shape != (3,) or not np.isfinite(velocity).all():
        return f"velocity = {shown(feed.velocity)} [length/time] must be three finite numbers"
    return None


def _is_above_zero(value):
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool) and value > 0.0
