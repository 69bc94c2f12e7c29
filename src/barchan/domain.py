"""The box: which part of space is simulated and which of its faces are periodic. Nobody else knows."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError


def numbers(what, value, dimension):
    """A user's numbers as an array of doubles.

    Raises:
        SceneError: ``value`` is no number, or no regular list of numbers.
    """
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"{what} = {value!r} [{dimension}] must be numbers") from None


#: Axes of the flow and of the gradient of each way to shear a box: xy is a flow along x that grows along y.
SHEARS = ((0, 1), (0, 2), (1, 2))


class Frame(NamedTuple):
    """The box as the kernels see it, (3,) each; ``half`` is infinite where a direction is not periodic. ``tilt``: ``Box.tilt``.
    ``rate``, (6,): by which the place of a grain in the box moves faster for each length along an axis, as the box is deformed,
    in the order of ``Deformation`` [1/time]."""

    low: np.ndarray
    length: np.ndarray
    half: np.ndarray
    tilt: np.ndarray
    rate: np.ndarray


class Stretch(NamedTuple):
    """What becomes of places and velocities in a step in which the box is deformed, (3,) each: places relative to ``centre``
    grow by the factor ``ratio`` and are shifted along the flow by ``slide`` times that along the gradient, xy, xz, yz; velocities
    grow by ``slower``, and lose ``drag`` times that along the gradient. ``turns``: periods that the images along a gradient were
    set back."""

    centre: np.ndarray
    ratio: np.ndarray
    slower: np.ndarray
    slide: np.ndarray
    drag: np.ndarray
    turns: np.ndarray

    @property
    def gradient(self):
        """What it does to distances, (3, 3)."""
        matrix = np.diag(self.ratio)
        for (flow, along), slide in zip(SHEARS, self.slide):
            matrix[flow, along] = slide
        return matrix


class Upright(NamedTuple):
    """A box without tilt in which neighbours are sought instead: what is near in the box is at least as near in it.

    ``low``, ``high``, ``span``, ``periodic``, ``frame``: as a ``Box`` has them. ``slope``: tilts for each length, xy, xz, yz.
    ``spread``: lengths along each axis are so much larger in the box, (3,).
    """

    low: np.ndarray
    high: np.ndarray
    span: np.ndarray
    periodic: tuple
    frame: Frame
    slope: np.ndarray
    spread: np.ndarray

    @property
    def leans(self):
        """Whether places are others than in the box."""
        return bool(self.slope.any())

    def places(self, place):
        """Where places (n, 3) lie in it, inside; further columns do not change. ``place`` itself if the box does not tilt."""
        if not self.leans:
            return place
        upright = np.array(place)
        for (flow, along), slope in zip(SHEARS, self.slope):
            if slope != 0.0:
                period, low = self.spread[flow] * self.span[flow], self.low[flow]
                x = upright[:, flow] - slope * (upright[:, along] - self.low[along])
                x = x - period * np.floor((x - low) / period)
                upright[:, flow] = np.where((x >= low) & (x < low + period), x, low)
        upright[:, :3] = self.low + (upright[:, :3] - self.low) / self.spread
        upright[:, :3] = np.minimum(upright[:, :3], self.high)
        return upright


class Box:
    """An axis-aligned box, or in two dimensions a rectangle in the plane z = 0.

    Args:
        low, high: corners, three numbers each [length], or two, x and y: then all that happens in it happens in the plane.
        periodic: a boolean for each direction, by default none; a grain that leaves through a periodic face enters at the
            opposite one, a grain that leaves through any other face is lost, which is an error.

    Attributes:
        dimension: 3 or 2.
        low, high: corners, (3,) each [length]; in two dimensions z is 0 in both. As a ``Deformation`` stretches the box, they
            are those of now.
        first: low and high as they were given, (2, 3) [length].
        tilt: how far the image of a place lies aside, xy: along x of the image above along y, xz, yz alike (3,) [length]. At most
            one is not 0, as the box is sheared, and at most half a period.
        middle: edge lengths in the middle of the last step, (3,) [length].
        periodic: three booleans.

    Raises:
        SceneError: a corner is not finite, or ``high`` does not exceed ``low``.

    >>> box = Box((0, 0, 0), (2, 1, 1), periodic=(True, False, False))
    >>> box.length.tolist()
    [2.0, 1.0, 1.0]
    >>> box.difference(np.array([1.9, 0.5, 0.5]), np.array([0.1, 0.5, 0.5])).round(12).tolist()
    [-0.2, 0.0, 0.0]
    >>> plane = Box((0, 0), (2, 1))
    >>> plane.dimension, plane.low.tolist(), plane.high.tolist()
    (2, [0.0, 0.0, 0.0], [2.0, 1.0, 0.0])
    """

    def __init__(self, low, high, periodic=None):
        corners = numbers("box: low", low, "length"), numbers("box: high", high, "length")
        self.dimension = corners[0].size
        flags = [False] * self.dimension if periodic is None else [None]
        flags = list(periodic) if isinstance(periodic, (tuple, list, np.ndarray)) else flags
        if not all(isinstance(flag, (bool, np.bool_)) or flag in (0, 1) for flag in flags):
            raise SceneError(f"box: periodic = {periodic!r} must be three of True and False, or two in two dimensions")
        shapes = {corners[0].shape, corners[1].shape, (len(flags),)}
        if shapes not in ({(3,)}, {(2,)}):
            raise SceneError(
                f"box: low, high and periodic take three values each, or two in two dimensions; got {low!r}, {high!r}, "
                f"{periodic!r}"
            )
        with np.errstate(all="ignore"):
            length = corners[1] - corners[0]
        if not (np.isfinite(length).all() and (corners[1] > corners[0]).all()):
            raise SceneError(
                f"box: high [length] must be finite and exceed low on every axis; got low={low!r}, high={high!r}. In two "
                f"dimensions corners have two numbers"
            )
        across = [0.0] * (3 - self.dimension)
        self.first = np.array([np.append(corner, across) for corner in corners])
        self.low, self.high = self.first
        self.middle, self.tilt, self._rate = self.length, np.zeros(3), np.zeros(6)
        self.periodic = (*(bool(flag) for flag in flags), *(False for _ in across))

    @property
    def length(self):
        """Edge lengths, shape (3,) [length]; 0 across the plane of a two-dimensional box."""
        return self.high - self.low

    @property
    def span(self):
        """The same, but 1 across the plane: volumes are areas then."""
        return np.where(np.arange(3) < self.dimension, self.length, 1.0)

    @property
    def frame(self):
        """The box as plain numbers for kernels."""
        half = np.where(self.periodic, 0.5 * self.length, np.inf)
        return Frame(self.low, self.length, half, self.tilt, self._rate)

    @property
    def upright(self):
        """The ``Upright`` box that lists of neighbours are made in."""
        return self.leaning(self.tilt)

    def leaning(self, tilt):
        """The ``Upright`` box, were its tilts others."""
        span, frame = self.span, self.frame
        slope, spread = np.zeros(3), np.ones(3)
        for number, (flow, along) in enumerate(SHEARS):
            if tilt[number] != 0.0:
                slope[number] = tilt[number] / span[along]
                half = 0.5 * abs(slope[number])
                spread[[flow, along]] = half + np.sqrt(1.0 + half * half)  # a distance may be so much larger without the tilt
        high = np.where(spread != 1.0, self.low + self.length / spread, self.high)
        length = high - self.low  # to the bit, as that of a box
        frame = frame._replace(length=length, half=np.where(self.periodic, 0.5 * length, np.inf), tilt=np.zeros(3))
        span = np.where(np.arange(3) < self.dimension, length, 1.0)
        return Upright(self.low, high, span, self.periodic, frame, slope, spread)

    @property
    def moves(self):
        """Whether it was deformed in the last step: then velocities still have to follow in the next."""
        return bool(self._rate.any())

    @property
    def gradient(self):
        """How fast it parts places in it, for each length: velocity gradient of the last step, (3, 3) [1/time]."""
        matrix = np.diag(self._rate[:3])
        for (flow, along), rate in zip(SHEARS, self._rate[3:]):
            matrix[flow, along] = rate
        return matrix

    def stretch(self, rate, dt):
        """Deform the box about its centre for a step; returns a ``Stretch``.

        A place x keeps its share of the box but for the velocity v of the grain, which is that relative to the box: x' = v + G x
        and v' = F/m - G v, as in Evans & Morriss, Phys. Rev. A 30, 1528 (1984). So in a box whose edges grow steadily free grains
        fly straight on in space. With L(n+1) = (1 + rate dt) L(n), G(n+1/2) is the change of L over its mean in the step, and
        v(n+1/2) / v(n-1/2) the means of L the other way round. Where it is sheared it is x(n) that tells how fast the box moves
        in the step, so that a free grain flies straight on, too.

        Args:
            rate: relative growth of each edge, and the shear rates xy, xz, yz (6,), 0 where the box is not periodic [1/time].
        """
        centre, before, length = 0.5 * (self.low + self.high), self.middle, self.length
        ratio, slide, drag = 1.0 + dt * rate[:3], dt * rate[3:], dt * self._rate[3:]
        moved = ratio != 1.0
        low, high = (centre + sign * 0.5 * ratio * length for sign in (-1.0, 1.0))
        self.low, self.high = np.where(moved, low, self.low), np.where(moved, high, self.high)
        self.middle = 0.5 * (length + self.length)
        middle = np.where(self.middle > 0.0, self.middle, 1.0)
        self._rate = np.concatenate([rate[:3] * length / middle, rate[3:]])
        turns = self._tilt_by(ratio, slide, length)
        return Stretch(centre, ratio, np.where(self.middle > 0.0, before / middle, 1.0), slide, drag, turns)

    def _tilt_by(self, ratio, slide, length):
        """Tilt the images; one that is shifted by more than half a period is the image beside it. Returns how many periods."""
        flow, along = np.array(SHEARS).T
        tilt, period = ratio[flow] * self.tilt + slide * length[along], np.where(self.tilt + slide != 0.0, self.length[flow], 1.0)
        turns = np.rint(tilt / period)
        self.tilt = tilt - turns * period
        return turns.astype(np.int32)

    def state(self):
        """What a checkpoint keeps of it, besides what it was at first."""
        names = ("low", "high", "middle", "tilt")
        return {name: getattr(self, name).tolist() for name in names} | {"rate": self._rate.tolist()}

    def restore(self, state):
        """Take up what ``state`` returned."""
        for name in ("low", "high", "middle", "tilt"):
            setattr(self, name, np.array(state[name], dtype=np.float64))
        self._rate = np.array(state["rate"], dtype=np.float64)

    def difference(self, a, b):
        """Minimum image of ``a - b`` for points inside the box, shape (..., 3) [length]."""
        d = np.array(a, dtype=np.float64) - b
        half = np.where(self.periodic, 0.5 * self.length, np.inf)
        for axis in (2, 1, 0):
            beyond, short = d[..., axis] > half[axis], d[..., axis] < -half[axis]
            d[..., axis] = d[..., axis] - self.length[axis] * beyond + self.length[axis] * short
            for (flow, along), tilt in zip(SHEARS, self.tilt):
                if along == axis and tilt != 0.0:
                    d[..., flow] = d[..., flow] - tilt * beyond + tilt * short
        return d

    def wrap(self, position):
        """Positions folded into the box along periodic directions, and the images they came from."""
        folded, turns = np.array(position, dtype=np.float64), np.zeros(np.shape(position))
        finite = np.isfinite(folded).all(axis=-1)  # what is not finite is refused later, as it was given
        for axis in (2, 1, 0):
            if self.periodic[axis]:
                x, low, high = folded[..., axis], self.low[axis], self.high[axis]
                turn = np.floor((x - low) / (high - low), where=finite, out=np.zeros_like(x))
                x = x - turn * (high - low)
                at_top = finite & (x >= high)
                folded[..., axis], turns[..., axis] = np.where(at_top | (finite & (x < low)), low, x), turn + at_top
                for (flow, along), tilt in zip(SHEARS, self.tilt):
                    if along == axis and tilt != 0.0:
                        folded[..., flow] -= turns[..., axis] * tilt
        return folded, turns.astype(np.int32)

    def unwrapped(self, position, image):
        """Places as if no face were periodic: of grains in the box that have crossed its faces ``image`` times, (..., 3)
        [length]."""
        there = position + image * np.where(self.periodic, self.length, 0.0)
        for (flow, along), tilt in zip(SHEARS, self.tilt):
            if tilt != 0.0:
                there[..., flow] += image[..., along] * tilt
        return there

    def outside(self, position):
        """True where a point lies outside the box along a direction that is not periodic (NaN counts as outside)."""
        inside = (position >= self.low) & (position <= self.high)
        return ~(inside | self.periodic).all(axis=-1) | ~np.isfinite(position).all(axis=-1)
