"""The angle of repose from the command line: it leaves tables, figures and a summary, resumes, and refuses what cannot be."""

import shutil

import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints, read_state
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.repose import Repose
from barchan.scene import parse_assignment, read_scene_file
from barchan.writers import read_table

SETTINGS = ("cylinder_radius=15mm", "floor=40mm", "youngs_modulus=6MPa", "frame_every=20ms", "table_every=10ms")
SETTINGS += ("dt=30us", "length=20mm", "width=30mm", "lift_speed=0.5m/s")
SMALL = ("--grains", "60", "--equilibrate", "60ms", "--duration", "40ms", "--threads", "1")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


def run(out, *more):
    return barchan("run", "repose", *SMALL, *(word for text in SETTINGS for word in ("--set", text)), "--out", out, *more)


@pytest.mark.parametrize("method", ["cylinder", "plate"])
def test_it_leaves_tables_figures_and_a_summary_and_resumes_in_the_middle_of_the_lift(tmp_path, method):
    scene = Repose.make(dict(parse_assignment(text, Repose) for text in (*SETTINGS, "grains=60", "equilibrate=60ms")))
    scene = scene.model_copy(update={"method": method, "duration": 0.04})
    middle = (scene.lift_step + scene.lifted_step) // 2
    out, again = tmp_path / "out", tmp_path / "again"
    run(out, "--method", method, "--checkpoint-every", middle)
    assert read_scene_file(out / "scene.toml", {"repose": Repose}) == ("repose", scene)
    assert {path.name for path in (out / "figures").iterdir()} == {"pile.png", "profile.png", "time.png"}
    summary = (out / "summary.txt").read_text()
    for words in ("angle of repose", "run-out", "weight is carried", f"{method} is clear of grains", "lost grains"):
        assert words in summary
    assert set(read_table(out / "tables" / "profiles.csv")["part"]) == set(range(8))
    shutil.copytree(out, again)
    last = all_checkpoints(again / "checkpoints")[-1]
    last.unlink()
    assert read_state(all_checkpoints(again / "checkpoints")[-1]).about["step"] == middle
    barchan("run", "repose", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for name in ("time.csv", "profiles.csv"):
        assert (out / "tables" / name).read_bytes() == (again / "tables" / name).read_bytes()


def test_a_longer_duration_continues_a_finished_run(tmp_path):
    run(tmp_path / "long", "--duration", "80ms")
    run(tmp_path / "short")
    barchan("run", "repose", "--resume", tmp_path / "short", "--duration", "80ms")
    assert differences(last_state(tmp_path / "long"), last_state(tmp_path / "short")) == []
    with pytest.raises(SceneError, match="friction cannot be changed"):
        barchan("run", "repose", "--resume", tmp_path / "short", "--friction", "0.1")


def test_what_cannot_be_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(SceneError, match="time step"):
        run(tmp_path / "out", "--set", "gravity=9.81", "--set", "density=100")
    with pytest.raises(SceneError, match="one of 'cylinder', 'plate'"):
        run(tmp_path / "out", "--method", "sieve")
    assert not (tmp_path / "out").exists()


def test_the_list_names_it():
    assert "repose" in barchan("list")
