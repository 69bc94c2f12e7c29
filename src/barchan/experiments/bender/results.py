"""What waves have shown, from the tables of their run."""

from math import sqrt

import numpy as np

from barchan.experiments.bender.arrival import METHODS
from barchan.experiments.bender.elastic import contact, stable_step
from barchan.experiments.bender.wave import waves
from barchan.experiments.experiment import Check, Results
from barchan.units import readable

#: What is allowed: speeds of arrivals outside those of the group and of long waves (a peak moves within its pulse as that changes
#: its shape; the first deflection is told only, as the foot of a pulse that widens runs ahead of all waves); of a crystal against
#: theory; their squares against theory for random packings.
OUTSIDE, EXACT, SOFTER = 0.03, 0.02, (0.2, 1.0)

#: How far each stress may be from the pressure, and motion before a pulse beside the wave.
HELD, QUIET = 5e-3, 1e-2

#: Shear of a wave over that of contacts, overlap over diameter: how small it must be to change no contact.
SMALL = 0.02

#: Least wavelengths between the first receiver and the last, and in diameters.
WAVELENGTHS, LONG = 2.0, 10.0


def results(scene, directory):
    """Values and checks of the run in ``directory``.

    Raises:
        ResultError: a table is damaged.
    """
    heard = waves(scene, directory)
    values = [("sample", f"{scene.packing}, about {scene.across} x {scene.across} x {scene.along} mean diameters")]
    if not heard:
        return Results([*values, ("pulses", "none was listened to yet")], [], [])
    values += _sample(scene, heard[0])
    checks = [_pressure_check(scene, heard), _rest_check(scene, heard), _step_check(scene, heard)]
    for wave in heard:
        values += _speeds(scene, wave)
        checks += _checks(scene, wave)
    values += _moduli(scene, heard)
    return Results(values, [], checks)


def wavelength(wave):
    """At the frequency of the pulse [m], or None."""
    return None if wave.speed is None else wave.speed / wave.shot.frequency


def bulk_density(scene, wave):
    """Of the sample [kg/m^3]."""
    return scene.density * wave.sample["solid fraction [1]"]


def peak(wave):
    """Largest velocity that the nearest receiver of the wave hears [m/s]; 0 where none does."""
    return float(np.abs(wave.clean[0]).max()) if wave.heard.any() else 0.0


def _sample(scene, wave):
    sample = wave.sample
    edges, stresses = ([sample[f"{name} {axis} [{unit}]"] for axis in "xyz"] for name, unit in (("edge", "m"), ("stress", "Pa")))
    yield "edges", " x ".join(f"{1e3 * edge:.3f}" for edge in edges) + " mm"
    yield "stresses", ", ".join(f"{1e-3 * stress:.3f}" for stress in stresses) + " kPa along x, y, z"
    fraction, contacts = sample["solid fraction [1]"], sample["coordination"]
    yield "packing", f"solid fraction {fraction:.4f}, {contacts:.3f} contacts a grain"
    yield "time step", readable(scene.dt, "s")


def _speeds(scene, wave):
    name = f"V{wave.shot.kind.lower()}, {1e-3 * wave.shot.frequency:.4g} kHz"
    if wave.speed is None:
        yield name, f"{wave.heard.sum()} receivers hear the whole wave; 3 are needed: listen longer, or use a higher frequency"
        return
    told = ", ".join(f"{line.speed:.1f} +- {line.error:.1f} {method}" for method, line in wave.lines.items() if line is not None)
    yield name, f"{wave.speed:.1f} m/s by its phase; {told}"
    found = wave.dispersion
    group, layers = found.group(wave.shot.frequency, wave.speed), found.spacing / scene.diameter
    yield (
        f"dispersion {wave.shot.kind}",
        f"long waves {found.long:.1f} m/s, group {group:.1f} m/s, as of layers {layers:.2f} d apart",
    )
    long, distance = wavelength(wave), wave.distance[wave.heard]
    yield (
        f"wavelength {wave.shot.kind}",
        f"{1e3 * long:.2f} mm, {long / scene.diameter:.1f} d; {np.ptp(distance) / long:.2f} between {len(distance)} receivers, "
        f"{wave.sample['edge z [m]'] / long:.2f} in the sample",
    )


