"""The waves of the bender experiment: exact in a crystal at any pressure, by a section or a patch that is shaken, and slower than
theory allows in sand."""

import numpy as np
import pytest

from barchan.experiments.bender import BENDER, Bender, build, instruments, results, stages
from barchan.experiments.bender.results import bulk_density
from barchan.experiments.bender.wave import waves


def shaken(directory, **given):
    """The ``Wave`` of each pulse of a test, and its scene."""
    scene = Bender.make(given)
    sim = build(scene, threads=1)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return scene, waves(scene, directory)


CRYSTAL = {"packing": "fcc", "across": 3, "along": 90, "settle": 1.5e-7, "restitution": 1.0}


def test_a_crystal_has_its_speeds_and_they_grow_as_pressure_to_a_sixth(tmp_path):
    """Within 1 %, by the phase: that of long waves less (q h)^2/24 of layers that are h = d / sqrt2 apart."""
    found = []
    for pressure, factor in ((1e5, 1.0), (1e6, 10.0 ** (1.0 / 6.0))):
        timing = {name: value / factor for name, value in (("listen", 0.1e-3), ("rest", 1.5e-7), ("signal_every", 0.3e-6))}
        frequency = {"shear_frequency": 34e3 * factor, "compression_frequency": 50e3 * factor}
        scene, heard = shaken(
            tmp_path / f"{pressure:g}", pressure=pressure, pulse_stress=1e-4 * pressure, **CRYSTAL, **timing, **frequency
        )
        for wave in heard:
            layers = np.pi * wave.shot.frequency * scene.diameter / np.sqrt(2.0) / wave.theory
            assert wave.speed == pytest.approx(wave.theory * (1.0 - layers**2 / 6.0), rel=2e-3)
            assert wave.speed == pytest.approx(wave.theory, rel=1e-2)
            expected = scene.pulse_stress / (2.0 * bulk_density(scene, wave) * wave.theory)
            assert np.abs(wave.clean[-1]).max() == pytest.approx(expected, rel=0.05), "half of the stress goes each way"
            for method in ("zero crossing", "cross-correlation"):
                assert wave.lines[method].speed == pytest.approx(wave.theory, rel=1e-2)
        found.append([wave.speed for wave in heard])
    assert np.log10(np.divide(*found[::-1])) == pytest.approx(1.0 / 6.0, rel=5e-3)


def test_a_patch_sends_a_wave_that_fades_with_distance(tmp_path):
    """One grain of a crystal: what is heard along the axis is smaller the farther away, unlike that of a whole section."""
    given = CRYSTAL | {
        "across": 10,
        "along": 40,
        "listen": 6e-5,
        "rest": 1.5e-7,
        "shear_frequency": 50e3,
        "compression_frequency": 50e3,
    }
    heard = {patch: shaken(tmp_path / f"{patch:g}", patch=patch, **given)[1][0] for patch in (0.0, 1e-4)}
    fades = {}
    for patch, wave in heard.items():
        near, far = (np.abs(wave.velocity[number, wave.time <= wave.limit[number]]).max() for number in (2, 5))
        fades[patch] = far / near
    assert fades[0.0] > 0.9 and fades[1e-4] < 0.6


@pytest.mark.validate
def test_the_default_passes_its_checks(tmp_path):
    scene, heard = shaken(tmp_path)
    failed = [check for check in results(scene, tmp_path).checks if not check.passed]
    assert not failed, failed
    assert [wave.shot.kind for wave in heard] == ["P", "S"] and BENDER.name == "bender"
