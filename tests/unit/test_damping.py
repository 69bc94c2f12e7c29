"""Damping as a setting: what is refused, and that checkpoints keep it."""

import pytest
from scenes import fingerprint, pile, simulation

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.errors import SceneError


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (0.7, "damping = 0.7 must be a barchan.Damping"),
        (bc.Damping(local=1.0), r"damping: local = 1.0 \[1\] must be a number from 0 to below 1"),
        (bc.Damping(local=-0.1), "damping: local = -0.1"),
        (bc.Damping(local=float("nan")), "damping: local = nan"),
        (bc.Damping(viscous=True), r"damping: viscous = True \[1/time\]"),
        (bc.Damping(viscous=1000.0), r"damping: viscous = 1000.0 \[1/time\] must be a number from 0 to below 1/dt = 1000"),
        (bc.Damping(viscous="much"), "damping: viscous = 'much'"),
    ],
)
def test_what_means_nothing_is_refused_before_the_start(given, message):
    sim = simulation(dt=1e-3)
    sim.add_grains([(5, 5, 5)], 0.5)
    sim.damping = given
    with pytest.raises(SceneError, match=message):
        sim.run(1)


def test_a_checkpoint_keeps_it(tmp_path):
    whole = pile()
    whole.damping = bc.Damping(local=0.3, viscous=2)
    whole.run(20)
    save(whole, tmp_path / "c.h5")
    resumed = pile(count=0)
    restore(resumed, tmp_path / "c.h5")
    assert resumed.damping == bc.Damping(0.3, 2.0)
    for sim in (whole, resumed):
        sim.run(30)
    assert fingerprint(whole) == fingerprint(resumed)


def test_it_can_be_switched_off_between_runs():
    plain, switched = pile(), pile()
    switched.damping = bc.Damping()
    for sim in (plain, switched):
        sim.run(20)
    assert fingerprint(plain) == fingerprint(switched)
    switched.damping = bc.Damping(local=0.5)
    for sim in (plain, switched):
        sim.run(20)
    assert fingerprint(plain) != fingerprint(switched)