def _moduli(scene, heard):
    """G0 and M0 of each frequency, and Poisson's ratio."""
    of = {wave.shot: wave for wave in heard if wave.speed is not None}
    for fast, slow in zip(*([of.get(shot) for shot in scene.shots[kind::2]] for kind in (0, 1))):
        if fast is None or slow is None:
            continue
        density = bulk_density(scene, slow)
        shear, compression = density * slow.speed**2, density * fast.speed**2
        ratio = (compression - 2.0 * shear) / (2.0 * (compression - shear))
        yield f"moduli, {slow.shot.name}", f"G0 = {1e-6 * shear:.1f} MPa, M0 = {1e-6 * compression:.1f} MPa, nu0 = {ratio:.3f}"
        theory = f"G0 = {1e-6 * density * slow.theory**2:.1f} MPa, M0 = {1e-6 * density * fast.theory**2:.1f} MPa"
        exact = scene.packing == "fcc"
        yield "of the crystal" if exact else "if grains moved with the sample", theory


def _pressure_check(scene, heard):
    stresses = np.array([[wave.sample[f"stress {axis} [Pa]"] for axis in "xyz"] for wave in heard])
    worst = float(np.abs(stresses / scene.pressure - 1.0).max())
    return Check("stresses", f"{100 * worst:.3f} % from the pressure at most", f"{100 * HELD:g} %", worst <= HELD)


def _rest_check(scene, heard):
    ratio = max(wave.sample["rms velocity [m/s]"] / peak(wave) if peak(wave) else np.inf for wave in heard)
    return Check("at rest before the pulses", f"{ratio:.1e} of the velocity of the waves", f"{QUIET:g}", ratio <= QUIET)


def _step_check(scene, heard):
    """The stable time step of the largest overlap that there was at a pulse: stiffness grows with its root."""
    overlap = max(wave.sample["largest overlap [1]"] for wave in heard) * scene.diameter
    typical = contact(scene, scene.pressure * scene.diameter**2)
    stable = stable_step(scene, typical._replace(overlap=overlap, kn=typical.kn * sqrt(overlap / typical.overlap)))
    return Check("time step", readable(scene.dt, "s"), f"{readable(stable, 's')}, the stable one", scene.dt <= stable)


def _checks(scene, wave):
    name = f"V{wave.shot.kind.lower()}, {1e-3 * wave.shot.frequency:.4g} kHz"
    if wave.speed is None:
        yield Check(name, f"{wave.heard.sum()} receivers", "3 at least", False)
        return
    lines = {method: line for method, line in wave.lines.items() if line is not None and method != METHODS[0]}
    off = {method: wave.dispersion.outside(wave.shot.frequency, wave.speed, line.speed) for method, line in lines.items()}
    worst = max(off, key=off.get)
    said = f"{100 * off[worst]:.1f} % outside at most, {worst}" if off[worst] else "all"
    yield Check(f"arrivals between group and long waves, {name}", said, f"{100 * OUTSIDE:g} %", off[worst] <= OUTSIDE)
    if scene.packing == "fcc":
        miss = wave.speed / wave.theory - 1.0
        yield Check(f"speed of the crystal, {name}", f"{100 * miss:+.2f} %", f"{100 * EXACT:g} %", abs(miss) <= EXACT)
    else:
        ratio, (least, most) = (wave.speed / wave.theory) ** 2, SOFTER
        said = f"{ratio:.3f} of the modulus if grains moved with the sample"
        yield Check(f"stiffness, {name}", said, f"{least:g} to {most:g}", least <= ratio <= most)
    long, distance = wavelength(wave), wave.distance[wave.heard]
    many = float(np.ptp(distance) / long)
    yield Check(f"wavelengths heard, {name}", f"{many:.2f}", f"{WAVELENGTHS:g} at least", many >= WAVELENGTHS)
    yield Check(f"wavelength, {name}", f"{long / scene.diameter:.1f} d", f"{LONG:g} d at least", long >= LONG * scene.diameter)
    strain = peak(wave) / wave.speed
    share = strain / (contact(scene, scene.pressure * scene.diameter**2).overlap / scene.diameter)
    yield Check(f"pulse is small, {name}", f"strain {strain:.1e}, {share:.1e} of that of contacts", f"{SMALL:g}", share <= SMALL)
