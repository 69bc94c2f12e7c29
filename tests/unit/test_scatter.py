"""Grains thrown in at random and pushed apart: none overlap, all stay inside, the same for the same seed."""

import numpy as np
import pytest

import barchan as bc
from barchan.errors import RunError, SceneError
from barchan.packing import Uniform, scatter

PERIODIC, CLOSED = (True, True, True), (False, False, False)


def of_fraction(radius, fraction, periodic, shape=(1.0, 1.0, 1.0)):
    """A box in which grains have this solid fraction."""
    volume = (4.0 / 3.0 * np.pi * np.asarray(radius) ** 3).sum() / fraction
    low, edges = np.array([-1.0, 0.0, 2.0]), np.array(shape) * (volume / np.prod(shape)) ** (1.0 / 3.0)
    return bc.Box(low, low + edges, periodic)


def smallest_gap(packing):
    """Smallest distance of two surfaces, over the nearest image."""
    position, radius = packing.position, packing.radius
    smallest = np.inf
    for i in range(len(radius) - 1):
        away = np.linalg.norm(packing.box.difference(position[i + 1 :], position[i]), axis=1)
        smallest = min(smallest, (away - radius[i + 1 :] - radius[i]).min())
    return smallest


@pytest.mark.parametrize("periodic", [PERIODIC, CLOSED, (True, True, False)], ids=["periodic", "closed", "both"])
@pytest.mark.parametrize(
    ("radius", "fraction"),
    [
        (np.ones(500), 0.36),
        (Uniform(0.2, 2.0, by="mass").radii(3, np.arange(800)), 0.5),
        (np.repeat([1.0, 4.0], [1500, 4]), 0.45),
    ],
    ids=["one size", "ten to one", "few large ones"],
)
def test_no_grains_overlap_and_all_are_inside(radius, fraction, periodic):
    box = of_fraction(radius, fraction, periodic, (1.0, 1.1, 1.3))
    found = scatter(box, radius, seed=5)
    assert found.box is box and (found.radius == radius).all()
    assert smallest_gap(found) >= 0.0
    room = np.where(periodic, 0.0, radius[:, None])
    assert (found.position >= box.low + room).all() and (found.position <= box.high - room).all()
    assert np.abs((found.position - box.low).mean(axis=0) / box.length - 0.5).max() < 0.05, "they fill all of the box"


def test_the_seed_decides_all():
    box, radius = of_fraction(np.ones(100), 0.3, PERIODIC), np.ones(100)
    first, again, other = (scatter(box, radius, seed).position for seed in (1, 1, 2))
    assert (first == again).all() and (first != other).any(axis=1).all()


def test_too_many_grains_are_told_of():
    with pytest.raises(RunError, match=r"after 200 steps grains still overlap by up to .*solid fraction is 0\.8"):
        scatter(of_fraction(np.ones(100), 0.8, PERIODIC), np.ones(100), most=200)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"radius": [1.0, -1.0]}, r"radius\[1\] = -1 .*above 0"),
        ({"radius": []}, r"shape \(0,\)"),
        ({"radius": [1.0], "box": (10, 10, 10)}, "must be a barchan.Box"),
        ({"radius": [[1.0]]}, r"shape \(1, 1\)"),
        ({"radius": [1.0, np.nan]}, r"radius\[1\] = nan"),
        ({"radius": [6.0]}, "radius 6 does not fit"),
        ({"radius": [1.0], "seed": -1}, "seed"),
        ({"radius": [1.0], "most": 0}, "most"),
    ],
)
def test_bad_arguments_are_refused(arguments, told):
    with pytest.raises(SceneError, match=told):
        scatter(**({"box": bc.Box((0, 0, 0), (10, 10, 10))} | arguments))
