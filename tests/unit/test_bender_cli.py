"""Waves from the command line: they leave tables, figures and a summary, resume, and refuse what cannot be."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.bender import Bender
from barchan.experiments.bender.elastic import crystal_speeds
from barchan.experiments.bender.pictures import moments
from barchan.scene import read_scene_file
from barchan.writers import frames, read_grain_frame, read_table

SMALL = ("--packing", "fcc", "--across", "3", "--along", "60", "--shear-frequency", "50kHz", "--compression-frequency", "70kHz")
SETTINGS = ("listen=60us", "settle=30us", "rest=90us", "spacing=1mm", "signal_every=0.6us")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


def run(out, *more):
    settings = (word for text in SETTINGS for word in ("--set", text))
    return barchan("run", "bender", *SMALL, *settings, "--threads", "1", "--out", out, *more)


def test_it_leaves_tables_figures_and_a_summary_and_resumes_in_a_pulse(tmp_path):
    out, again = tmp_path / "out", tmp_path / "again"
    run(out, "--checkpoint-every", "1211")
    _, scene = read_scene_file(out / "scene.toml", {"bender": Bender})
    assert 0 < 1211 - scene.shots[1].begin < 0.5 / (70e3 * scene.dt)
    names = {"wave.png", "received.png", "time_distance.png", "arrivals.png", "spectrum.png"}
    assert {path.name for path in (out / "figures").iterdir()} == names
    summary = (out / "summary.txt").read_text()
    for words in ("Vs, 50 kHz", "Vp, 70 kHz", "first deflection", "wavelength S", "G0 = ", "of the crystal", "pulse is small"):
        assert words in summary
    signals = read_table(out / "tables" / "signals.csv")
    assert set(signals["shot"]) == {0, 1} and len(np.unique(signals["distance [m]"].round(6))) == 29
    for shot in scene.shots:
        (frame,) = (frame for frame in frames(out / "frames", "grains") if frame.step == moments(scene, shot)[2])
        fields, since = read_grain_frame(frame.path).fields, (frame.step - shot.begin) * scene.dt - 0.25 / shot.frequency
        fastest = np.argmax(fields["velocity"][:, shot.axis])
        gone = abs(fields["position"][fastest, 2]) / crystal_speeds(scene).of(shot.kind)
        assert gone == pytest.approx(since, abs=0.1 / shot.frequency), "the crest of the wave is where theory has it"
    shutil.copytree(out, again)
    all_checkpoints(again / "checkpoints")[-1].unlink()
    barchan("run", "bender", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (again / "tables" / path.name).read_bytes()
    barchan("run", "bender", "--resume", again, "--sweep", "2")
    summary = (again / "summary.txt").read_text()
    for words in ("Vs, 50 kHz", "Vp, 87.5 kHz", "Vs, 62.5 kHz", "moduli, S, 50 kHz", "moduli, S, 62.5 kHz"):
        assert words in summary, "a sweep is a longer run"
    assert "bender" in barchan("check", again / "scene.toml")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"pulse_stress": "20 kPa"}, "pulse_stress = 20000 Pa must be at most a tenth of the pressure, 100000 Pa"),
        ({"signal_every": "4 us"}, r"signal_every = 4e-06 s must be at most a tenth of a period, 3\.7"),
        ({"listen": "90 us"}, "listen = 9e-05 s must be at least twice the longest period, 5e-05 s"),
        ({"spacing": "7 mm", "along": 60}, r"spacing = 0\.007 m must be at most a tenth of the sample's length, 0\.06 m"),
        ({"patch": "9 mm"}, r"patch = 0\.009 m must be no wider than the sample, 0\.008 m"),
        ({"pulse_stress": "-1 Pa"}, r"pulse_stress = '-1 Pa' .* > 0 Pa is needed"),
        ({"dt": "0.3 us"}, r"dt = 3e-07 s is above the stable time step, 1\.58e-07 s"),
        ({"dt": "0.4 us", "packing": "fcc"}, r"dt = 4e-07 s is above the stable time step, 3\.1\de-07 s"),
        ({"radius_max": "0.1 mm"}, r"radius_max = 0\.0001 m is below radius_min = 0\.00045 m"),
    ],
)
def test_what_does_not_fit_together_is_refused(given, words):
    with pytest.raises(SceneError, match=words):
        Bender.make(given)


def test_what_cannot_be_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(SceneError, match="sweep = '0'"):
        run(tmp_path / "out", "--sweep", "0")
    assert not (tmp_path / "out").exists()


def test_a_sample_without_contacts_is_told(tmp_path):
    loose = ("press=0.15us", "hold=0.15us", "settle=0.15us", "listen=100us", "rest=0.15us")
    with pytest.raises(SceneError, match=r"the sample has no contacts at step 3, when the first pulse begins.*press longer"):
        settings = (word for text in loose for word in ("--set", text))
        barchan("run", "bender", "--across", "3", "--along", "20", *settings, "--threads", "1", "--out", tmp_path / "out")


def test_the_list_names_it():
    assert "bender" in barchan("list")
