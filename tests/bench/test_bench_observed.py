"""Contacts and energy counted from positions and velocities, against all pairs and against the engine."""

import numpy as np
import pytest

from barchan.bench.cases import dense, small
from barchan.bench.observed import count_contacts, kinetic_energy
from barchan.bench.peers.barchan import Engine
from barchan.measure import KineticEnergy


def all_pairs(case, position):
    """Contacts counted pair by pair."""
    grains, length = case.grains, np.subtract(case.high, case.low)
    apart = position[:, None] - position
    apart -= np.where(case.periodic, length * np.round(apart / length), 0.0)
    near = np.sqrt((apart**2).sum(axis=-1)) < grains.radius[:, None] + grains.radius
    near &= ~(grains.frozen[:, None] & grains.frozen)
    floor = 0 if case.floor is None else int((position[:, 2] - case.floor < grains.radius)[~grains.frozen].sum())
    return int(np.triu(near, 1).sum()) + floor


@pytest.mark.parametrize(
    ("periodic", "floor"), [((True, True, True), None), ((True, False, False), -0.4), ((False, True, False), -0.4)]
)
def test_every_contact_is_counted_once(periodic, floor):
    """300 grains of unequal size thrown into a box at random, some frozen; wherever a box is periodic, also beyond its faces."""
    rng = np.random.default_rng(5)
    case = small(None)._replace(low=(-1.0, 0.0, -0.5), high=(3.0, 4.5, 3.0), periodic=periodic, floor=floor)
    position = rng.uniform(case.low, case.high, (300, 3))
    grains = case.grains.take(rng.integers(0, 100, 300))._replace(frozen=rng.random(300) < 0.3)
    case = case._replace(grains=grains._replace(radius=rng.uniform(0.1, 0.55, 300)))
    expected = all_pairs(case, position)
    beyond = position + np.where(periodic, np.subtract(case.high, case.low), 0.0) * rng.integers(-2, 3, (300, 3))
    assert count_contacts(case, {"position": position}) == expected > 500
    assert count_contacts(case, {"position": beyond}) == expected


def test_engine_and_count_agree_on_the_dense_flow():
    case = dense(None)
    engine = Engine(1, None)
    engine.set_up(case, 0.1)
    seen = engine.observe()
    assert count_contacts(case, seen) == engine.sim.touching == 103_078
    energy = KineticEnergy().compute(engine.sim)
    assert kinetic_energy(case, seen) == pytest.approx(energy.translation + energy.rotation, rel=1e-12)
    assert np.allclose(seen["velocity"], case.grains.velocity, atol=1e-12), "given at the full step, and seen there"


def test_a_period_below_three_cells_is_refused():
    case = small(None)._replace(high=(2.5, 5, 60))
    with pytest.raises(ValueError, match="three diameters"):
        count_contacts(case, {"position": case.grains.position})
