"""A drum from the command line: it leaves tables, figures and a summary, and resumes while it turns."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.drum.results import Tables

SMALL = ("--grains", "60", "--drum-radius", "25mm", "--length", "20mm", "--ends", "periodic", "--rotation", "6")
SMALL += ("--equilibrate", "30ms", "--duration", "120ms", "--threads", "1")
SETTINGS = ("develop=40ms", "frame_every=20ms", "table_every=10ms")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


def run(out, *more):
    return barchan("run", "drum", *SMALL, *(word for text in SETTINGS for word in ("--set", text)), "--out", out, *more)


def test_it_leaves_tables_figures_and_a_summary_and_resumes_as_it_turns(tmp_path):
    out, again = tmp_path / "out", tmp_path / "again"
    run(out, "--checkpoint-every", "1701")
    assert {path.name for path in (out / "figures").iterdir()} == {"drum.png", "angle.png", "layer.png", "mixing.png"}
    summary = (out / "summary.txt").read_text()
    for words in (
        "angle at its ends",
        "flowing layer",
        "mixing index",
        "torque carries the slope",
        "Froude",
        "energy",
        "lost grains",
    ):
        assert words in summary
    assert "angle that was measured" not in summary, "it is another drum"
    shutil.copytree(out, again)
    all_checkpoints(again / "checkpoints")[-1].unlink()
    barchan("run", "drum", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (again / "tables" / path.name).read_bytes()
    barchan("run", "drum", "--resume", out, "--duration", "180ms")
    energy = Tables.of(out).energy
    assert len(energy["step"]) == 2 and energy["accounted for [s]"] == pytest.approx([0.02, 0.02])
    assert np.abs(energy["left over [J]"] / energy["work of the drum [J]"]).max() < 0.02


def test_a_drum_that_is_too_small_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(SceneError, match=r"grains = 900 do not fit"):
        barchan("run", "drum", "--grains", "900", *SMALL[2:], "--set", "develop=40ms", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_list_names_it():
    assert "drum" in barchan("list")
