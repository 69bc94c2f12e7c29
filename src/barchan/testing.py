"""Checks that any contact law should pass, yours too: ``check_law(my_law, my_material)``."""

import math
import re
import tempfile
import warnings
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import typeof, types
from numba.core.caching import NullCache

from barchan import preflight
from barchan.checkpoint import restore, save
from barchan.compare import differences, last_state
from barchan.domain import Box
from barchan.errors import BarchanError, LawError, SceneError
from barchan.kernels.compiler import kernel, on_one_thread
from barchan.kernels.generate import make_loops
from barchan.kernels.template import block_rooms
from barchan.parallel import Serial
from barchan.simulation import Simulation

#: Rows: three orthogonal unit vectors aligned with no axis, left-handed: a collision seen through it is turned and mirrored.
_MIRROR = np.array([[2.0, 3.0, 6.0], [-6.0, -2.0, 3.0], [-3.0, 6.0, -2.0]]) / 7.0

_DIAGONAL = (1.0 / math.sqrt(3.0),) * 3  # its square is 1 + 2e-16: a law that takes acos of it must notice
_ALONG = (1.0, 0.0, 0.0)

#: Directions of a contact: normal, normal at the half step, a tangent.
_DIRECTIONS = (
    (_ALONG, _ALONG, (0.0, 1.0, 0.0)),
    (_ALONG, (0.8, 0.6, 0.0), (0.0, 1.0, 0.0)),
    (_DIAGONAL, _DIAGONAL, (math.sqrt(0.5), -math.sqrt(0.5), 0.0)),
)

#: Functions of the mathematical library. In the machine code a call bears the plain name (macOS puts a _ before it).
_LIBRARY = "|".join(sorted(name for name, value in vars(math).items() if callable(value) and not name.startswith("_")))


class Check(NamedTuple):
    """One check: its name, whether it passed, and what was measured against what is allowed."""

    name: str
    passed: bool
    detail: str


def check_law(law, material, radius=1.0):
    """Check a law on single contacts and on collisions of two grains.

    - zero at zero overlap: no force and no couple at rest where the grains just touch, but
      for the pull of a law that is declared ``adhesive``;
    - finite everywhere: at tiny and huge overlaps, speeds and memories, as far apart as it reaches, at dt = 0, in any direction;
    - symmetry: exchanging the grains, or turning and mirroring the collision, changes nothing;
    - order in dt: halving the time step changes the result less and less (``adhesive``: or by no more than the pull in a step);
    - energy: no impact gains any;
    - vectorised: the machine code has vector instructions, and no calls of exp, pow and their like;
    - resume: stopped and resumed, a collision has the same bits.

    Args:
        law: a law.
        material: a ``Material`` with a density and all properties of the law.
        radius: of the grains [length].

    Returns:
        A list of ``Check``, in this order.

    Raises:
        LawError: at least one check failed; the message names each. Or the law does not compile, fails on a plain contact, or
            does not push.
        SceneError: the material does not fit the law, or the radius is no positive number.
    """
    if not (isinstance(radius, (int, float)) and isfinite(radius) and radius > 0.0):
        raise SceneError(f"check_law: radius = {radius!r} [length] must be a finite number > 0")
    bench = _Bench(law, material, float(radius))
    checks = [_attempt(bench, name, check) for name, check in _CHECKS.items()]
    failed = [f"{check.name}: {check.detail}" for check in checks if not check.passed]
    if failed:
        raise LawError(f"law '{law.name}' fails {len(failed)} check(s): " + "; ".join(failed))
    return checks


