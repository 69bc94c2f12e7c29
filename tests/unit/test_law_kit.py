"""``check_law``: each promise of it is kept: a law that is broken in one way is refused, and the message names that way."""

import math
from itertools import count
from math import acos, exp, sqrt

import pytest

import barchan as bc
from barchan import testing
from barchan.errors import LawError, SceneError
from barchan.laws.vector import add, cross, dot, norm, scale

ZERO = (0.0, 0.0, 0.0)
SPRING = {"kn": bc.Property("force/length", above=True)}
WITH_FRICTION = SPRING | {"kt": "force/length"}
SOFT = bc.Material("soft", density=1.0, kn=1e4)
ROUGH = bc.Material("rough", density=1.0, kn=1e4, kt=3e3)
STEPS = count(1)


@bc.law(properties=SPRING)
def pushes_from_afar(overlap, kn):
    return kn * overlap + 1.0, ZERO


@bc.law(properties=SPRING)
def drags_from_afar(overlap, normal, kn):
    return kn * overlap, (0.0, 1.0, 0.0)


@bc.law(properties=SPRING)
def divides_by_overlap(overlap, kn):
    return kn * overlap + 1e-9 * overlap / (overlap * overlap), ZERO


@bc.law(properties=WITH_FRICTION)
def divides_by_slip(overlap, tangential_velocity, kn, kt):
    return kn * overlap, scale(-0.5 * kn * overlap / norm(tangential_velocity), tangential_velocity)


@bc.law(properties=SPRING)
def takes_the_root_of_a_speed(overlap, normal_velocity, kn):
    return kn * overlap * (1.0 + 1e-6 * sqrt(normal_velocity)), ZERO


@bc.law(properties=SPRING, history={"last": 1})
def divides_by_dt(overlap, normal_velocity, dt, kn, last):
    rate = (overlap - last) / dt if normal_velocity != 0.0 else 0.0
    return kn * overlap + 0.01 * rate, ZERO, overlap


@bc.law(properties=SPRING)
def takes_the_angle_of_normals(overlap, normal, normal_half, kn):
    return kn * overlap * (1.0 + 1e-9 * acos(dot(normal, normal_half))), ZERO


@bc.law(properties=SPRING)
def favours_the_first(overlap, radius_first, radius_second, kn):
    return kn * overlap * (1.0 + 1e-6 * (radius_first - radius_second) / radius_first), ZERO


@bc.law(properties=SPRING)
def favours_a_direction(overlap, normal, kn):
    return kn * overlap * (1.0 + 1e-6 * normal[0] * normal[0]), ZERO


@bc.law(properties=WITH_FRICTION)
def favours_a_screw(overlap, normal, tangential_velocity, kn, kt):
    return kn * overlap, scale(-1e-4 * kt * overlap, cross(normal, tangential_velocity))


@bc.law(properties=WITH_FRICTION, history={"slip": 3})
def counts_steps_not_time(overlap, tangential_velocity, kn, kt, slip):
    slip = add(slip, scale(1e-5, tangential_velocity))
    return kn * overlap, scale(-kt, slip), slip


@bc.law(properties=SPRING)
def pushes_harder_when_parting(overlap, normal_velocity, kn):
    return kn * overlap * (1.0 + 0.1 * normal_velocity), ZERO


@bc.law(properties=WITH_FRICTION)
def drives_the_slip(overlap, tangential_velocity, kn, kt):
    return kn * overlap, scale(0.05 * kt * overlap, tangential_velocity)


@bc.law(properties=SPRING)
def calls_exp(overlap, kn):
    return kn * overlap * (2.0 - exp(-overlap)), ZERO


@bc.law(properties=SPRING)
def calls_pow(overlap, kn):
    return kn * overlap**1.5, ZERO


@bc.law(properties=SPRING)
def calls_arc_tangent(overlap, kn):
    return kn * math.atan2(overlap, 1.0), ZERO


@bc.law(properties=SPRING)
def loops(overlap, kn):
    total, depth = 0.0, overlap
    while depth > 1e-9:
        total += kn * depth
        depth *= 0.5
    return total, ZERO


@bc.law(properties=SPRING, couple=True)
def turns_from_afar(overlap, normal, kn):
    return kn * overlap, ZERO, scale(1.0, normal)


@bc.law(properties=SPRING, couple=True)
def divides_by_rotation(overlap, relative_omega, kn):
    return kn * overlap, ZERO, scale(-0.1 * kn * overlap / norm(relative_omega), relative_omega)


@bc.law(properties=SPRING, couple=True)
def turns_like_a_screw(overlap, normal, kn):
    return kn * overlap, ZERO, scale(1e-5 * kn * overlap, normal)


@bc.law(properties=SPRING, couple=True)
def drives_the_rotation(overlap, relative_omega, kn):
    return kn * overlap, ZERO, scale(kn * overlap, relative_omega)


@bc.law(properties=SPRING, adhesive=True)
def pushes_though_adhesive(overlap, kn):
    return kn * overlap + 1.0, ZERO


