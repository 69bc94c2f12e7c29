"""Nothing is left over in the energy account of a dense state, by any law; its terms have the same bits however computed."""

import warnings

import pytest
import states

import barchan as bc
from barchan.checkpoint import Checkpoints, all_checkpoints, restore
from barchan.kernels import compiler
from barchan.measure import EnergyAccount
from barchan.parallel import virtual_ranks

LAWS = list(bc.laws.SHIPPED.values())
TERMS = ("kinetic", "elastic", "start", "gravity", "walls", "friction", "dashpots", "damping", "parting", "residual")


def account(sim):
    return sim.writers[0].compute(sim)


def busy(law, steps=200, dt=5e-4, **options):
    """A dense state with two materials, moving lid, frozen grains that stand, gravity and damping, after ``steps``."""
    sim = states.dense(law, **options)
    sim.dt, sim.gravity, sim.damping, sim.check_dt = dt, (0.4, 0.3, -1.0), bc.Damping(0.1, 0.5), False
    sim.writers.append(EnergyAccount())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(1 + steps)
    return sim


@pytest.mark.parametrize(
    "law",
    [pytest.param(law, marks=[] if law is bc.laws.linear else [pytest.mark.validate]) for law in LAWS],
    ids=lambda law: law.name,
)
def test_nothing_is_left_over_but_the_error_of_the_step(law):
    """At most 1e-3 of the largest term, at half of the largest step that is allowed; a quarter of it at half that step, or half
    where forces jump: as sticky contacts begin, or as a rotation turns round that a constant couple opposes. All terms count."""
    step, jumps = 3.4e-4, law.adhesive or law.name == "hertz_mindlin_constant_rolling"
    coarse, fine = (account(busy(law, 300 * f, step / f)) for f in (1, 2))
    assert abs(coarse.residual) < 1e-3 * coarse.largest
    assert abs(fine.residual) < (0.6 if jumps else 0.35) * abs(coarse.residual)
    for term in set(TERMS[:-2]) - ({"dashpots"} if law is bc.laws.shm else set()):
        assert abs(getattr(coarse, term)) > 2e-4 * coarse.largest, term
    assert coarse.friction > 0.0 and coarse.dashpots > -1e-9 and coarse.damping > 0.0


def terms(sim):
    return [getattr(account(sim), name) for name in TERMS]


def test_the_same_bits_on_threads_and_ranks(monkeypatch):
    monkeypatch.setattr(compiler, "GRAINS_PER_THREAD", 1)
    alone = terms(busy(bc.laws.hertz_mindlin_rolling, 60, threads=1))
    assert terms(busy(bc.laws.hertz_mindlin_rolling, 60, threads=2)) == alone
    for found in virtual_ranks(3, lambda: terms(busy(bc.laws.hertz_mindlin_rolling, 60))):
        assert found == alone


def test_a_resumed_account_has_the_same_bits(tmp_path):
    whole = busy(bc.laws.hertz_mindlin, 60, threads=1)
    sim = states.dense(bc.laws.hertz_mindlin, threads=1)
    sim.gravity, sim.damping = (0.4, 0.3, -1.0), bc.Damping(0.1, 0.5)
    sim.writers += [EnergyAccount(), Checkpoints(tmp_path, bc.Every(30))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(30)
        again = states.empty(bc.laws.hertz_mindlin, threads=1)
        again.gravity, again.damping = sim.gravity, sim.damping
        restore(again, all_checkpoints(tmp_path)[-1])
        again.writers.append(EnergyAccount())
        again.run(31)
    assert terms(again) == terms(whole)