def _attempt(bench, name, check):
    """A check by name; an error that barchan raises on purpose, such as a NaN or too large an overlap, is a failure."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            passed, detail = check(bench)
            return Check(name, bool(passed), detail)
    except BarchanError as error:
        return Check(name, False, str(error))


class _Bench:
    """Two grains that collide: the time scale and the speed at which they overlap by about 1 % of the radius."""

    def __init__(self, law, material, radius):
        self.law, self.material, self.radius = law, material, radius
        sim = self.collision(0.0, 1.0, 1.0)
        self.table = sim.materials.table(law)
        stable = preflight.stable_time_step(law, self.table, sim.grains, 1)
        if not isfinite(stable):
            raise LawError(
                f"law '{law.name}': its normal force at rest does not grow with the overlap (at 5 % of the diameter), so that no "
                f"time step can be chosen; it must be positive when it pushes the grains apart"
            )
        self.code = machine_code(law)  # now that the plain function is known to return what it must
        self.dt = 0.1 * stable
        self.speed = 2e-3 * radius * 0.017 / self.dt
        self.steps = 3000

    def collision(self, angle, speed, dt, swapped=False, frame=None):
        """Two grains about to touch, one at rest; ``swapped`` exchanges their ids, ``frame`` (3, 3) turns and mirrors all."""
        frame = np.eye(3) if frame is None else frame
        reach = self.radius * 2.5
        half = 20.0 * reach
        sim = Simulation(Box((-half,) * 3, (half,) * 3), self.law, self.material, dt, threads=1, comm=Serial())
        sim.check_dt = False
        velocity = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
        omega = np.linalg.det(frame) * speed / self.radius * np.array([0.3, 0.0, 0.2])
        moving = (np.array([-1.0001 * reach, 0.0, 0.0]), self.radius, velocity, omega)
        resting = (np.zeros(3), 1.5 * self.radius, np.zeros(3), np.zeros(3))
        for position, radius, velocity, omega in (resting, moving) if swapped else (moving, resting):
            sim.add_grains([position @ frame], radius, velocity=velocity @ frame, omega=omega @ frame)
        return sim

    def result(self, sim, steps, frame=None):
        """Velocities and spins of the moving grain after ``steps``, as seen in ``frame``, (6,)."""
        frame = np.eye(3) if frame is None else frame
        sim.run(steps)
        row = int(np.argmin(sim.grains.view("radius")))
        velocity, omega = sim.grains.view("velocity")[row], sim.grains.view("omega")[row]
        return np.concatenate([velocity @ frame.T, self.radius * np.linalg.det(frame) * omega @ frame.T])

    def call(self, overlap, vn=0.0, vt=0.0, memory=0.0, dt=0.0, directions=_DIRECTIONS[0]):
        """The plain function on one contact, slipping by ``vt`` along the tangent, rolling and twisting as fast, with
        vectors of size ``memory`` along the tangent or numbers of that size; returns all numbers of its result."""
        normal, normal_half, tangent = directions
        slip, remembered = (tuple(size * t for t in tangent) for size in (vt, memory))
        values = preflight.equal_contact(self.radius, self.mass, overlap) | {
            "normal": normal,
            "normal_half": normal_half,
            "normal_velocity": vn,
            "tangential_velocity": slip,
            "slip_velocity_half": slip,
            "relative_omega": tuple(vt / self.radius * (n + t) for n, t in zip(normal, tangent)),
            "dt": dt,
        }
        values |= {name: remembered if width == 3 else memory for name, width in self.law.history.items()}
        result = preflight.evaluate(self.law, self.table[:, 0], values)
        return [x for item in result for x in (item if isinstance(item, tuple) else (item,))]

    @property
    def mass(self):
        """Of a grain."""
        return 4.0 / 3.0 * np.pi * self.radius**3 * self.material.density


def _zero(bench):
    touching, typical = (bench.call(depth * bench.radius) for depth in (1e-12, 0.01))
    normal_force, *others = [*touching[:4], *([x / bench.radius for x in touching[4:7]] if bench.law.couple else [])]
    pushes = max(normal_force, 0.0) if bench.law.adhesive else abs(normal_force)
    force = max(pushes, *map(abs, others))
    return force <= 1e-4 * abs(typical[0]), f"force {force or normal_force:.3g} at overlap 1e-12 R, {typical[0]:.3g} at 0.01 R"


def _finite(bench):
    speeds = (0.0, -1e3 * bench.speed, 1e3 * bench.speed)
    apart = bench.law.largest_reach(bench.table, bench.radius)  # more than that of two such grains
    contacts = [
        (overlap, vn, vt, memory, dt, directions)
        for overlap in (*(depth * bench.radius for depth in (1e-300, 1e-12, 0.01, 1.0)), *[-0.1 * apart, -apart] * (apart > 0.0))
        for vn in speeds
        for vt in speeds
        for memory in (0.0, 1e-300, 1.0, -1e6)
        for dt in (0.0, bench.dt)
        for directions in _DIRECTIONS
    ]
    for contact in contacts:
        try:
            finite = all(isfinite(x) for x in bench.call(*contact))
        except LawError:
            finite = False
        if not finite:
            return False, f"not at (overlap, v_n, v_t, memory, dt, (normal, half-step normal, tangent)) = {contact}"
    return True, f"{len(contacts)} contacts"


def _symmetric(bench):
    def apart(**changed):
        other = bench.result(bench.collision(0.6, bench.speed, bench.dt, **changed), bench.steps, changed.get("frame"))
        return float(np.abs(other - plain).max() / bench.speed)

    plain = bench.result(bench.collision(0.6, bench.speed, bench.dt), bench.steps)
    swapped, mirrored = apart(swapped=True), apart(frame=_MIRROR)
    detail = f"exchanging the ids changes the result by {swapped:.2g} of the speed, turning and mirroring by {mirrored:.2g}"
    return swapped < 1e-9 and mirrored < 1e-9, f"{detail} (allowed 1e-9)"


def _order(bench):
    results = [bench.result(bench.collision(0.6, bench.speed, bench.dt / f), bench.steps * f) for f in (1, 2, 4)]
    coarse, fine = (float(np.abs(results[k] - results[k + 1]).max() / bench.speed) for k in (0, 1))
    # A contact that begins or ends with a pull does so anywhere in a step: in steps of dt / 2 the speed may differ by so much.
    jumps = abs(bench.call(1e-12 * bench.radius)[0]) * bench.dt / (bench.mass * bench.speed) if bench.law.adhesive else 0.0
    shrinks = fine <= max(0.75 * coarse, jumps) or coarse < 1e-6
    return shrinks, f"halving dt changes the result by {coarse:.2g}, then by {fine:.2g}"


def _energy(bench):
    worst = 0.0
    for angle in np.radians((0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)):
        sim = bench.collision(angle, bench.speed / np.cos(angle), bench.dt)
        before = _kinetic(sim)
        sim.run(bench.steps)
        worst = max(worst, _kinetic(sim) / before - 1.0)
    return worst < 1e-3, f"kinetic energy grows by at most {worst:.2g} over all impact angles (allowed 1e-3)"


def _kinetic(sim):
    grains = sim.grains
    return 0.5 * float(
        (grains.view("mass") * (grains.view("velocity") ** 2).sum(axis=1)).sum()
        + (grains.view("inertia") * (grains.view("omega") ** 2).sum(axis=1)).sum()
    )


def machine_code(law, uniform=True, alone=False):
    """Machine code of the law's loop over pairs of grains, compiled anew, as assembly text; ``alone``: the one for few grains.

    Raises:
        LawError: the law cannot be compiled.
    """
    loop = make_loops(law, uniform).pair_forces
    fresh = on_one_thread(loop) if alone else kernel(parallel=True)(loop.py_func)
    fresh._cache = NullCache()
    rows, vector, index = (
        types.Array(types.float64, 2, "C"),
        types.Array(types.float64, 1, "C"),
        types.Array(types.uint32, 1, "C"),
    )
    number, count = types.float64, types.uint32
    parts, *rooms = (typeof(array) for array in block_rooms(1, law.history_width))
    state = (rows, rows, rows, index)  # place, motion, spin, material
    columns = (index, rows, rows, types.Array(types.uint8, 1, "C"))  # slot, history, out, changed
    try:
        fresh.compile((parts, index, index, count, *state, count, rows, *columns, *rooms, *4 * [vector], number, number, number))
    except Exception as error:  # Numba stumbles in many ways
        reason = next((line for line in str(error).splitlines() if line.strip() and "Failed in" not in line), "")
        raise LawError(f"law '{law.name}' cannot be compiled: {type(error).__name__}: {reason.strip()}") from error
    return "".join(result.library.get_asm_str() for result in fresh.overloads.values())


def packed_square_roots(law, uniform=True, alone=False):
    """Number of packed square roots in the machine code of the law's loop over pairs: 0 means that it is not vectorised."""
    return _packed_square_roots(machine_code(law, uniform, alone))


def _packed_square_roots(code):
    return len(re.findall(r"\bv?sqrtpd\b|\bfsqrt\s+v\d+\.2d", code))


def _library_calls(code):
    """Names of functions of the mathematical library that machine code calls."""
    lines = (line for line in code.splitlines() if ".asci" not in line)
    return sorted({name for line in lines for name in re.findall(rf"(?<![\w.])_?({_LIBRARY})(?![\w.])", line)})


def _vectorised(bench):
    count, calls = _packed_square_roots(bench.code), _library_calls(bench.code)
    detail = f"{count} packed square roots in the loop's machine code"
    if calls:
        detail += f"; it calls {', '.join(calls)}, one lane at a time, whose bits depend on the machine's mathematical library"
    return count > 0 and not calls, detail


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
    return not lines, lines[0] if lines else "a stopped and resumed run has the same bits"


_CHECKS = {
    "zero at zero overlap": _zero,
    "finite everywhere": _finite,
    "symmetry": _symmetric,
    "order in dt": _order,
    "energy": _energy,
    "vectorised": _vectorised,
    "resume": _resumes,
}
