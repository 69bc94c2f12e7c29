"""What a step takes in a compressed sample of few very large grains among fines, beside its fines alone: the same solid fraction,
stiffness and time step. A large grain has thousands of contacts, which must cost no more than as many contacts of others."""

import warnings
from time import process_time

import numpy as np
import pytest

import barchan as bc
from barchan.packing import Preparation, compact, scatter

#: Of the fines, in the volume that large grains leave.
SOLID_FRACTION = 0.62

#: Steps of one timing, and pairs of timings: of the processor's time, since others may use it, too.
STEPS, PAIRS = 10, 15

#: Largest ratio of the times for each grain that is accepted; what is aimed at is 1.05.
ACCEPTED = 1.2

#: Standard deviation of velocities along an axis with which samples are shaken: 2 to 4 in 10,000 contacts begin or end in a step.
SHAKEN = 0.05


def compressed(ratio, edge, with_large):
    """Fines of radius 1 in a periodic cube, thrown in at a solid fraction of 0.42; with two large ones of radius ``ratio`` as
    far from each other as can be, in the place of the fines there. Then all grow, until the fines fill what is left to
    ``SOLID_FRACTION``."""
    box = bc.Box((0,) * 3, (edge,) * 3, (True,) * 3)
    position = scatter(box, np.ones(int(0.42 * edge**3 / (4.0 / 3.0 * np.pi))), seed=1).position
    large = edge * np.array([[0.25] * 3, [0.75] * 3])[: 2 * with_large]
    for centre in large:
        position = position[(box.difference(position, centre) ** 2).sum(axis=1) > (ratio + 1.0) ** 2]
    radius = np.repeat([ratio, 1.0], [len(large), len(position)])
    material = bc.Material("grain", density=1.0, kn=1e4, kt=2857.0, gamma_n=5.0, gamma_t=0.0, friction=0.3)
    sim = bc.Simulation(box, bc.laws.linear, material, dt=0.002, threads=1)
    sim.add_grains(np.concatenate([large, position]), radius)
    sim.max_overlap = 1.0
    volume = np.array([len(large) * ratio**3, len(position)]) * 4.0 / 3.0 * np.pi
    large, fine = volume / np.prod(box.length)
    grown = SOLID_FRACTION / (fine + SOLID_FRACTION * large)  # each volume, so that the fines fill what is left
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of large overlaps: grains are soft, and pressed together
        compact(sim, grown * (large + fine), "growth", Preparation(rest=0.5, look=100), steps=1500)
    return sim


def fines(sim):
    """Rows of the fines, and their solid fraction in what the large ones leave [1]."""
    radius = sim.grains.view("radius")
    few, volume = radius > 1.5 * radius.min(), radius**3 * 4.0 / 3.0 * np.pi
    return ~few, volume[~few].sum() / (np.prod(sim.box.length) - volume[few].sum())


def times(sims):
    """Nanoseconds of a step for each grain without and of a rebuild, (PAIRS, 2) each, of two samples in turns; and where the time
    of a step goes, name -> nanoseconds for each grain, of both."""
    steps, rebuilds, profile = np.empty((PAIRS, 2)), np.empty((PAIRS, 2)), []
    for number in range(PAIRS):
        for which, sim in enumerate(sims):
            sim.rebuild()
            sim.run(1)
            steps[number, which] = _nanoseconds(sim, lambda sim: sim.run(STEPS), STEPS)
            rebuilds[number, which] = _nanoseconds(sim, lambda sim: sim.rebuild(), 1)
            sim.run(1)
    for sim in sims:
        sim.clock.seconds.clear()
        sim.clock.by_phase = True
        sim.run(STEPS)
        sim.clock.by_phase = False
        profile.append({name: 1e9 * seconds / STEPS / sim.grains.n for name, seconds in sim.clock.seconds.items()})
    return steps, rebuilds, profile


def _nanoseconds(sim, act, count):
    before = sim.staleness.rebuilds
    began = process_time()
    act(sim)
    took = process_time() - began
    assert sim.staleness.rebuilds - before in (0, 1)
    return 1e9 * took / count / sim.grains.n


def shake(sim):
    """Give grains random velocities, the large ones less."""
    radius = sim.grains.view("radius")
    speed = SHAKEN * (radius.min() / radius[:, None]) ** 1.5
    sim.grains.velocity = speed * np.random.default_rng(2).normal(size=(len(radius), 3))
    sim.run(5)


def contacts_of_fines(sim):
    """Contacts of a fine grain, on average."""
    few, _ = fines(sim)
    return sim.contacts.touched[few].mean()


def test_fines_beside_large_grains_are_as_dense_as_alone_and_touch_as_many():
    """So the two samples that are timed differ by their large grains only."""
    sims = [compressed(5.0, 27.5, with_large) for with_large in (True, False)]
    for sim in sims:
        assert fines(sim)[1] == pytest.approx(SOLID_FRACTION, rel=1e-9)
    among, alone = map(contacts_of_fines, sims)
    assert among == pytest.approx(alone, rel=0.05) and alone > 5.0
    large = ~fines(sims[0])[0]
    assert large.sum() == 2 and sims[0].contacts.touched[large].min() > 60


def measure(sims):
    """Print what steps and rebuilds take, at rest and shaken, of a sample and of its fines alone; return the medians of the
    ratios of steps."""
    found = []
    for sim in sims:
        most = int(sim.contacts.touched.max())
        print(f"\n{sim.grains.n:,} grains, {contacts_of_fines(sim):.2f} contacts of a fine grain, most of one grain {most:,}")
    for state in ("at rest", "shaken"):
        steps, rebuilds, profile = times(sims)
        for what, spent in (("a step", steps), ("a rebuild", rebuilds)):
            ratios = spent[:, 0] / spent[:, 1]
            print(
                f"{state}, {what}: {np.median(spent[:, 0]):.1f} ns a grain, fines alone {np.median(spent[:, 1]):.1f}, "
                f"ratio {np.median(ratios):.3f} ({ratios.min():.3f}-{ratios.max():.3f})"
            )
        for one in profile:
            print("  " + ", ".join(f"{name} {spent:.1f}" for name, spent in one.items()))
        found.append(float(np.median(steps[:, 0] / steps[:, 1])))
        for sim in sims:
            shake(sim)
    return found


@pytest.mark.validate
@pytest.mark.parametrize("ratio", [20.0, 40.0])
def test_a_step_takes_each_grain_as_long_as_among_fines_alone(ratio):
    """In cubes of little more than the four radii that a period must have: 78,000 and 625,000 grains."""
    sims = [compressed(ratio, 4.6 * ratio, with_large) for with_large in (True, False)]
    assert max(measure(sims)) <= ACCEPTED
