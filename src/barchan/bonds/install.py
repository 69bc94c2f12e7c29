"""Where bonds are put: on contacts, or between grains that are near."""

from math import gamma

import numpy as np

from barchan.chance import uniform_of_pairs
from barchan.errors import SceneError
from barchan.parallel.guard import raise_together
from barchan.words import shown


class Weibull:
    """Strengths that follow Weibull's distribution with mean 1, each by the ids of its grains: the same for any number of ranks.

    Args:
        modulus: shape, at least 0.1: the larger, the narrower; 1 / modulus is about the coefficient of variation times 0.8.
        seed: whole number from 0 to below 2^64.

    Raises:
        SceneError: a number is out of range.

    >>> strength = Weibull(5.0, seed=1)(np.arange(1000), np.arange(1000) + 1)
    >>> bool(abs(strength.mean() - 1.0) < 0.03)
    True
    """

    def __init__(self, modulus, seed=0):
        number = isinstance(modulus, (int, float)) and not isinstance(modulus, bool)
        if not (number and np.isfinite(modulus) and modulus >= 0.1):
            raise SceneError(f"Weibull: modulus = {shown(modulus)} must be a finite number >= 0.1")
        if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or not 0 <= seed < 2**64:
            raise SceneError(f"Weibull: seed = {shown(seed)} must be a whole number from 0 to below 2^64")
        self.modulus, self.seed = float(modulus), int(seed)

    def __call__(self, first, second):
        """Strengths (k,) of bonds by the ids (k,) of their grains."""
        drawn = uniform_of_pairs(self.seed, first, second)
        return (-np.log1p(-drawn)) ** (1.0 / self.modulus) / gamma(1.0 + 1.0 / self.modulus)


def install(sim, overlap=0.0, among=None, kind=0, strength=1.0):
    """What ``Simulation.install_bonds`` does; ``among`` holds the ids of all ranks' grains."""
    bonds, number = sim.bonds, _number_of(sim.bonds, kind)
    across = np.linalg.norm(sim.box.length)
    if not isinstance(overlap, (int, float, np.number)) or isinstance(overlap, bool) or not abs(overlap) <= across:
        raise SceneError(
            f"install_bonds: overlap = {shown(overlap)} [length] must be a number, no larger than the box is across, {across:g}"
        )
    first, second, owners = _near(sim, overlap)
    ids = sim.grains.view("id", ghosts=True)
    pairs = np.stack([ids[first], ids[second]], axis=1)
    chosen = ~_known(pairs, bonds.ids[bonds.holding])
    if among is not None:
        chosen &= np.isin(pairs, among).all(axis=1)
    pairs, owners = pairs[chosen], owners[chosen]
    values = np.zeros((len(pairs), 2 + bonds.width))
    values[:, 0], values[:, 1] = number, _strengths(sim.comm, strength, pairs)
    count = int(sim.comm.sum([np.count_nonzero(owners[:, 0] == sim.comm.rank)])[0])
    if count:
        bonds.forget_broken()
        bonds.add(pairs, owners, values)
        bonds.settle(sim.grains)
        bonds.active = True
    return count


def _number_of(bonds, kind):
    names = [one.name for one in bonds.kinds]
    if isinstance(kind, str) and kind in names:
        return names.index(kind)
    if isinstance(kind, (int, np.integer)) and not isinstance(kind, bool) and 0 <= kind < len(names):
        return int(kind)
    there = f"there are: {', '.join(names)}" if names else "give the simulation some: Simulation(..., bonds=barchan.Bond(...))"
    raise SceneError(f"install_bonds: no kind of bond {shown(kind)} in this scene; {there}")


def _near(sim, overlap):
    """Rows of the listed pairs that overlap by more than ``overlap``, (k,) each, and who owns them, (k, 2)."""
    skin, needed = sim.skin, -overlap * (1.0 + 1e-9)
    sim.prepare()
    if needed > 0.0:
        sim.begin_change()  # the list of now, and as wide
        sim.skin = max(needed, sim.list_skin)
        try:
            sim.prepare()
        finally:
            sim.skin = skin
    grains, contacts = sim.grains, sim.contacts
    position, radius = (grains.view(name, ghosts=True) for name in ("position", "radius"))
    first, second = contacts.first, contacts.second
    branch = sim.box.difference(position[first], position[second])
    near = radius[first] + radius[second] - np.sqrt((branch * branch).sum(axis=1)) > overlap
    owner = np.concatenate([np.full(grains.n, sim.comm.rank, dtype=np.int32), sim.ghosts.owners()])
    found = first[near].copy(), second[near].copy()
    return *found, np.stack([owner[rows] for rows in found], axis=1)


def _known(pairs, known):
    """(k,) bool: which pairs are among others."""
    if not len(known):
        return np.zeros(len(pairs), dtype=bool)
    both = np.concatenate([known, pairs])
    _, number = np.unique(both, axis=0, return_inverse=True)
    return np.isin(number.ravel()[len(known) :], number.ravel()[: len(known)])


def _strengths(comm, strength, pairs):
    """Strength of each of the pairs of ids; of several ranks, one alone may see what is wrong."""
    if not callable(strength):
        numbers = _numbers(strength, 1)
        error = None if np.ndim(strength) == 0 and _sound(numbers) else _wrong(strength)
        raise_together(comm, error)
        return np.broadcast_to(numbers, len(pairs))
    given = [strength(pairs[:, 0], pairs[:, 1]) if len(pairs) else () for _ in range(2)]
    numbers, again = (_numbers(values, len(pairs)) for values in given)
    error = None if _sound(numbers) else _wrong(given[0])
    if error is None and not np.array_equal(numbers, again):
        error = SceneError(
            "install_bonds: strength() returned other numbers when it was asked once more; both ranks that share a bond ask for "
            "it, so it must follow from the ids alone. For random strengths take barchan.bonds.Weibull, or draw them once by id"
        )
    raise_together(comm, error)
    return numbers


def _numbers(values, count):
    """Numbers for so many bonds, NaN if they are none."""
    try:
        return np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), count))
    except (ValueError, TypeError):
        return np.full(max(count, 1), np.nan)


def _sound(numbers):
    return bool((np.isfinite(numbers) & (numbers > 0.0)).all())


def _wrong(given):
    return SceneError(
        f"install_bonds: strength = {shown(given)} must be a finite number > 0, or a function of the ids of both grains that "
        f"returns one for each bond"
    )
