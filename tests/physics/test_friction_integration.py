"""Time integration of friction: a small grain on the neck between two large ones must fall, whatever the size ratio.

Source: Vyas, Ottino, Lueptow & Umbanhowar, Comput. Phys. Commun. 310, 109524 (2025). ``necks.py`` says what is simulated;
docs/physics/friction-integration.md discusses the results. The quick tests use grains a hundred times softer than published,
with a time step ten times larger; ``-m validate`` repeats all with the published stiffness.
"""

import numpy as np
import pytest
from analytic import rolling_over_neck
from impacts import BASIC_LAWS
from necks import GRAVITY, HARD, LARGE, RATIOS, SOFT, TILT, Necks, leaving_times

import barchan as bc

DURATION, EVERY, SOFT_DT, HARD_DT = 0.3, 0.001, 1e-5, 1e-6

DEFAULT, STANDARD = (
    ("linear", "silbert", "hertz", "hertz_mindlin"),
    ("linear_standard", "silbert_standard", "hertz_mindlin_standard"),
)

#: Size ratios between which the standard scheme begins to fail.
FINE_RATIOS = np.array([5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 50.0, 100.0])

#: Largest size ratio at which the grain falls with the standard scheme, soft grains.
FALLS_UP_TO = {"linear_standard": 10.0, "silbert_standard": 8.0, "hertz_mindlin_standard": 9.0}

#: The same with the published stiffness: all three laws.
HARD_FALLS_UP_TO = 8.0

#: Leaving times [s] at RATIOS of the linear law, soft grains, which both schemes tend to (``test_convergence_of_both_schemes``).
CONVERGED = np.array([0.2059, 0.1744, 0.1628, 0.1542, 0.1525, 0.1616, 0.1907, 0.2274])


def times_of(name, dt=SOFT_DT, rigidity=SOFT, ratios=RATIOS):
    """When the small grains leave the neck, inf if they do not."""
    necks = Necks(bc.laws.SHIPPED[name], dt, rigidity, ratios)
    times, distances, _ = necks.follow(DURATION, EVERY)
    return leaving_times(times, distances)


def report(title, ratios, rows):
    """Print a table of leaving times in ms, for ``-s``."""
    print(f"\n{title}\n{'size ratio':32s}" + "".join(f"{ratio:8g}" for ratio in ratios))
    for name, times in rows.items():
        print(f"{name:32s}" + "".join(f"{1e3 * t:8.1f}" if np.isfinite(t) else "  sticks" for t in times))


@pytest.mark.parametrize("name", DEFAULT)
def test_small_grain_rolls_and_falls(name):
    """Default laws, size ratios 1 to 100: the grain rolls around the neck as the rigid sphere of ``rolling_over_neck`` does,
    within 0.5 % up to 40 degrees, then slides and leaves, at the time of the converged linear contact within 0.2 % (linear law)
    or 5 % (the others, whose springs yield otherwise)."""
    necks = Necks(bc.laws.SHIPPED[name], SOFT_DT, SOFT)
    times, distances, angles = necks.follow(DURATION, EVERY)
    for column, radius in enumerate(necks.radius):
        expected = rolling_over_neck(TILT, times, LARGE, radius, GRAVITY)
        rolling = (expected > np.radians(2.0)) & (expected < np.radians(40.0))
        assert rolling.sum() > 20
        np.testing.assert_allclose(angles[rolling, column], expected[rolling], rtol=5e-3)
    np.testing.assert_allclose(leaving_times(times, distances), CONVERGED, rtol=0.002 if name == "linear" else 0.05)


@pytest.mark.parametrize("name", ["linear_standard", *(pytest.param(name, marks=pytest.mark.validate) for name in STANDARD[1:])])
def test_standard_scheme_sticks(name):
    """Standard scheme: from a size ratio of about 9 on the grain sticks and never falls (recorded: ``FALLS_UP_TO``)."""
    falls = np.isfinite(times_of(name, ratios=FINE_RATIOS))
    np.testing.assert_array_equal(falls, FINE_RATIOS <= FALLS_UP_TO[name])


def test_standard_scheme_converges_to_the_default():
    """Linear law, standard scheme with a tenth of the time step: the grain falls at all ratios, within 4 % of the default's
    times. So the sticking is an error of the time integration, and the default's result with the large step is the right one."""
    np.testing.assert_allclose(times_of("linear_standard", 0.1 * SOFT_DT), CONVERGED, rtol=0.04)


