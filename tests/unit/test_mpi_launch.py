"""What users meet who start several processes: errors that end all, launchers that do not fit, the command."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from barchan.checkpoint import all_checkpoints
from barchan.compare import differences, last_state

HERE = Path(__file__).parent
MPIEXEC = Path(sys.executable).with_name("mpiexec")

#: Seconds after which a program that should have ended hangs; some compile all kernels first, on a busy machine for a minute.
LIMIT = 180


def launch(*command, ranks=2, **environment):
    """Run a program on some ranks; all of them end, or this fails."""
    began = time.monotonic()
    done = subprocess.run(
        [str(MPIEXEC), "-n", str(ranks), sys.executable, *command],
        capture_output=True,
        text=True,
        timeout=LIMIT,
        env={**os.environ, **environment},
    )
    return done, time.monotonic() - began


def program(what, *arguments, **options):
    return launch(str(HERE / "launched.py"), what, *map(str, arguments), **options)


@pytest.mark.parametrize(
    ("phase", "message"),
    [
        ("before", "a mistake before the first step"),
        ("scene", "radius = -1"),
        ("action", "a mistake in an action"),
        ("writer", "a mistake in an action"),
        ("force", "is not finite"),
        ("rebuild", "a mistake in an action"),
        ("ghosts", "a mistake in an action"),
        ("disk", "No space left on device"),
    ],
)
def test_an_error_on_one_rank_ends_all_with_one_message_that_names_it(phase, message, tmp_path):
    done, _ = program(phase, tmp_path)
    assert done.returncode != 0 and "went on" not in done.stdout
    assert done.stderr.count(" failed\n") == 1 and "barchan: rank 1 of 2 failed" in done.stderr, done.stderr
    assert message in done.stderr
    assert not list(tmp_path.rglob("*.h5"))


def test_ctrl_c_while_the_first_rank_draws_figures_ends_all(tmp_path):
    done, _ = program("drawing", tmp_path)
    assert done.returncode != 0 and "went on" not in done.stdout
    assert done.stderr.count("interrupted; what was written is whole") >= 1 and "rank 0 of 2 failed" in done.stderr


def test_a_killed_rank_leaves_checkpoints_from_which_any_number_of_ranks_goes_on(tmp_path):
    done, _ = program("die", tmp_path / "cut")
    assert done.returncode != 0 and len(all_checkpoints(tmp_path / "cut")) == 2
    done, _ = program("die", tmp_path / "cut", ranks=3)
    assert done.returncode == 0, done.stderr
    subprocess.run([sys.executable, str(HERE / "launched.py"), "die", str(tmp_path / "whole")], check=True, timeout=LIMIT)
    assert differences(last_state(tmp_path / "cut"), last_state(tmp_path / "whole")) == []
    assert [path.name for path in all_checkpoints(tmp_path / "cut")][-1] == "checkpoint_000000000080.h5"


def test_processes_that_find_each_other_are_one_world():
    done, _ = program("world", ranks=3)
    assert sorted(done.stdout.split("\n")[:3]) == ["0 of 3", "1 of 3", "2 of 3"]


def test_without_mpi4py_several_processes_are_refused(tmp_path):
    """Otherwise each would take itself for the only one, and all would write the same files."""
    (tmp_path / "mpi4py.py").write_text("raise ImportError('no module')")
    done, _ = program("world", PYTHONPATH=f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    assert done.returncode != 0 and "mpi4py is not installed" in done.stderr and "pip install 'barchan[mpi]'" in done.stderr


def test_without_an_mpi_library_several_processes_are_refused():
    done, _ = program("world", MPI4PY_LIBMPI="/nowhere/libmpi.so")
    assert done.returncode != 0 and "finds no MPI library" in done.stderr


def test_a_launcher_of_another_mpi_is_told(tmp_path):
    """As Open MPI's mpiexec with the wheel of MPICH: every process believes that it is alone."""
    done = subprocess.run(
        [sys.executable, str(HERE / "launched.py"), "world"],
        capture_output=True,
        text=True,
        timeout=LIMIT,
        env={**os.environ, "OMPI_COMM_WORLD_SIZE": "4"},
    )
    assert done.returncode != 0 and "MPI sees 1" in done.stderr and "mpiexec that belongs to it" in done.stderr


def test_the_command_runs_on_several_ranks_and_speaks_with_one_voice(tmp_path):
    few = ["--grains", "400", "--duration", "10ms", "--equilibrate", "5ms", "--set", "frame_every=5ms"]
    one = [sys.executable, "-m", "barchan", "run", "avalanche", *few, "--out", str(tmp_path / "one")]
    subprocess.run(one, check=True, capture_output=True, timeout=LIMIT)
    done, _ = launch("-m", "barchan", "run", "avalanche", *few, "--out", str(tmp_path / "four"), ranks=4)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("starting in") == 1 and done.stderr.count("results:") == 1
    for path in sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file()):
        if path.parts[0] in ("frames", "tables", "checkpoints"):
            assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "four" / path).read_bytes(), path
    done, _ = launch("-m", "barchan", "run", "avalanche", *few, "--out", str(tmp_path / "one"))
    assert done.returncode == 2 and done.stderr.count("already holds a run") == 1
    done, _ = launch("-m", "barchan", "run", "avalanche", "--angle", "200")
    assert done.returncode == 2 and done.stderr.count("barchan: angle") <= 1


@pytest.mark.validate
def test_one_process_of_a_node_compiles_and_tells_how_much(tmp_path):
    done, _ = launch(
        *("-m", "barchan", "run", "avalanche", "--grains", "400", "--duration", "1ms", "--equilibrate", "1ms"),
        *("--out", str(tmp_path / "run")),
        BARCHAN_CACHE_DIR=str(tmp_path / "cache"),
    )
    assert done.returncode == 0, done.stderr
    told = re.findall(r"compiling for law 'silbert': \w+ \((\d+) of at most (\d+)\)", done.stderr)
    assert told[-1][0] == told[-1][1] and len(told) == int(told[-1][1])
