"""Silos from the command line: they leave tables, figures and a summary, resume, and refuse what cannot be."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.silo import Silo
from barchan.experiments.silo.results import Tables
from barchan.scene import read_scene_file

SETTINGS = ("slide=10ms", "gravity=60", "youngs_modulus=10MPa", "dt=20us", "frame_every=20ms", "table_every=10ms")
SMALL = ("--grains", "60", "--outlets", "3", "--silo-diameter", "40mm", "--outlet-min", "20mm", "--outlet-max", "28mm")
SMALL += ("--equilibrate", "30ms", "--duration", "80ms", "--threads", "1")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


def run(out, *more):
    return barchan("run", "silo", *SMALL, *(word for text in SETTINGS for word in ("--set", text)), "--out", out, *more)


def test_it_leaves_tables_figures_and_a_summary_and_resumes_while_grains_flow(tmp_path):
    out, again = tmp_path / "out", tmp_path / "again"
    run(out, "--checkpoint-every", "3001")
    _, scene = read_scene_file(out / "scene.toml", {"silo": Silo})
    assert {path.name for path in (out / "figures").iterdir()} == {"silos.png", "pressure.png", "discharge.png", "residence.png"}
    summary = (out / "summary.txt").read_text()
    for words in ("filled to", "bulk density", "Janssen's law", "residence time", "weight is carried", "lost grains"):
        assert words in summary
    tables = Tables.of(out)
    left, silos = tables.left, tables.silos
    assert len(np.unique(left["id"])) == len(left["id"]) > 60 and left["step"].min() > scene.open_step
    for silo in range(3):
        inside = silos["grains"][silos["silo"] == silo][-1]
        assert inside + (left["silo"][left["step"] <= silos["step"][-1]] == silo).sum() == 60, "each is inside or has left"
    shutil.copytree(out, again)
    all_checkpoints(again / "checkpoints")[-1].unlink()
    barchan("run", "silo", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (again / "tables" / path.name).read_bytes()


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("outlet-max", "10mm", "outlet_max = 0.01 m must exceed outlet_min = 0.02 m"),
        ("outlet-max", "39mm", "silo_diameter = 0.04 m must exceed outlet_max = 0.039 m by two diameters"),
        ("outlets", "0", "outlets = '0'"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_written(tmp_path, name, value, words):
    before = SMALL.index(f"--{name}")
    given = [*SMALL[:before], *SMALL[before + 2 :], f"--{name}", value]
    with pytest.raises(SceneError, match=words):
        barchan("run", "silo", *given, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_walls_that_slide_too_far_and_radii_in_the_wrong_order_are_refused():
    with pytest.raises(SceneError, match="lifts the walls off the floor"):
        Silo.make({"slide": 2.0})
    with pytest.raises(SceneError, match=r"radius_max = 0\.001 m is below"):
        Silo.make({"radius_max": 0.001})
    assert Silo.make({"outlets": 1, "outlet_min": 0.03, "outlet_max": 0.03}).outlet_diameters.tolist() == [0.03]


def test_the_list_names_it():
    assert "silo" in barchan("list")
