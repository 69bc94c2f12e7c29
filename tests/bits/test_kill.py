"""kill -9 at any moment, then resume: the run ends with the bits of one that was never disturbed."""

import random
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest
import states

import barchan as bc
from barchan.checkpoint import all_checkpoints, collect
from barchan.compare import differences, last_state

VICTIM = Path(__file__).with_name("victim.py")
STEPS, EVERY = 1500, 100


def start(scene, gravity, directory, *more):
    command = [sys.executable, str(VICTIM), scene, gravity, str(directory), str(STEPS), str(EVERY), *map(str, more)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


#: Those of every commit: a memory of each kind, and both ways of making steps. The others at full size.
ALWAYS = [("silbert", "turning"), ("jkr", "turning"), ("hertz_mindlin_rolling", "turning"), ("hertz_mindlin", "steady")]
ALWAYS += [("bonded", "turning"), ("sheared", "turning")]

CASES = [
    pytest.param(scene, gravity, marks=[] if (scene, gravity) in ALWAYS else [pytest.mark.validate])
    for scene in (*bc.laws.SHIPPED, "bonded", "sheared")
    for gravity in (("turning", "steady") if scene == "hertz_mindlin" else ("turning",))
]


@pytest.mark.parametrize("scene, gravity", CASES)
def test_killed_runs_end_with_the_same_bits(scene, gravity, tmp_path):
    """Each law, bonds, and a box that is sheared, are killed three times: at two random moments of the run and once inside the
    write of a checkpoint, on a dense state (see test_same_bits), also while many steps are made in one call."""
    moments = random.Random(scene)
    kills = 0
    for _ in range(2):
        victim = start(scene, gravity, tmp_path)
        begun = int(victim.stdout.readline().split()[1])
        assert begun < STEPS, "it must still have steps to go when it is killed"
        time.sleep(moments.uniform(0.0, 0.12))
        victim.kill()
        kills += victim.wait() == -signal.SIGKILL
    before = [path.name for path in all_checkpoints(tmp_path)]
    victim = start(scene, gravity, tmp_path, 2)
    kills += victim.wait() == -signal.SIGKILL
    victim.stdout.close()
    assert kills == 3, "all three were killed before they had ended"
    assert list(tmp_path.glob(".checkpoint_*.partial")), "the last one died with a half-written checkpoint"
    assert len(all_checkpoints(tmp_path)) >= min(len(before), 1)
    assert start(scene, gravity, tmp_path).wait() == 0

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        undisturbed = states.named(scene)
        undisturbed.gravity = states.GRAVITY[gravity]
        undisturbed.run(STEPS)
    assert differences(collect(undisturbed), last_state(tmp_path)) == []
