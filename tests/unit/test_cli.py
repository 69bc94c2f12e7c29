"""The command: runs, stops, resumes, compares, shows, and says what is wrong in one line."""

import fcntl
import json
import os
import re
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints, read_state
from barchan.cli import app
from barchan.experiments.avalanche import Avalanche
from barchan.experiments.avalanche.parameters import FIGURE_3
from barchan.writers import frames, read_grain_frame, read_table

SMALL = (
    "--grains",
    "450",
    "--equilibrate",
    "20ms",
    "--duration",
    "0.03",
    "--checkpoint-every",
    "400",
    "--set",
    "frame_every=5ms",
)
SHORT = (*SMALL[:5], "0.018", *SMALL[6:])


def barchan(*arguments, check=None, **more):
    done = subprocess.run(
        [sys.executable, "-m", "barchan", *map(str, arguments)], capture_output=True, text=True, timeout=300, **more
    )
    if check is not None:
        assert done.returncode == check, done.stderr
    assert "Traceback" not in done.stderr
    return done


def start(*arguments):
    command = [sys.executable, "-m", "barchan", *map(str, arguments)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def wait_for(condition, process):
    while not condition():
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.01)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A small avalanche that ran in one go."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    done = barchan("run", "avalanche", *SMALL, "--out", out, check=0)
    return out, done.stderr


def test_the_avalanche_shows_progress_and_a_summary(finished):
    out, text = finished
    shortest = int(re.search(r"shortest (\d+)", text).group(1))
    bound = float(re.search(r"equation \(13\) allows ([\d.]+)", text).group(1))
    assert shortest >= int(bound), "equation (13) is a lower bound on the interval between rebuilds"
    for word in (
        "flow: 100 %",
        "steps/s",
        "grain-steps/s",
        "left",
        "results:",
        "differs from the paper, as simulated:",
        "checks:",
        "lost grains",
    ):
        assert word in text
    assert (out / "summary.txt").read_text().strip() in text
    for line in text[text.index("starting in") :].splitlines():  # compiling, if any, was told before there was a log
        assert line in (out / "log.txt").read_text()


