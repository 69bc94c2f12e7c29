"""A sample that is pressed and shaken leaves the same files on any number of threads and ranks, and stopped in any stage."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from staged import files, run

from barchan.checkpoint import all_checkpoints
from barchan.compare import differences, last_state
from barchan.experiments.bender import BENDER, Bender, build
from barchan.experiments.bender.setup import mark
from barchan.parallel import virtual_ranks
from barchan.writers import read_table

#: Few grains, shaken before they rest.
SCENE = {
    "across": 4,
    "along": 10,
    "press": "0.3 ms",
    "hold": "30 us",
    "settle": "15 us",
    "rest": "15 us",
    "listen": "30 us",
    "spacing": "1 mm",
    "shear_frequency": "80 kHz",
    "compression_frequency": "80 kHz",
    "pulse_stress": "1 kPa",
    "signal_every": "0.6 us",
    "patch": "0.1 mm",
}

#: While it is pressed, held, and shaken.
PRESSED, HELD = Bender.make(SCENE).prepared
STOPS = (PRESSED // 2 + 3, (PRESSED + HELD) // 2 + 3, Bender.make(SCENE).shots[1].begin + 20)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    run(BENDER, SCENE, out, 1)
    return files(out)


@pytest.mark.parametrize(("threads", "ranks", "stop"), [(2, 1, None), (1, 2, None), *((1, 1, stop) for stop in STOPS)])
def test_threads_ranks_and_a_stop_change_no_byte(alone, tmp_path, threads, ranks, stop):
    virtual_ranks(ranks, run, BENDER, SCENE, tmp_path, threads, stop)
    assert files(tmp_path) == alone
    signals, pulses = (read_table(tmp_path / "tables" / f"{name}.csv") for name in ("signals", "pulses"))
    assert (signals["velocity [m/s]"] != 0.0).all() and (pulses["coordination"] > 1.0).all()


def test_one_grain_is_shaken_wherever_ranks_share_the_layer():
    """The nearest to the axis of all: here two ranks meet in the middle of the layer."""

    def shaken():
        scene = Bender.make(SCENE)
        sim = build(scene, threads=1)
        mark(sim, scene)
        layer = np.abs(sim.grains.position[:, 2]) < 0.5 * scene.diameter
        return layer.sum(), sim.grains.id[sim.grains.view("push") > 0.0].tolist()

    (_, alone), *_ = virtual_ranks(1, shaken)
    (here, one), (there, other) = virtual_ranks(2, shaken)
    assert here and there and one + other == alone and len(alone) == 1


def last_step(directory):
    """Of the newest checkpoint of a run; 0 without one."""
    paths = all_checkpoints(directory / "checkpoints") if (directory / "checkpoints").exists() else []
    return max((int(path.stem.split("_")[1]) for path in paths), default=0)


@pytest.mark.validate
def test_a_run_that_is_killed_ends_with_the_same_bits(tmp_path):
    """By the command, kill -9 while it is pressed and while it is shaken; then it goes on."""
    settings = (word for name, value in SCENE.items() for word in ("--set", f"{name}={value}"))
    command = [sys.executable, "-m", "barchan", "run", "bender", "--threads", "1"]
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    start = [*command, *settings, "--checkpoint-every", "20"]
    subprocess.run([*start, "--out", whole], check=True, capture_output=True)
    goes_on = [*start, "--out", killed]
    for stop in (PRESSED // 2, STOPS[-1]):
        process = subprocess.Popen(goes_on, stdout=subprocess.DEVNULL)
        while process.poll() is None and last_step(killed) < stop:
            time.sleep(2e-3)
        process.kill()
        assert process.wait() == -signal.SIGKILL, "it had steps to go"
        goes_on = [*command, "--checkpoint-every", "20", "--resume", killed]
        assert last_step(killed) < Bender.make(SCENE).shots[-1].rested
    subprocess.run(goes_on, check=True, capture_output=True)
    assert differences(last_state(whole), last_state(killed)) == []
    for name in ("tables", "frames"):
        assert files(whole / name) == files(killed / name)
