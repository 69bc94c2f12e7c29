"""Curves of the tests of a rock, from the tables of their run."""

import numpy as np
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from barchan.experiments.rock.curve import SECANT
from barchan.experiments.rock.emission import histogram
from barchan.experiments.rock.pictures import broken
from barchan.experiments.rock.results import measured, parts
from barchan.laws.parallel_bond import MODES
from barchan.view.style import COLOURS, figure

#: Colour of each test; of each mode of break in ``pictures``.
TEST_COLOURS = {"compression": COLOURS[0], "tension": COLOURS[1], "brazilian": COLOURS[2]}


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    found, out = measured(scene, directory), directory / "figures"
    if not found:
        return
    yield loading(scene, found, out / "stress.png")
    if found.keys() - {"brazilian"}:
        yield strains(found, out / "strain.png")
    if any(len(one.events.time) for one in found.values()):
        yield emission(scene, found, out / "emission.png")
    shattered = parts(scene, directory)
    for test, one in shattered.items():
        yield broken(scene, test, found[test].cracks, one, out / f"{test}.png")
    if shattered:
        yield sizes(scene, shattered, out / "fragments.png")


def overall(scene, curve):
    """Displacement of the ends over the height [%]."""
    return 100.0 * curve.displacement / scene.height


def loading(scene, found, path):
    """Stress, and cracks so far, against the displacement of the ends."""
    with figure(path, 1, len(found), size=(3.2 * len(found), 3.2), squeeze=False) as (drawing, axes):
        shown = {}
        for axis, (test, one) in zip(axes[0], found.items()):
            across = overall(scene, one.curve)
            shown["stress"] = axis.plot(across, 1e-6 * one.curve.stress, color=COLOURS[6])[0]
            axis.set(xlabel="displacement / height [%]", ylabel="stress [MPa]", title=test, xlim=(0.0, None), ylim=(0.0, None))
            count = axis.twinx()
            for mode, colour in zip(MODES, COLOURS):
                so_far = one.table[f"cracks in {mode}"]
                if so_far[-1]:
                    shown[f"cracks in {mode}"] = count.plot(across, so_far, color=colour, linewidth=1.0)[0]
            count.set(ylim=(0.0, None), ylabel="cracks")
            count.spines["right"].set_visible(True)
            count.grid(False)
        drawing.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown))
    return path


def strains(found, path):
    """Stress against the strains of the middle part, along and across, up to the peak, with the secant."""
    tests = [test for test in found if test != "brazilian"]
    with figure(path, 1, len(tests), size=(3.6 * len(tests), 3.2), squeeze=False) as (_, axes):
        for axis, test in zip(axes[0], tests):
            curve, rows = found[test].curve, slice(None, found[test].curve.peak + 1)
            stress = 1e-6 * curve.stress[rows]
            axis.plot(1e3 * curve.strain[rows], stress, color=COLOURS[0], label="axial")
            axis.plot(-1e3 * curve.lateral[rows], stress, color=COLOURS[1], label="lateral")
            ends = np.array(SECANT) * curve.strength
            begin = float(np.interp(ends[0], curve.stress[rows], curve.strain[rows]))
            told = f"E = {1e-9 * curve.modulus:.1f} GPa, ν = {curve.poisson:.2f}"
            axis.plot(1e3 * (begin + (ends - ends[0]) / curve.modulus), 1e-6 * ends, "--", color=COLOURS[6], label=told)
            axis.axvline(0.0, color=COLOURS[6], linewidth=0.6)
            signs = "shorter, wider" if test == "compression" else "longer, narrower"
            axis.set(xlabel=f"lateral | axial strain [10⁻³] ({signs})", ylabel="stress [MPa]", title=test, ylim=(0.0, None))
            axis.legend(fontsize=7)
    return path


def emission(scene, found, path):
    """Magnitude of each event and their rate against displacement; how many are at least as large, against magnitude."""
    heard = {test: one for test, one in found.items() if len(one.events.time)}
    with figure(path, 1, len(heard) + 1, size=(3.0 * (len(heard) + 1), 3.0)) as (_, axes):
        for axis, (test, one) in zip(axes, heard.items()):
            rate = 100.0 * scene.rate(test)
            axis.scatter(rate * one.events.time, one.events.magnitude, s=4.0, color=TEST_COLOURS[test], linewidths=0.0, alpha=0.6)
            axis.set(xlabel="displacement / height [%]", ylabel="magnitude, log10 of energy in J", title=test)
            axis.set_xlim(0.0, rate * scene.last_step * scene.dt)
            often = axis.twinx()
            ends = (0.0, rate * scene.last_step * scene.dt)
            often.hist(rate * one.events.time, bins=40, range=ends, histtype="stepfilled", color=COLOURS[6], alpha=0.15)
            often.set(ylim=(0.0, None), ylabel="events in each 1/40 of the test")
            often.grid(False)
            often.spines["right"].set_visible(True)
        for test, one in heard.items():
            _distribution(axes[-1], test, one.events)
        axes[-1].set(xlabel="magnitude M, log10 of energy in J", ylabel="events of at least M", yscale="log")
        axes[-1].legend(fontsize=7)
    return path


def _distribution(axis, test, events):
    counts, edges = histogram(events.magnitude)
    above = counts[::-1].cumsum()[::-1]
    axis.plot(edges[:-1], above, "o", markersize=3, color=TEST_COLOURS[test], label=test)
    b, error = events.slope
    if np.isfinite(b):
        start = above[np.argmin(np.abs(edges[:-1] - events.complete))]
        magnitude = np.array([events.complete, edges[-1]])
        line = start * 10.0 ** (-b * (magnitude - events.complete))
        axis.plot(magnitude, line, "--", linewidth=1.0, color=TEST_COLOURS[test], label=f"b = {b:.2f} ± {error:.2f}")


def sizes(scene, shattered, path):
    """Share of the mass in fragments up to a size, that of a sphere of the same solid volume."""
    with figure(path, size=(4.6, 3.4)) as (_, axis):
        for test, one in shattered.items():
            mass = np.sort(one.mass) * one.grains["mass"].sum()
            diameter = 1e3 * np.cbrt(6.0 * mass / (np.pi * scene.density))
            axis.step(diameter, 100.0 * np.cumsum(mass) / mass.sum(), where="post", color=TEST_COLOURS[test], label=test)
            axis.plot(diameter[-1], 100.0, "o", markersize=4, color=TEST_COLOURS[test])
        axis.set(xlabel="diameter of a sphere of that solid volume [mm]", ylabel="mass in fragments up to it [%]", xscale="log")
        axis.set_ylim(0.0, 105.0)
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.legend(loc="upper left")
    return path