def test_the_directory_holds_everything(finished):
    out, _ = finished
    scene = (out / "scene.toml").read_text()
    for word in ('experiment = "avalanche"', "radius_max", "seed = 1", "[ran_with]", "numba"):
        assert word in scene
    pictures = {path.name for path in (out / "figures").iterdir()}
    assert pictures == {f"{name}.png" for name in ("snapshots", "front", "moving_layer", "energy", "profiles")}
    there = frames(out / "frames", "grains")
    assert np.allclose([frame.time for frame in there], 0.02 + 0.005 * np.arange(7), atol=1e-4)
    last = read_grain_frame(there[-1].path).fields
    state = read_state(all_checkpoints(out / "checkpoints")[-1])
    assert np.array_equal(last["id"], state.fields["id"])
    series = read_table(out / "tables" / "time.csv")
    assert series["time [s]"][-1] == pytest.approx(0.05, abs=2e-3) and (np.diff(series["step"]) > 0).all()
    record = json.loads((out / "record.json").read_text())["sittings"]
    last_step = state.about["step"]
    assert len(record) == 1 and (record[0]["first_step"], record[0]["last_step"]) == (0, last_step)
    kept = [read_state(path).about["step"] for path in all_checkpoints(out / "checkpoints")]
    assert kept == [last_step // 400 * 400, last_step], "the last two of one every 400 steps and one at the end"


def test_show_tells_the_same_again_from_stored_data(finished):
    out, text = finished
    before = {path.name: path.read_bytes() for path in (out / "figures").iterdir()}
    (out / "figures" / "front.png").unlink()
    shown = barchan("show", out, check=0).stdout
    assert (out / "summary.txt").read_text().strip() in shown
    assert shown.strip() in text
    assert {path.name: path.read_bytes() for path in (out / "figures").iterdir()} == before


def tree(directory):
    """What a run leaves that must not depend on its stops."""
    parts = {path: path.read_bytes() for kind in ("tables", "frames") for path in (directory / kind).iterdir()}
    return {str(path.relative_to(directory)): content for path, content in parts.items() if path.suffix != ".vtkhdf"}


def test_a_killed_run_resumes_to_the_same_bits_tables_and_frames(finished, tmp_path):
    """Killed before its first checkpoint, and once more in the flow."""
    whole, _ = finished
    out = tmp_path / "broken"
    process = start("run", "avalanche", *SMALL, "--out", out)
    wait_for((out / "scene.toml").exists, process)
    process.kill()
    process.communicate()
    process = start("run", "avalanche", "--resume", out, "--checkpoint-every", 200)
    wait_for(lambda: len(list((out / "frames").glob("*.dump"))) > 3, process)
    process.kill()
    assert "no checkpoint yet" in process.communicate()[1]
    barchan("run", "avalanche", "--resume", out, check=0)
    assert barchan("diff", whole, out, check=0).stdout.strip() == "identical"
    assert tree(whole) == tree(out)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_with_a_checkpoint_of_its_own(finished, tmp_path, number):
    whole, _ = finished
    out = tmp_path / "stopped"
    process = start("run", "avalanche", *SMALL, "--checkpoint-every", 1_000_000, "--out", out)
    wait_for(lambda: (out / "tables" / "time.csv").exists(), process)
    for _ in range(5):  # an impatient user
        process.send_signal(number)
        time.sleep(0.02)
    text = process.communicate()[1]
    assert process.returncode == 130 and "Traceback" not in text
    step = int(re.search(r"stopped at step (\d+), t = .*continue with: barchan run avalanche --resume", text).group(1))
    assert json.loads((out / "record.json").read_text())["sittings"][0]["last_step"] == step
    (checkpoint,) = all_checkpoints(out / "checkpoints")
    assert read_state(checkpoint).about["step"] == step
    barchan("run", "avalanche", "--resume", out, check=0)
    assert barchan("diff", whole, out, check=0).stdout.strip() == "identical"
    first, second = json.loads((out / "record.json").read_text())["sittings"]
    assert (first["first_step"], first["last_step"], second["first_step"]) == (0, step, step)
    log = (out / "log.txt").read_text()
    assert log.index("starting in") < log.index(f"stopped at step {step}") < log.index(f"step {step:,}\n")


def test_a_finished_run_says_so_and_can_be_made_longer(finished, tmp_path):
    whole, _ = finished
    out = tmp_path / "short"
    barchan("run", "avalanche", *SHORT, "--out", out, check=0)
    assert "finished" in barchan("run", "avalanche", "--resume", out, check=0).stderr
    barchan("run", "avalanche", "--resume", out, "--duration", "30 ms", check=0)
    assert barchan("diff", whole, out, check=0).stdout.strip() == "identical"
    assert tree(whole) == tree(out)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--angle", "30"), "angle"),
        (("--set", "kn=1e4"), "kn"),
        (("--grains", "900"), "--grains"),
        (("--figure3",), "--figure3"),
        (("--out", "elsewhere"), "--out"),
    ],
)
def test_resume_refuses_another_scene(finished, arguments, word):
    whole, _ = finished
    message = barchan("run", "avalanche", "--resume", whole, *arguments, check=2).stderr
    assert f"; {word} cannot be changed" in message


def asked_for(monkeypatch, *arguments):
    """(scene, directory, manner) that the command would start or resume with; nothing is run."""
    asked = []
    for name in ("start", "resume"):
        take = lambda experiment, scene, path, manner, journal: asked.append((scene, path, manner))  # noqa: E731
        monkeypatch.setattr(f"barchan.experiments.session.{name}", take)
    done = CliRunner().invoke(app, [str(argument) for argument in ("run", *arguments)])
    assert done.exit_code == 0, done.output
    return asked[0]


