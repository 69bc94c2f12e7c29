"""Samples of grains of very different sizes: those of Stratford, Shire & Hanley (2018), and one that is flat.

Lengths are relative to the smallest radius (bidisperse samples) or diameter (all others). The paper's table of its sand says
"radius", its text "diameter"; with radii that many grains would not fit into the boxes of the table.
"""

from math import ceil
from typing import NamedTuple

import numpy as np

from barchan.bench import states
from barchan.bench.case import Case, Constants, Grains
from barchan.domain import Box
from barchan.packing import Sieves, Uniform, scatter

#: Grains that are pushed apart together, about: larger samples are periodic tiles of so many, side by side.
TILE = 200_000

#: Its material, and the speed of its grains along each axis: in the paper's 100 steps some cross half of its skin six times.
MATERIAL, DT, SPEED = Constants(kn=1000.0, kt=2.0 / 7.0 * 1000.0, gamma_n=5.0, gamma_t=2.5, friction=0.5), 2e-3, 2.0

#: The paper's skin, in the unit of length.
SKIN = 0.5


class Bidisperse(NamedTuple):
    """The paper's Table 1: radius and number of the large grains, number of the small ones (of radius 1), edge of the box."""

    ratio: float
    large: int
    small: int
    edge: float


BIDISPERSE = {
    10: Bidisperse(10.0, 250, 711_657, 205.9),
    20: Bidisperse(20.0, 111, 2_337_678, 314.15),
    40: Bidisperse(40.0, 56, 9_624_306, 500.14),
}

#: The paper's sand: how many grains, and the edge of the box, by ratio of the largest diameter to the smallest.
DUNKIRK = {10: (712_333, 205.9), 20: (2_336_380, 506.0), 40: (9_591_137, 1475.0)}

#: Its diameters [micrometres] and the fraction of grains below, from the words that describe the paper's Figure 6: a sharp peak
#: around 2.5, a broad one around 250 to 350, none below 2 or above 925. What share the broad peak has is not said: with 8 % the
#: boxes of the table are filled to 0.30, 0.39 and 0.46.
SAND = (
    (2.0, 2.2, 2.4, 2.6, 2.8, 3.2, 4.0, 60.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 500.0, 650.0, 925.0),
    (0.0, 0.08, 0.3, 0.62, 0.8, 0.88, 0.9, 0.92, 0.928, 0.936, 0.948, 0.964, 0.978, 0.987, 0.9955, 0.9993, 1.0),
)

#: The exponential sample: its grains, the edge of its box, its largest diameter, and over which the mass falls to 1/e. The paper
#: gives no scale; with 4 the box is filled to half.
EXPONENTIAL = (5_040_560, 368.77, 50.0, 4.0)


#: The flat sample: its grains, and the edge of its box, which they fill to 0.36.
FLAT = (500_000, 520.0)


def bidisperse(ratio, part=1):
    """A case of large grains among small ones, made by the paper's recipe: each relaxed by themselves, then put together, and
    small ones that overlap large ones taken away.

    Args:
        part: a box, and numbers, smaller by this factor.
    """
    wanted = BIDISPERSE[ratio]
    edge, n_large = wanted.edge / part ** (1.0 / 3.0), round(wanted.large / part)
    displaced = n_large * 4.0 / 3.0 * np.pi * (ratio + 1.0) ** 3 / edge**3
    n_small = round(wanted.small / part / (1.0 - displaced))

    def make(journal):
        box = Box((0,) * 3, (edge,) * 3, (True,) * 3)
        large = scatter(box, np.full(n_large, wanted.ratio), seed=1).position
        small, _ = _tiled(n_small, edge, lambda count: np.ones(count))
        free = np.ones(len(small), dtype=bool)
        for centre in large:
            free &= (box.difference(small, centre) ** 2).sum(axis=1) >= (wanted.ratio + 1.0) ** 2
        small = small[free]
        radius = np.concatenate([np.ones(len(small)), np.full(n_large, wanted.ratio)])
        return {"position": np.concatenate([small, large]), "radius": radius}

    title = f"Large grains among small ones, ratio {ratio}: the paper's Table 1."
    return _case(f"bidisperse-{ratio}", title, make, edge, part, [(ratio**0.5,)], (0.5, 1.0, 1.5, 2.0, 4.0))