@pytest.mark.parametrize("law", BASIC_LAWS, ids=lambda law: law.name)
def test_memory_turns_with_the_contact(law):
    """A stuck contact turns rigidly by 90 degrees, in 30 steps of 3 degrees and with no slip: its tangential force turns with it.

    Laws that lay the memory onto the new plane keep its length to rounding; those of the standard scheme with a displacement
    project it, so its part across the axis of rotation shrinks by cos(3 degrees) at every step.
    """
    memory = (0.0, 3e-5, 4e-5)  # along the axis of rotation z and across it; the first normal is x
    parameters = {name: 0.1 for name in law.parameters} | {"friction": 1e9}
    values = {"overlap": 0.01, "distance": 1.99, "mass_eff": 1.0, "dt": 1e-3, "normal_velocity": 0.0}
    values |= {"radius_first": 1.0, "radius_second": 1.0, "radius_eff": 0.5}
    values |= {"tangential_velocity": (0.0, 0.0, 0.0), "slip_velocity_half": (0.0, 0.0, 0.0)}
    angles = np.radians(3.0 * np.arange(1, 31))
    for angle in angles:
        values["normal"] = (np.cos(angle), np.sin(angle), 0.0)
        values["normal_half"] = (np.cos(angle - np.radians(1.5)), np.sin(angle - np.radians(1.5)), 0.0)
        arguments = {name: values[name] for name in law.quantities}
        _, _, memory = law(**arguments, **parameters, **{next(iter(law.history)): memory})
    across = 3e-5
    if law.name in ("linear_standard", "silbert_standard", "hertz_standard"):
        across *= np.cos(np.radians(3.0)) ** 30
        np.testing.assert_allclose(memory, (-across, 0.0, 4e-5), rtol=1e-12, atol=1e-18)
    else:
        assert np.linalg.norm(memory) == pytest.approx(5e-5, rel=1e-12)
        np.testing.assert_allclose(memory, (-across, 0.0, 4e-5), rtol=0.03, atol=1e-18)


@pytest.mark.validate
@pytest.mark.parametrize("name", STANDARD)
def test_published_stiffness(name):
    """The same with hard grains and dt = 1e-6 s: default laws fall at all ratios, the standard scheme up to a ratio of 8."""
    default = name.removesuffix("_standard")
    rows = {scheme: times_of(scheme, HARD_DT, HARD) for scheme in (default, name)}
    report(f"leaving times [ms], hard grains, dt = {HARD_DT:g} s", RATIOS, rows)
    fine = times_of(name, HARD_DT, HARD, FINE_RATIOS)
    report(f"leaving times [ms], hard grains, dt = {HARD_DT:g} s", FINE_RATIOS, {name: fine})
    assert np.isfinite(rows[default]).all()
    np.testing.assert_array_equal(np.isfinite(fine), FINE_RATIOS <= HARD_FALLS_UP_TO)


@pytest.mark.validate
@pytest.mark.parametrize("name", ["linear", "silbert", "hertz_mindlin"])
def test_convergence_of_both_schemes(name):
    """Soft grains, dt from 1e-5 to 1e-6 s: leaving times of the default scheme move by less than 0.2 %. Those of the standard
    scheme come nearer to them with every smaller step, first order, and it sticks at fewer ratios; none is left for the linear
    law, which is within 1 % at 2.5e-7 s."""
    steps = (1e-5, 5e-6, 2.5e-6, 1e-6)
    rows = {(name, dt): times_of(name, dt) for dt in steps}
    finest = rows[name, steps[-1]]
    standard = f"{name}_standard"
    rows |= {(standard, dt): times_of(standard, dt) for dt in (*steps, *([2.5e-7] if name == "linear" else []))}
    report("leaving times [ms], soft grains", RATIOS, {f"{scheme}, dt = {dt:g} s": row for (scheme, dt), row in rows.items()})
    for dt in steps:
        np.testing.assert_allclose(rows[name, dt], finest, rtol=2e-3)
    errors = np.array([rows[standard, dt] - finest for dt in steps])
    assert (errors[1:] <= np.where(np.isfinite(errors[:-1]), errors[:-1] + 1e-5, np.inf)).all()
    if name == "linear":
        np.testing.assert_allclose(rows[standard, 2.5e-7], finest, rtol=0.01)
