"""Columns from the command line: they leave tables, figures and a summary, resume, and refuse what cannot be."""

import shutil

import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.column import Column

SETTINGS = ("gravity=60", "youngs_modulus=10MPa", "dt=20us", "frame_every=20ms", "table_every=10ms")
SMALL = ("--columns", "2", "--aspect-min", "0.8", "--aspect-max", "1.6", "--column-radius", "18mm")
SMALL += ("--equilibrate", "20ms", "--duration", "40ms", "--threads", "1")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


def test_it_leaves_tables_figures_and_a_summary_and_resumes_in_the_collapse(tmp_path):
    out, again = tmp_path / "out", tmp_path / "again"
    settings = [word for text in SETTINGS for word in ("--set", text)]
    barchan("run", "column", *SMALL, *settings, "--out", out, "--checkpoint-every", "1701")
    assert {path.name for path in (out / "figures").iterdir()} == {"columns.png", "profiles.png", "scaling.png", "time.png"}
    summary = (out / "summary.txt").read_text()
    for words in ("run-out", "Lube", "Lajeunesse", "potential energy lost", "at rest before the release", "lost grains"):
        assert words in summary
    shutil.copytree(out, again)
    all_checkpoints(again / "checkpoints")[-1].unlink()
    barchan("run", "column", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (again / "tables" / path.name).read_bytes()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"aspect_max": 0.3}, r"aspect_max = 0\.3 must exceed aspect_min = 0\.6"),
        ({"column_radius": 0.01}, r"column_radius = 0\.01 m must be three diameters"),
        ({"aspect_min": 0.05}, r"aspect_min = 0\.05 makes a column lower than a grain"),
        ({"radius_max": 0.001}, r"radius_max = 0\.001 m is below"),
        ({"columns": 0}, "columns = 0"),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(SceneError, match=words):
        Column.make(given)


def test_nothing_is_written_for_a_scene_that_cannot_be(tmp_path):
    with pytest.raises(SceneError, match="time step"):
        barchan("run", "column", *SMALL, "--set", "dt=1ms", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_list_names_it():
    assert "column" in barchan("list")
