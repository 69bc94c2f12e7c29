"""The self-test passes here, and each of its checks goes red when what it checks is broken."""

import re

import numba
import numpy as np
import pytest

import barchan as bc
from barchan import selftest, simulation
from barchan.assembly import Assembly
from barchan.laws.law import Law
from barchan.neighbors.contacts import Contacts
from barchan.parallel.ghosts import Ghosts
from barchan.selftest import bits, physics


def wrong_law(patch, name, value):
    """Give ``hertz_mindlin`` a wrong pair parameter; its loop stays the same, so nothing is compiled for it."""
    right = bc.laws.hertz_mindlin
    mix = lambda first, second: {**right.mix(first, second), name: value(right.mix(first, second)[name])}  # noqa: E731
    patch.setattr(physics, "hertz_mindlin", Law(right.function, right.properties, right.history, right.lever, mix))


def wrong_arguments(patch, owner, name, change):
    """Let a function or method be called with arguments changed by ``change(list)``."""
    right = getattr(owner, name)
    patch.setattr(owner, name, lambda *arguments: right(*change(list(arguments))))


def wrong_clock(patch):
    wrong_arguments(patch, simulation.integrate, "kick_drift_wrap", lambda a: [*a[:-1], a[-1] * (1.0 + 1e-9)])
    patch.setattr(simulation.stepping, "steps_ahead", lambda sim, end: 0)  # where that call is made


def wrong_inertia(patch):
    right = Assembly._shaped

    def shell(*arguments):
        values = right(*arguments)
        return values | {"inertia": values["inertia"] * 5.0 / 3.0}

    patch.setattr(Assembly, "_shaped", shell)


def wrong_sum(patch, size, only_on_threads=False):
    """Change the first grain's force after its contacts have been added up."""
    right = Contacts.gather

    def gather(contacts, grains, gravity):
        result = right(contacts, grains, gravity)
        if not only_on_threads or numba.get_num_threads() > 1:
            grains.view("force")[:1] *= 1.0 + size
        return result

    patch.setattr(Contacts, "gather", gather)


def forgotten_memory(rows):
    return rows._replace(values=np.zeros_like(rows.values))


#: Name of a check -> how to break what it checks.
BROKEN = {
    "restitution of a head-on impact": lambda patch: wrong_law(patch, "alpha", lambda alpha: 1.01 * alpha),
    "peak force of an elastic impact": lambda patch: wrong_law(patch, "E_eff", lambda modulus: 1.01 * modulus),
    "duration of an elastic impact": lambda patch: wrong_law(patch, "E_eff", lambda modulus: 1.01 * modulus),
    "energy in oblique impacts": lambda patch: wrong_law(patch, "alpha", lambda alpha: -1e-4),
    "free fall": wrong_clock,
    "sliding turns into rolling": wrong_inertia,
    "momentum of a colliding cloud": lambda patch: wrong_sum(patch, 1e-9),
    "neighbour list against all pairs": lambda patch: wrong_arguments(patch, Contacts, "find", lambda a: [*a[:-2], -0.01, a[-1]]),
    "forces of a cloud against NumPy": lambda patch: wrong_law(patch, "E_eff", lambda modulus: (1.0 + 1e-9) * modulus),
    "bits: one thread and all threads": lambda patch: wrong_sum(patch, 1e-15, only_on_threads=True),
    "bits: one rank and three": lambda patch: patch.setattr(Ghosts, "start_update", lambda *arguments: None),
    "bits: stopped and resumed": lambda patch: wrong_arguments(
        patch, bc.Simulation, "load", lambda a: [a[0], a[1]._replace(contacts=forgotten_memory(a[1].contacts))]
    ),
    "bits: neighbours found every step": lambda patch: wrong_arguments(
        patch, Contacts, "carry_over", lambda a: [a[0], a[1]._replace(n_pairs=0, count=0, begin=0 * a[1].begin), *a[2:]]
    ),
    "laws run in vector lanes": lambda patch: patch.setattr(bits, "packed_square_roots", lambda law: 0),
}


@pytest.mark.validate
def test_all_pass_and_each_has_a_line():
    """That all pass the page on the command sees, too: it is run by the tests of the pages."""
    lines = []
    assert selftest.run(lines.append, threads=2)
    for check in selftest.checks():
        (line,) = [line for line in lines if line.startswith(check.name)]
        assert re.search(r"allowed .+ passed +\d+\.\d s$", line), line
    assert re.match(rf"{len(BROKEN)} of {len(BROKEN)} checks passed in \d+ s", lines[-1])


@pytest.mark.parametrize("check", selftest.checks(threads=2), ids=lambda check: check.name)
def test_a_check_goes_red_when_what_it_checks_is_broken(check, monkeypatch):
    BROKEN[check.name](monkeypatch)
    finding, _ = selftest.attempt(check)
    assert not finding.passed
    assert "Error" not in finding.measured, "it measures the fault, it does not stumble over it"


def test_one_failure_or_error_fails_the_whole_and_the_others_run_on(monkeypatch):
    def stumbles():
        raise ValueError("first line\nsecond line")

    names = ("free fall", "forces of a cloud against NumPy")
    few = [check for check in selftest.checks() if check.name in names] + [selftest.Check("odd", stumbles)]
    monkeypatch.setattr(selftest, "checks", lambda threads: few)
    wrong_clock(monkeypatch)
    lines = []
    assert not selftest.run(lines.append)
    assert ["FAILED" in line for line in lines[-4:-1]] == [True, False, True]
    assert "ValueError: first line second line" in lines[-2]
    assert lines[-1].startswith("1 of 3 checks passed")