@pytest.mark.parametrize(
    ("arguments", "changes"),
    [
        ((), {}),
        (("--angle", "30"), {"angle": 30.0}),
        (("--duration", "600ms"), {"duration": 0.6}),
        (("--equilibrate", "0.1"), {"equilibrate": 0.1}),
        (("--seed", "7"), {"seed": 7}),
        (("--set", "radius_max=1.2mm", "--set", "kn=1e4"), {"radius_max": 1.2e-3, "kn": 1e4}),
        (("--figure3",), FIGURE_3),
        (("--figure3", "--duration", "2 ms"), FIGURE_3 | {"duration": 2e-3}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_option_sets_its_parameter_and_no_other(monkeypatch, arguments, changes):
    scene, path, _ = asked_for(monkeypatch, "avalanche", *arguments)
    assert scene == Avalanche.make(changes)
    assert re.fullmatch(r"runs/avalanche-\d{8}-\d{6}", str(path))


def test_what_is_set_on_a_file_goes_before_what_it_says(finished, monkeypatch):
    whole, _ = finished
    scene, *_ = asked_for(monkeypatch, whole / "scene.toml", "--set", "seed=7", "--set", "angle=30")
    there, *_ = asked_for(monkeypatch, whole / "scene.toml")
    assert scene == there.model_copy(update={"seed": 7, "angle": 30.0}) and there.seed == 1


def test_the_manner_of_a_run_is_the_one_asked_for(finished, monkeypatch, tmp_path):
    whole, _ = finished
    manner = ("--threads", "3", "--checkpoint-every", "7")
    for arguments in (("avalanche", "--out", tmp_path), (whole / "scene.toml", "--out", tmp_path)):
        assert asked_for(monkeypatch, *arguments, *manner)[1:] == (tmp_path, (3, 7))
        assert asked_for(monkeypatch, *arguments)[1:] == (tmp_path, (None, 5000))
    assert asked_for(monkeypatch, "avalanche", "--resume", whole, *manner)[1:] == (whole, (3, 7))


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 3)])
def test_the_self_test_ends_with_a_code_that_tells(monkeypatch, passed, code):
    monkeypatch.setattr("barchan.selftest.run", lambda tell, threads: passed)
    assert CliRunner().invoke(app, ["selftest"]).exit_code == code


def test_check_refuses_what_cannot_run_and_writes_nothing(finished, tmp_path):
    whole, _ = finished
    scene = tmp_path / "scene.toml"
    scene.write_text(re.sub(r"(?m)^dt = .*", 'dt = "1 ms"', (whole / "scene.toml").read_text()))
    assert "above the stable time step" in barchan("check", scene, check=2, cwd=tmp_path).stderr
    assert list(tmp_path.iterdir()) == [scene]


def test_a_directory_with_another_scene_and_no_checkpoint_is_refused(finished, tmp_path):
    """What a run leaves that was killed before its first checkpoint."""
    whole, _ = finished
    scene = (whole / "scene.toml").read_bytes()
    (tmp_path / "scene.toml").write_bytes(scene)
    done = barchan("run", "avalanche", *SMALL, "--seed", "2", "--out", tmp_path, check=2)
    assert "another scene: seed" in done.stderr
    assert (tmp_path / "scene.toml").read_bytes() == scene


def test_diff_names_what_differs(finished, tmp_path):
    whole, _ = finished
    other = tmp_path / "other"
    barchan("run", "avalanche", *SMALL, "--seed", "2", "--out", other, check=0)
    text = barchan("diff", whole, other, check=1).stdout
    for word in ("position", "radius", "grain ", "by "):
        assert word in text


def test_file_and_options_give_the_same_scene_and_bits(finished, tmp_path):
    whole, _ = finished
    out = tmp_path / "from-file"
    assert "is sound" in barchan("check", whole / "scene.toml", check=0).stdout
    barchan("run", whole / "scene.toml", "--threads", "1", "--out", out, check=0)
    assert json.loads((out / "record.json").read_text())["sittings"][0]["threads"] == 1
    assert barchan("diff", whole, out, check=0).stdout.strip() == "identical"
    parameters = (out / "scene.toml").read_text().split("[ran_with]")[0]
    assert parameters == (whole / "scene.toml").read_text().split("[ran_with]")[0]


