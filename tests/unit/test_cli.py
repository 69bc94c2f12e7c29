"""The command: runs, resumes, compares, and says what is wrong in one line."""

import re
import subprocess
import sys

import pytest

from barchan.checkpoint import all_checkpoints

SMALL = ("--grains", "300", "--equilibrate", "0.004", "--duration", "0.006", "--checkpoint-every", "400")


def barchan(*arguments, check=None):
    done = subprocess.run(
        [sys.executable, "-m", "barchan.cli", *map(str, arguments)], capture_output=True, text=True, timeout=300
    )
    if check is not None:
        assert done.returncode == check, done.stderr
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A small avalanche that ran in one go."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    done = barchan("run", "avalanche", *SMALL, "--out", out, check=0)
    return out, done.stderr


def test_the_avalanche_shows_progress_and_a_summary(finished):
    _, text = finished
    shortest = int(re.search(r"shortest (\d+)", text).group(1))
    bound = float(re.search(r"equation \(13\) allows ([\d.]+)", text).group(1))
    assert shortest >= int(bound), "equation (13) is a lower bound on the interval between rebuilds"
    for word in ("equilibrate", "flow", "100 %", "grain-steps/s", "left", "rebuilds", "equation (13)"):
        assert word in text


def test_an_interrupted_run_resumes_to_the_same_bits(finished, tmp_path):
    """Killed at whatever moment, even before its first checkpoint, then continued."""
    whole, _ = finished
    out = tmp_path / "broken"
    process = subprocess.Popen(
        [sys.executable, "-m", "barchan.cli", "run", "avalanche", *SMALL, "--out", str(out)], stderr=subprocess.DEVNULL
    )
    while not (out / "scene.json").exists():
        assert process.poll() is None
    process.kill()
    process.wait()
    assert all_checkpoints(out / "checkpoints") == []
    barchan("run", "avalanche", "--resume", out, check=0)
    assert barchan("diff", whole, out, check=0).stdout.strip() == "identical"


def test_diff_names_what_differs(finished, tmp_path):
    whole, _ = finished
    other = tmp_path / "other"
    barchan("run", "avalanche", *SMALL, "--seed", "2", "--out", other, check=0)
    text = barchan("diff", whole, other, check=1).stdout
    for word in ("position", "radius", "grain ", "by "):
        assert word in text


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("run", "avalanche", "--grains", "5"), ("grains", "20")),
        (("run", "avalanche", "--angle", "nan"), ("angle", "finite")),
        (("run", "avalanche", "--duration", "-1"), ("duration", "greater than or equal to 0")),
        (("diff", "nothing-here", "nor-here"), ("no checkpoint",)),
        (("run", "avalanche", "--resume", "nothing-here"), ("nothing to resume",)),
    ],
)
def test_bad_input_is_one_clear_line(arguments, words, tmp_path):
    more = ("--out", tmp_path / "x") if "avalanche" in arguments and "--resume" not in arguments else ()
    done = barchan(*arguments, *more, check=2)
    assert done.stderr.startswith("barchan: ") and done.stderr.count("\n") == 1
    for word in words:
        assert word in done.stderr
    assert not (tmp_path / "x").exists(), "bad input leaves nothing behind"


def test_a_directory_with_a_run_is_refused(finished):
    whole, _ = finished
    done = barchan("run", "avalanche", *SMALL, "--out", whole, check=2)
    assert "--resume" in done.stderr


def test_a_directory_in_use_is_refused(finished, tmp_path):
    import fcntl

    whole, _ = finished
    with open(whole / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = barchan("run", "avalanche", "--resume", whole, check=2)
    assert "in use" in done.stderr


def test_a_directory_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert "cannot be written" in barchan("run", "avalanche", *SMALL, "--out", tmp_path / "file" / "x", check=2).stderr
