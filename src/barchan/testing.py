"""Checks that any contact law should pass, yours too: ``check_law(my_law, my_material)``."""

import re
import tempfile
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import types
from numba.core.caching import NullCache

from barchan import preflight
from barchan.checkpoint import restore, save
from barchan.compare import differences, last_state
from barchan.domain import Box
from barchan.errors import LawError
from barchan.kernels.compiler import kernel
from barchan.kernels.generate import make_loops
from barchan.parallel import Serial
from barchan.simulation import Simulation


class Check(NamedTuple):
    """One check: its name, whether it passed, and what was measured against what is allowed."""

    name: str
    passed: bool
    detail: str


def check_law(law, material, radius=1.0):
    """Check a law on collisions of two grains.

    Args:
        law: a law.
        material: a ``Material`` with a density and all properties of the law.
        radius: of the grains [length].

    Returns:
        A list of ``Check``: zero at zero overlap, finite everywhere, symmetry, order in dt, energy, vectorised, resume.

    Raises:
        LawError: at least one check failed; the message names each.
        MaterialError: the material does not fit the law.
    """
    bench = _Bench(law, material, radius)
    checks = [check(bench) for check in (_zero, _finite, _symmetric, _order, _energy, _vectorised, _resumes)]
    failed = [f"{check.name}: {check.detail}" for check in checks if not check.passed]
    if failed:
        raise LawError(f"law '{law.name}' fails {len(failed)} check(s): " + "; ".join(failed))
    return checks


class _Bench:
    """Two grains that collide: the time scale and the speed at which they overlap by about 1 % of the radius."""

    def __init__(self, law, material, radius):
        self.law, self.material, self.radius = law, material, radius
        sim = self.collision(0.0, 1.0, 1.0)
        self.table = sim.materials.table(law)
        self.dt = 0.1 * preflight.stable_time_step(law, self.table, sim.grains, 1)
        self.speed = 2e-3 * radius * 0.017 / self.dt
        self.steps = 3000

    def collision(self, angle, speed, dt, swapped=False, ratio=1.5):
        """Two grains about to touch, one at rest; ``swapped`` exchanges their ids."""
        reach = self.radius * (1.0 + ratio)
        half = 20.0 * reach
        sim = Simulation(Box((-half,) * 3, (half,) * 3), self.law, self.material, dt, threads=1, comm=Serial())
        sim.check_dt = False
        heading = np.array([np.cos(angle), np.sin(angle), 0.0])
        grains = [
            (
                (-1.0001 * reach, 0.0, 0.0),
                self.radius,
                speed * heading,
                (0.3 * speed / self.radius, 0.0, 0.2 * speed / self.radius),
            ),
            ((0.0, 0.0, 0.0), self.radius * ratio, np.zeros(3), np.zeros(3)),
        ]
        for position, radius, velocity, omega in reversed(grains) if swapped else grains:
            sim.add_grains([position], radius, velocity=velocity, omega=omega)
        return sim

    def result(self, sim, steps):
        """Velocities and spins of the moving grain after ``steps``."""
        sim.run(steps)
        row = int(np.argmin(sim.grains.view("radius")))
        return np.concatenate([sim.grains.view("velocity")[row], self.radius * sim.grains.view("omega")[row]])

    def call(self, overlap, vn=0.0, vt=(0.0, 0.0, 0.0), memory=0.0):
        """The plain function on one contact; returns all numbers of its result."""
        mass = 4.0 / 3.0 * np.pi * self.radius**3 * self.material.density
        values = {
            "overlap": overlap,
            "distance": 2.0 * self.radius - overlap,
            "normal": (1.0, 0.0, 0.0),
            "normal_half": (1.0, 0.0, 0.0),
            "normal_velocity": vn,
            "tangential_velocity": vt,
            "slip_velocity_half": vt,
            "radius_first": self.radius,
            "radius_second": self.radius,
            "radius_eff": 0.5 * self.radius,
            "mass_eff": 0.5 * mass,
            "dt": self.dt,
        }
        values = {name: values[name] for name in self.law.quantities}
        values |= dict(zip(self.law.parameters, self.table[:, 0]))
        values |= {name: (0.0, memory, 0.0) if width == 3 else memory for name, width in self.law.history.items()}
        normal, tangential, *history = self.law(**values)
        flat = [x for item in history for x in (item if isinstance(item, tuple) else (item,))]
        return [normal, *tangential, *flat]