def test_a_failing_run_saves_its_last_state(tmp_path):
    """A material so soft that the weight of the grains presses them together."""
    out = tmp_path / "soft"
    soft = ("--set", "kn=0.02N/m", "--set", "gamma_n=10", "--set", "gamma_t=10", "--equilibrate", "60ms")
    done = barchan("run", "avalanche", *SMALL, *soft, "--out", out, check=3)
    message = done.stderr.splitlines()[-1]
    for word in ("barchan: grain", "step", "overlap", "max_overlap", "last_state.h5"):
        assert word in message
    step = int(re.search(r"step (\d+)", message).group(1))
    state = read_state(out / "last_state.h5")
    assert 0 <= state.about["step"] - step <= 1 and not state.about["forces_are_current"]
    kept = [read_state(path).about["step"] for path in all_checkpoints(out / "checkpoints")]
    assert kept == [at for at in (400, 800, 1200, 1600, 2000, 2400) if at < step][-2:], "a failed state is none to resume from"
    assert json.loads((out / "record.json").read_text())["sittings"][0]["last_step"] == state.about["step"]
    log = (out / "log.txt").read_text()
    for line in (re.search(r"warning: step .* overlap by more than 5 %.*", done.stderr).group(0), message.split(": ", 1)[1]):
        assert line in log


def test_a_full_disk_ends_the_run_and_keeps_what_is_finished(tmp_path):
    """The system refuses files above 40 kB, as it does on a full disk: the first checkpoint does not fit."""
    limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))}
    done = barchan("run", "avalanche", *SMALL, "--out", tmp_path / "x", check=3, **limit)
    assert "cannot be written" in done.stderr.splitlines()[-1]
    assert not list((tmp_path / "x").rglob("*.partial"))


BAD = [
    (("--grains", "5.5"), "whole number"),
    (("--grains", "1"), "49 to"),
    (("--grains", "1000000000000"), "49 to"),
    (("--grains", "-5"), "49 to"),
    (("--angle", "nan"), "angle"),
    (("--angle", "31.2 mm"), "angle"),
    (("--duration", "-1"), "duration"),
    (("--duration", "1e300"), "duration"),
    (("--set", "radius_maks=1mm"), "radius_max"),
    (("--set", "radius_max=1.12"), "overlap"),
    (("--set", "radius_min=-1mm"), "radius_min"),
    (("--set", "radius_min=1.2mm"), "radius_max"),
    (("--set", "lattice=sc"), "overlap"),
    (("--set", "dt=1ms"), "stable"),
    (("--set", "width=0.3mm"), "period"),
    (("--set", "kn"), "="),
    (("--figure3", "--grains", "100"), "only one"),
    (("--angle", "7", "--set", "angle=6"), "twice"),
    (("--set", "dt=1e-320"), "dt"),
]


@pytest.mark.parametrize(("arguments", "word"), BAD, ids=[" ".join(case[0]) for case in BAD])
def test_bad_input_is_one_clear_line_and_leaves_nothing(arguments, word, tmp_path):
    small = () if "--grains" in arguments else ("--set", "coarse_graining=16")
    done = barchan("run", "avalanche", *small, *arguments, "--out", tmp_path / "x", check=2)
    lines = [line for line in done.stderr.strip().splitlines() if not line.startswith("first start on this machine")]
    assert lines[-1].startswith("barchan: ") and len(lines) == 1
    assert word in lines[-1]
    assert not (tmp_path / "x").exists(), "bad input leaves nothing behind"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("diff", "nothing-here", "nor-here"), "no checkpoint"),
        (("run", "avalanche", "--resume", "nothing-here"), "nothing to resume"),
        (("show", "nothing-here"), "scene.toml"),
        (("run", "nothing.toml"), "nothing.toml"),
        (("check", "nothing.toml"), "nothing.toml"),
    ],
)
def test_what_is_not_there_is_named(arguments, word):
    assert word in barchan(*arguments, check=2).stderr