@bc.law(properties=SPRING, adhesive=True)
def drags_though_adhesive(overlap, kn):
    return kn * overlap - 1.0, (0.0, 1.0, 0.0)


@bc.law(properties=SPRING)
def pulls_undeclared(overlap, kn):
    return kn * overlap - 1.0, ZERO


def never_the_same(first, second):
    """Not a function of the materials: another stiffness each time it is asked."""
    return {"kn": first["kn"] * (1.0 + 1e-9 * next(STEPS))}


@bc.law(properties=SPRING, mix=never_the_same)
def forgets_its_stiffness(overlap, kn):
    return kn * overlap, ZERO


ADHESIVE = [pushes_though_adhesive, drags_though_adhesive, pulls_undeclared]
BROKEN = {
    "zero at zero overlap": [pushes_from_afar, drags_from_afar, turns_from_afar, *ADHESIVE],
    "finite everywhere": [
        divides_by_overlap,
        divides_by_slip,
        divides_by_rotation,
        takes_the_root_of_a_speed,
        divides_by_dt,
        takes_the_angle_of_normals,
    ],
    "symmetry": [favours_the_first, favours_a_direction, favours_a_screw, turns_like_a_screw],
    "order in dt": [counts_steps_not_time],
    "energy": [pushes_harder_when_parting, drives_the_slip, drives_the_rotation],
    "vectorised": [calls_exp, calls_pow, calls_arc_tangent, loops],
    "resume": [forgets_its_stiffness],
}


def material_for(law):
    return ROUGH if "kt" in law.properties else SOFT


@pytest.mark.parametrize(
    ("promise", "law"),
    [
        pytest.param(promise, law, marks=[] if law is laws[0] else [pytest.mark.validate])
        for promise, laws in BROKEN.items()
        for law in laws
    ],
    ids=lambda part: getattr(part, "name", ""),
)
def test_a_law_that_breaks_one_promise_is_refused_by_that_name(promise, law, monkeypatch):
    """Each check on its own, so that a neighbour that also complains does not hide one that sleeps."""
    monkeypatch.setattr(testing, "_CHECKS", {promise: testing._CHECKS[promise]})
    if promise != "vectorised":
        monkeypatch.setattr(testing, "machine_code", lambda law: "")  # 2 s each
    with pytest.raises(LawError, match=f"^law '{law.name}' fails 1 check\\(s\\): {promise}: ") as caught:
        testing.check_law(law, material_for(law))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("law", "named"), [(calls_exp, "exp"), (calls_pow, "pow"), (calls_arc_tangent, "atan2")])
def test_calls_of_the_mathematical_library_are_named(law, named):
    assert testing._library_calls(testing.machine_code(law)) == [named]


def test_every_promise_has_a_broken_law_and_all_that_fail_are_named():
    assert list(BROKEN) == list(testing._CHECKS)
    with pytest.raises(LawError, match=r"fails 2 check\(s\): zero at zero overlap: .*; vectorised: .*calls pow"):
        testing.check_law(touches_and_powers, SOFT)


@bc.law(properties=SPRING)
def touches_and_powers(overlap, kn):
    return kn * overlap**1.5 + 0.01, ZERO


@bc.law(properties=SPRING)
def pulls(overlap, kn):
    return -kn * overlap, ZERO


@bc.law(properties=SPRING, history={"last": 1})
def always_divides_by_dt(overlap, dt, kn, last):
    return kn * overlap + 0.01 * (overlap - last) / dt, ZERO, overlap


@bc.law(properties=SPRING)
def adds_a_number_to_a_vector(overlap, normal, kn):
    return kn * overlap, normal + 1.0


@bc.law(properties=SPRING)
def does_not_compile(overlap, kn):
    return float(f"{kn}") * overlap, ZERO


@bc.law(properties=SPRING, history={"slip": 3})
def returns_a_narrow_memory(overlap, kn, slip):
    return kn * overlap, ZERO, 0.0


@bc.law(properties=SPRING, couple=True)
def forgets_its_couple(overlap, kn):
    return kn * overlap, ZERO


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (pulls, "law 'pulls': its normal force at rest does not grow with the overlap"),
        (always_divides_by_dt, r"law 'always_divides_by_dt': its normal force at rest, overlap .*, dt 0, is inf, not finite"),
        (adds_a_number_to_a_vector, "law 'adds_a_number_to_a_vector' (fails with TypeError|cannot be compiled): .+"),
        (does_not_compile, "law 'does_not_compile' cannot be compiled: .+"),
        (forgets_its_couple, r"law 'forgets_its_couple' (must return .*, couple; got|cannot be compiled)"),
        (returns_a_narrow_memory, r"law 'returns_a_narrow_memory' (must return .*, slip; got|cannot be compiled)"),
    ],
    ids=lambda part: getattr(part, "name", ""),
)
def test_what_cannot_be_checked_at_all_is_named(law, message):
    with pytest.raises(LawError, match=f"^{message}") as caught:
        testing.check_law(law, SOFT)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, "big"])
def test_a_radius_is_positive(radius):
    with pytest.raises(SceneError, match="check_law: radius = "):
        testing.check_law(pulls, SOFT, radius)
