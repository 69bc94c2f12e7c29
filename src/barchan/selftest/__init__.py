"""Does barchan compute right on this machine? Short checks of the physics against closed forms, and of the bits.

Each check is a function without arguments that returns a ``Finding``; ``run`` shows them one after another.
"""

import time
import warnings
from functools import partial
from typing import NamedTuple

from barchan.kernels.compiler import default_threads
from barchan.laws import hertz_mindlin, silbert
from barchan.selftest import bits, physics
from barchan.selftest.finding import Finding
from barchan.warmup import compile_law


class Check(NamedTuple):
    """A check by name; ``function()`` returns a ``Finding``."""

    name: str
    function: object


def checks(threads=None):
    """All checks, in the order in which they run.

    Args:
        threads: how many to compare with one; default all of this process.
    """
    return [
        Check("restitution of a head-on impact", physics.restitution),
        Check("peak force of an elastic impact", physics.peak_force),
        Check("duration of an elastic impact", physics.duration),
        Check("energy in oblique impacts", physics.energy),
        Check("free fall", physics.free_fall),
        Check("sliding turns into rolling", physics.sliding_to_rolling),
        Check("momentum of a colliding cloud", physics.momentum),
        Check("neighbour list against all pairs", physics.neighbours),
        Check("forces of a cloud against NumPy", physics.forces),
        Check("bits: one thread and all threads", partial(bits.threads, threads or default_threads())),
        Check("bits: one rank and three", bits.ranks),
        Check("bits: stopped and resumed", bits.resumed),
        Check("bits: neighbours found every step", bits.rebuilds),
        Check("laws run in vector lanes", bits.vectorised),
    ]


def run(say, threads=None):
    """Run all checks.

    Args:
        say: function called with each line of text.
        threads: how many to compare with one; default all of this process.

    Returns:
        True if all passed.
    """
    begin = time.perf_counter()
    for law, scene in ((hertz_mindlin, physics.cloud), (silbert, bits.flow)):
        compile_law(law, scene(grains=0).materials.list, say)
    passed = []
    for check in checks(threads):
        finding, seconds = attempt(check)
        passed.append(finding.passed)
        verdict = "passed" if finding.passed else "FAILED"
        say(f"{check.name:<34} {finding.measured:<34} allowed {finding.allowed:<24} {verdict} {seconds:6.1f} s")
    say(f"{sum(passed)} of {len(passed)} checks passed in {time.perf_counter() - begin:.0f} s")
    return all(passed)


def attempt(check):
    """The finding of a check and the seconds it took; an error is a failure like any other."""
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            finding = check.function()
    except Exception as error:  # whatever it is, the other checks shall run
        finding = Finding(f"{type(error).__name__}: {' '.join(str(error).split())}", "no error", False)
    return finding, time.perf_counter() - begin
