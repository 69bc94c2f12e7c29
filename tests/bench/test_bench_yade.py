"""YADE beside barchan: grain by grain, and in a whole benchmark."""

import shutil

import pytest
from test_bench_lammps import bed, found, rows_of, short
from test_bench_liggghts import check_collisions, few, way

from barchan.bench import cases
from barchan.bench.observed import count_contacts, kinetic_energy
from barchan.bench.process import Code

pytestmark = pytest.mark.skipif(shutil.which("yade") is None, reason="YADE is not installed (Debian: apt install yade)")


def after(name, case, steps, folder):
    """What a code has after some steps."""
    case.save(folder)
    with Code(*found(name), folder) as code:
        code.ask("set_up", skin=0.1)
        code.ask("run", steps=steps, forced=False)
        return code.observe()


@pytest.mark.parametrize(("law", "gamma_n", "turned"), [("hooke", 20.0, 0.05), ("hertz", 0.0, 0.4)])
def test_collisions_are_the_same(law, gamma_n, turned, tmp_path):
    """Springs of both laws, Hooke's damping. While an overlap grows as time, Mindlin's spring, summed up, has two thirds of the
    force of one that is as stiff as it is now for the whole slip."""
    case = few(law, gamma_n)
    check_collisions(case, after("barchan-1", case, 50, tmp_path), after("yade", case, 50, tmp_path), turned)


@pytest.mark.parametrize(
    ("make", "closeness", "energy"),
    [(cases.small, 1e-2, 1e-3), (bed, 2.5e-2, 5e-3), (lambda journal: cases.gas(journal, count=2000), 1e-3, 1e-4)],
    ids=["small", "bed", "gas"],
)
def test_grains_go_about_the_same_way(make, closeness, energy, tmp_path):
    """After 50 steps; with Hooke's law more closely than with Hertz', whose damping is another."""
    case = make(None)
    start = {"position": case.grains.position}
    ours, theirs = (after(name, case, 50, tmp_path) for name in ("barchan-1", "yade"))
    assert way(case, ours, theirs) < closeness * way(case, ours, start)
    assert kinetic_energy(case, theirs) == pytest.approx(kinetic_energy(case, ours), rel=energy)
    assert count_contacts(case, theirs) == pytest.approx(count_contacts(case, ours), rel=0.002)
    assert not theirs["velocity"][case.grains.frozen].any()


def test_it_does_the_same_work_and_a_rebuild_is_forced():
    row = rows_of(short(bed(None)), ("barchan-1", "yade"))["yade"]
    assert row["same_work"] and row["rebuilds"] >= 5 and not row["same_law"] and row["memory_per_grain"] is not None, row
    assert row["version"].startswith("YADE 20")
    case = bed(None)._replace(steps=5, scan_steps=5, rounds=2, skins=(0.1,), forced=True)
    assert rows_of(case, ("barchan-1", "yade"))["yade"]["rebuilds"] == 5