def dunkirk(ratio, part=1):
    """A case of the paper's Dunkirk sand, its diameters scaled linearly to 1 to ``ratio``."""
    count, edge = DUNKIRK[ratio]
    sizes = 1.0 + (np.array(SAND[0]) - 2.0) * (ratio - 1.0) / 923.0
    sieves = Sieves(sizes, SAND[1], by="number")
    ends = [(0.5 * ratio * share,) for share in (0.08, 0.15, 0.3, 0.4, 0.5, 0.7)]  # of the largest diameter
    title = f"Dunkirk sand, scaled to diameters from 1 to {ratio}."
    return _sized(f"dunkirk-{ratio}", title, count, edge, lambda n: sieves.radii(1, np.arange(n)), part, ends)


def exponential_radii(count):
    """Radii of grains whose mass falls exponentially with the diameter; the largest of them is 50 times the smallest there is."""
    *_, largest, scale = EXPONENTIAL
    sizes = np.geomspace(1.0, largest, 200)
    passing = -np.expm1(-(sizes - 1.0) / scale)
    radius = Sieves(sizes, passing / passing[-1]).radii(1, np.arange(count))
    radius[np.argmax(radius)] = 0.5 * largest
    return radius


def exponential():
    """A case of such grains: one of the largest in each tile."""
    count, edge, *_ = EXPONENTIAL
    title = "Mass that falls exponentially with the diameter, from 1 to 50."
    ends = [
        (2.5,),
        (2.0,),
        (3.2,),
        (4.0,),
        (1.5, 5.0),
        (2.0, 6.0),
        (1.7, 3.5, 7.4),
    ]  # outside, two classes take ten times as long
    return _sized("exponential-50", title, count, edge, exponential_radii, 1, ends)


def flat():
    """A case of the same mass at every diameter from 1 to 100: the widest and flattest distribution there is."""
    sizes = Uniform(1.0, 100.0, by="mass")
    title = "The same mass at every diameter from 1 to 100."
    ends = [
        (2.0,),
        (4.0,),
        (6.0,),
        (8.0,),
        (12.0,),
        (2.5, 12.0),
        (5.0, 17.0),
        (2.0, 6.0, 18.0),
        (5.0, 11.0, 24.0),
        (2.0, 5.0, 11.0, 24.0),
    ]
    return _sized("flat-100", title, *FLAT, lambda n: sizes.radii(1, np.arange(n)), 1, ends)


def _sized(name, title, count, edge, radii, part, ends):
    """A case of grains of which a function of their number gives the radii."""
    edge, count = edge / part ** (1.0 / 3.0), round(count / part)

    def make(journal):
        position, radius = _tiled(count, edge, radii)
        return {"position": position, "radius": radius}

    return _case(name, title, make, edge, part, ends)


def _tiled(count, edge, radii):
    """Grains that overlap nobody in a periodic cube: positions (count, 3) and radii (count,). If they are many they repeat."""
    copies = ceil((count / TILE) ** (1.0 / 3.0) - 0.3)
    number, length = ceil(count / copies**3), edge / copies
    tile = scatter(Box((0,) * 3, (length,) * 3, (True,) * 3), radii(number), seed=2)
    corners = length * np.stack(np.meshgrid(*3 * [np.arange(copies)], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    return (corners + tile.position).reshape(-1, 3)[:count], np.tile(tile.radius, copies**3)[:count]


def _case(name, title, make, edge, part, ends, cells=(1.0, 2.0)):
    """The function of a journal that gives the case."""
    label = name if part == 1 else f"{name}-{part}th"

    def case(journal):
        state = states.kept(label, make, journal)
        count, random = len(state["radius"]), np.random.default_rng(3)
        order = random.permutation(count)  # no code shall profit from how they were made
        still = np.zeros((count, 3))
        velocity = random.normal(scale=SPEED, size=(count, 3)) / np.maximum(state["radius"], 1.0)[:, None]
        columns = state["position"], state["radius"], np.ones(count), velocity, still, np.zeros(count, dtype=bool)
        grains = Grains(*columns).take(order)
        skin = SKIN / (2.0 * float(grains.radius.max()))
        return Case(
            name,
            title,
            grains,
            (0,) * 3,
            (edge,) * 3,
            (True,) * 3,
            "hooke",
            MATERIAL,
            DT,
            steps=5,
            scan_steps=2,
            rounds=5,
            skins=(skin,),
            forced=True,
            ends=tuple(ends),
            cells=cells,
        )

    return case