def test_a_directory_with_a_run_is_refused(finished):
    whole, _ = finished
    assert "--resume" in barchan("run", "avalanche", *SMALL, "--out", whole, check=2).stderr


def test_a_directory_with_other_files_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("all of it")
    assert "other files" in barchan("run", "avalanche", *SMALL, "--out", tmp_path, check=2).stderr
    assert {entry.name for entry in tmp_path.iterdir()} <= {"thesis.tex", ".lock"}


def test_hidden_files_of_others_are_left_alone(tmp_path):
    """A refused run sweeps nothing away."""
    (tmp_path / ".notes.partial").write_text("mine")
    barchan("run", "avalanche", *SMALL, "--out", tmp_path, check=2)
    assert (tmp_path / ".notes.partial").read_text() == "mine"


def test_a_reader_that_goes_away_does_not_end_the_run(finished, tmp_path):
    whole, _ = finished
    process = start("run", "avalanche", *SMALL, "--out", tmp_path / "x")
    process.stderr.close()
    assert process.wait(timeout=200) == 0
    assert barchan("diff", whole, tmp_path / "x", check=0).stdout.strip() == "identical"


@pytest.mark.parametrize("damage", ["table", "checkpoints"])
def test_damage_is_named_before_a_resumed_run_takes_a_step(tmp_path, damage):
    out = tmp_path / "x"
    barchan("run", "avalanche", *SHORT, "--out", out, check=0)
    if damage == "table":
        path = out / "tables" / "time.csv"
        path.write_text(path.read_text().replace(",", ";", 100).replace(";", ",", 40))
    else:
        for path in all_checkpoints(out / "checkpoints"):
            path.write_bytes(path.read_bytes()[:-100])
    done = barchan("run", "avalanche", "--resume", out, "--duration", "0.03", check=2)
    assert ("time.csv" if damage == "table" else "no checkpoint") in done.stderr.splitlines()[-1]
    assert "steps/s" not in done.stderr


def test_show_of_damaged_results_is_one_line(finished, tmp_path):
    whole, _ = finished
    (tmp_path / "tables").mkdir()
    (tmp_path / "scene.toml").write_bytes((whole / "scene.toml").read_bytes())
    table = (whole / "tables" / "time.csv").read_text()
    (tmp_path / "tables" / "time.csv").write_text(table.replace("contacts", "kontakte"))
    assert "'contacts'" in barchan("show", tmp_path, check=2).stderr
    (tmp_path / "tables" / "time.csv").write_text(table.splitlines()[0] + "\n")
    assert "no row" in barchan("show", tmp_path, check=0).stdout or "shorter" in barchan("show", tmp_path, check=0).stdout


def test_a_cache_that_cannot_be_written_is_told_and_replaced():
    done = barchan("list", check=0, env=os.environ | {"BARCHAN_CACHE_DIR": "/dev/null/x"})
    assert "BARCHAN_CACHE_DIR" in done.stderr and "silbert" in done.stdout


def test_ctrl_c_before_a_run_has_begun_is_one_line(tmp_path):
    process = start("run", "avalanche", "--set", "coarse_graining=2", "--out", tmp_path / "x")
    time.sleep(1.5)
    process.send_signal(signal.SIGINT)
    text = process.communicate()[1]
    assert process.returncode == 130 and "Traceback" not in text
    assert "barchan: " in text.splitlines()[-1]


def test_a_directory_in_use_is_refused(finished):
    whole, _ = finished
    with open(whole / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = barchan("run", "avalanche", "--resume", whole, check=2)
    assert "in use" in done.stderr


def test_a_directory_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert "cannot be written" in barchan("run", "avalanche", *SMALL, "--out", tmp_path / "file" / "x", check=2).stderr


def test_the_list_names_experiments_and_laws():
    text = barchan("list", check=0).stdout
    for word in ("avalanche", "silbert", "hertz_mindlin"):
        assert word in text