def _zero(bench):
    tiny, typical = (bench.call(depth * bench.radius)[0] for depth in (1e-12, 0.01))
    return Check(
        "zero at zero overlap", abs(tiny) <= 1e-4 * abs(typical), f"force {tiny:.3g} at 1e-12 R, {typical:.3g} at 0.01 R"
    )


def _finite(bench):
    speeds = (0.0, -1e3 * bench.speed, 1e3 * bench.speed)
    bad = [
        (d, vn, vt, m)
        for d in (1e-300, 1e-12, 0.01, 1.0)
        for vn in speeds
        for vt in speeds
        for m in (0.0, 1e-300, 1.0, -1e6)
        if not all(isfinite(x) for x in _quietly(bench, d * bench.radius, vn, (0.0, vt, 0.0), m))
    ]
    return Check(
        "finite everywhere", not bad, f"not finite at (overlap/R, v_n, v_t, memory) = {bad[0]}" if bad else "144 contacts"
    )


def _quietly(bench, *contact):
    try:
        return bench.call(*contact)
    except (ZeroDivisionError, ValueError, OverflowError):
        return [float("nan")]


def _symmetric(bench):
    one, other = (bench.result(bench.collision(0.6, bench.speed, bench.dt, swapped), bench.steps) for swapped in (False, True))
    apart = float(np.abs(one - other).max() / bench.speed)
    return Check("symmetry", apart < 1e-9, f"exchanging the ids changes the result by {apart:.2g} of the speed (allowed 1e-9)")


def _order(bench):
    results = [bench.result(bench.collision(0.6, bench.speed, bench.dt / f), bench.steps * f) for f in (1, 2, 4)]
    coarse, fine = (float(np.abs(results[k] - results[k + 1]).max() / bench.speed) for k in (0, 1))
    converges = fine <= 0.75 * coarse or coarse < 1e-6
    return Check("order in dt", converges, f"halving dt changes the result by {coarse:.2g}, then by {fine:.2g}")


def _energy(bench):
    worst = 0.0
    for angle in np.radians((0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)):
        sim = bench.collision(angle, bench.speed / np.cos(angle), bench.dt)
        before = _kinetic(sim)
        sim.run(bench.steps)
        worst = max(worst, _kinetic(sim) / before - 1.0)
    return Check("energy", worst < 1e-3, f"kinetic energy grows by at most {worst:.2g} over all impact angles (allowed 1e-3)")


def _kinetic(sim):
    grains = sim.grains
    return 0.5 * float(
        (grains.view("mass") * (grains.view("velocity") ** 2).sum(axis=1)).sum()
        + (grains.view("inertia") * (grains.view("omega") ** 2).sum(axis=1)).sum()
    )


def packed_square_roots(law, uniform=True):
    """Number of packed square roots in the machine code of the law's loop over pairs: 0 means that it is not vectorised."""
    loop = make_loops(law, uniform).pair_forces.py_func
    fresh = kernel(parallel=True)(loop)
    fresh._cache = NullCache()
    rows, table, index = types.Array(types.float64, 2, "C"), types.Array(types.float64, 1, "C"), types.Array(types.uint32, 1, "C")
    number = types.float64
    fresh.compile(
        (
            index,
            index,
            types.uint32,
            rows,
            rows,
            rows,
            index,
            types.uint32,
            rows,
            rows,
            rows,
            table,
            table,
            number,
            number,
            number,
        )
    )
    assembly = "".join(result.library.get_asm_str() for result in fresh.overloads.values())
    return len(re.findall(r"\bv?sqrtpd\b|\bfsqrt\s+v\d+\.2d", assembly))


def _vectorised(bench):
    count = packed_square_roots(bench.law)
    return Check("vectorised", count > 0, f"{count} packed square roots in the loop's machine code")


def _resumes(bench):
    whole, first, second = (bench.collision(0.6, bench.speed, bench.dt) for _ in range(3))
    half = bench.steps // 2
    whole.run(bench.steps)
    first.run(half)
    with tempfile.TemporaryDirectory() as folder:
        save(first, Path(folder) / "middle.h5")
        second.remove(second.grains.view("id").copy())
        restore(second, Path(folder) / "middle.h5")
        second.run(bench.steps - half)
        save(whole, Path(folder) / "whole.h5")
        save(second, Path(folder) / "resumed.h5")
        lines = differences(last_state(Path(folder) / "whole.h5"), last_state(Path(folder) / "resumed.h5"))
    return Check("resume", not lines, lines[0] if lines else "a stopped and resumed run has the same bits")
