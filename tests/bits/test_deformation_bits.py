"""A box that is stretched or sheared gives the same bits on any number of threads and ranks, over rebuilds, sharing of space anew
and a stop: with servos, with walls, with bonds that break, with grains of several sizes."""

import warnings

import numpy as np
import pytest

import barchan as bc
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.kernels import compiler
from barchan.packing import scatter
from barchan.parallel import virtual_ranks

STEPS, EDGE = 200, 4.0
GRAIN = bc.Material("grain", density=1.0, kn=1e3, kt=4e2, gamma_n=3.0, gamma_t=1.0, friction=0.5)
GLUE = bc.Bond(bc.laws.parallel_bond, "glue", kn=1e3, ks=5e2, tensile_strength=60.0, shear_strength=60.0)


@pytest.fixture(autouse=True)
def threads_even_for_few_grains(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)


def scene(around, threads=1, with_grains=True):
    """A crowd of two sizes, of which some are bonded; ``around``: "periodic" on all sides, or "between walls", a floor and a lid,
    or "sheared" until the images are set back by a period, with one edge stretched."""
    sheared, around = around == "sheared", around != "between walls"
    box = bc.Box((0.0,) * 3, (EDGE,) * 3, (True, True, around))
    sim = bc.Simulation(box, bc.laws.linear, GRAIN, 1e-3, (0.0, 0.0, -1.0), threads, bonds=GLUE)
    sim.max_overlap, sim.check_dt, sim.size_classes.separators = np.inf, False, (0.2,)
    one = bc.StressServo(lambda sim: 10.0 + 100.0 * sim.time, max_rate=0.5)
    sim.deformation = bc.Deformation(one, one, bc.StressServo(15.0, max_rate=0.4)) if around else bc.Deformation(one, y=-0.3)
    if sheared:
        sim.deformation = bc.Deformation(one, -0.1, one, xz=3.0)
    if not around:
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
        sim.add_wall(bc.Plane((0, 0, EDGE), (0, 0, -1), velocity=(0.5, 0.0, -0.2)))
    if with_grains:
        random = np.random.default_rng(8)
        radius = np.where(np.arange(900) < 32, 0.5, random.uniform(0.14, 0.18, 900))
        position = scatter(
            bc.Box((0.0,) * 3, (EDGE, EDGE, EDGE if around else 0.99 * EDGE), box.periodic), radius, seed=1
        ).position
        sim.add_grains(position, radius, velocity=random.normal(scale=0.5, size=(900, 3)))
        sim.install_bonds(-0.02, among=np.arange(0, 900, 2))
    return sim


def final_state(around, threads=1, also_when=None, shared_anew="it pays", stop=None, path=None):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = scene(around, threads)
        sim.staleness.also_when, sim.balance.when = also_when, shared_anew
        if stop is not None:
            sim.run(stop)
            save(sim, path)
            sim = scene(around, threads, with_grains=False)
            restore(sim, path)
        sim.run(STEPS - sim.step_number)
    return collect(sim)


@pytest.fixture(scope="module", params=["periodic", "between walls", "sheared"])
def plain(request):
    return request.param, final_state(request.param)


def test_the_state_is_worth_testing(plain):
    """Much touches, bonds broke and hold, grains went round, and the box is another one."""
    around, state = plain
    assert len(state.contacts.keys) > 500 and len(state.cracks) > 10 and len(state.bonds.keys) > 10
    assert state.fields["image"].any()
    stretched = state.about["stretched"]
    assert np.abs(np.diff([stretched["low"], stretched["high"]], axis=0)[0, :2] / EDGE - 1.0).min() > 0.005
    assert (stretched["tilt"][1] < -1.0) == (around == "sheared"), "set back by a period"


@pytest.mark.parametrize(
    ("ranks", "options"),
    [
        (1, {"threads": 2}),
        (1, {"also_when": lambda step: True}),
        (2, {}),
        (3, {"also_when": lambda step: step % 3 == 0, "shared_anew": lambda step: step % 20 == 0}),
    ],
    ids=["threads", "rebuilds", "two ranks", "three ranks, space shared anew"],
)
def test_the_same_bits(plain, ranks, options):
    around, expected = plain
    for state in virtual_ranks(ranks, lambda: final_state(around, **options)):
        assert not differences(expected, state)


@pytest.mark.parametrize(("ranks", "stop"), [(1, 77), (2, 130)])
def test_a_stop_changes_no_bit(plain, tmp_path, ranks, stop):
    """Between two looks of the servos, too."""
    around, expected = plain
    for state in virtual_ranks(ranks, lambda: final_state(around, stop=stop, path=tmp_path / "stop.h5")):
        assert not differences(expected, state)
