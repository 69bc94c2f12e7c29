"""Random places at which grains of any sizes overlap nobody: thrown in anywhere, then pushed apart."""

import warnings
from math import comb

import numpy as np

from barchan.domain import Box
from barchan.domain import numbers as as_numbers
from barchan.errors import RunError, SceneError
from barchan.forces import Damping
from barchan.laws import Property, law
from barchan.laws.vector import scale
from barchan.materials import Material
from barchan.measure import ContactStatistics
from barchan.measure.base import filled_volume
from barchan.packing.packing import Packing
from barchan.parallel.comm import Serial
from barchan.preflight import check_count
from barchan.simulation import Simulation
from barchan.walls import Plane
from barchan.words import shown

#: How much larger grains are while they are pushed apart, since the last overlaps fade away and never end; and up to which
#: overlap, relative to the smaller diameter, the true ones overlap neither each other nor a wall.
MARGIN, APART = 0.01, 0.0049

#: Stiffness of a contact relative to its effective mass, and what of a velocity is lost in each step: quick, far from unstable.
STIFFNESS, LOST = 0.1, 0.4

#: Steps between two looks.
LOOK = 20


@law(properties={"push": Property("1/time^2", above=True)})
def soft(overlap, normal, mass_eff, push):
    """A linear spring, without friction."""
    return push * mass_eff * overlap, scale(0.0, normal)


def scatter(box, radius, seed=0, most=20_000):
    """Throw grains into a box at random, and push them apart until none overlap. Periodic faces let them through, others keep
    them inside.

    It works up to solid fractions near that of the loosest packings, 0.5 for one size and more for several; ``compact`` and
    ``press`` make denser samples of it. Each process of several does all of it, for itself.

    Args:
        box: a ``Box``, of two dimensions, too: then they are pushed apart in the plane.
        radius: (n,) of the grains [length], such as ``Sieves(...).radii(seed, numpy.arange(n))``.
        seed: of the places, a whole number >= 0.
        most: it must be done after so many steps of pushing.

    Returns:
        A ``Packing``: the grains in the order of ``radius``.

    Raises:
        SceneError: an argument cannot be used.
        RunError: they still overlap.

    >>> import barchan as bc
    >>> found = scatter(bc.Box((0, 0, 0), (8, 8, 8), (True, True, True)), [1.0, 0.5] * 20)
    >>> sim = bc.Simulation(found.box, bc.laws.linear, bc.Material("m", density=1, kn=1, kt=1, friction=0), dt=0.1)
    >>> ids = sim.add_grains(found.position, found.radius); sim.prepare(); sim.touching
    0
    """
    radius = as_numbers("scatter: radius", radius, "length")
    check_count("scatter: seed", seed, least=0)
    check_count("scatter: most", most, least=1)
    if not isinstance(box, Box):
        raise SceneError(f"scatter: box = {shown(box)} must be a barchan.Box")
    if radius.ndim != 1 or not len(radius):
        raise SceneError(f"scatter: radius has shape {radius.shape}; give one number [length] for each grain, one at least")
    bad = np.flatnonzero(~(np.isfinite(radius) & (radius > 0.0)))
    if len(bad):
        raise SceneError(f"scatter: radius[{bad[0]}] = {radius[bad[0]]:g} [length] must be a finite number above 0")
    sim = _cloud(box, radius, np.random.default_rng(seed))
    while sim.step_number < most:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large overlaps: there are many at first
            sim.run(LOOK)
        overlap = ContactStatistics().compute(sim).largest_overlap
        if overlap <= APART:
            at_rest = np.zeros((len(radius), 3))
            return Packing(sim.grains.sorted_by_id("position"), radius, at_rest[:, 0].astype(np.int64), at_rest, box)
    filled = float(filled_volume(radius, box.dimension).sum() / np.prod(box.span))
    raise RunError(
        f"scatter: after {most} steps grains still overlap by up to {overlap:.2g} of the smaller diameter; their solid "
        f"fraction is {filled:.3g}. Take fewer, or a larger box, and compact the sample; or allow more steps"
    )


def _cloud(box, radius, random):
    """The grains at random places, soft, and the heavier the more of them overlap one of that size: so none is pushed too far."""
    dimension, closed = box.dimension, ~np.array(box.periodic) & (box.length > 0.0)
    room = np.where(closed, (1.0 + MARGIN) * radius[:, None], 0.0)
    if (box.length < 2.0 * room.max(axis=0)).any():
        raise SceneError(f"scatter: a grain of radius {radius.max():g} does not fit between the faces of the box")
    material = Material("soft", density=1.0, push=STIFFNESS)
    beyond = np.where(closed, 2.0 * radius.max(), 0.0)  # where grains may be pushed for a moment
    around = Box(*(part[:dimension] for part in (box.low - beyond, box.high + beyond, box.periodic)))
    sim = Simulation(around, soft, material, dt=1.0, comm=Serial())
    sim.max_overlap, sim.check_dt, sim.damping = np.inf, False, Damping(viscous=LOST)
    for axis in np.flatnonzero(closed):
        normal = np.eye(3)[axis]
        sim.add_wall(Plane(box.low, normal))
        sim.add_wall(Plane(box.high, -normal))
    sim.add_grains(box.low + room + random.random((len(radius), 3)) * (box.length - 2.0 * room), (1.0 + MARGIN) * radius)
    powers = [comb(dimension, k) * radius ** (dimension - k) * (radius**k).mean() for k in range(dimension + 1)]
    within = filled_volume(1.0, dimension) * sum(powers)  # where the centres of those lie that touch it, on average
    sim.grains.mass = 1.0 + 0.25 * len(radius) * within / np.prod(box.span)
    return sim
