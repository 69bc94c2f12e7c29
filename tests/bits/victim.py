"""A run that expects to be killed: victim.py SCENE GRAVITY DIRECTORY STEPS EVERY [WRITE]

It continues from the newest sound checkpoint in DIRECTORY, if there is one, and saves one every EVERY steps. With WRITE it
kills itself in the middle of that write: after the file has been filled, before it is renamed.
"""

import os
import signal
import sys
import warnings

import states

import barchan as bc
from barchan.checkpoint import Checkpoints, newest_sound, restore


def die_in_write(number):
    """Kill this process, as ``kill -9`` does, inside the ``number``-th write of a checkpoint."""
    real, count = os.fsync, 0

    def fsync(handle):
        nonlocal count
        count += 1
        if count == number:
            os.kill(os.getpid(), signal.SIGKILL)
        real(handle)

    os.fsync = fsync


def main(scene, gravity, directory, steps, every, write=0):
    warnings.simplefilter("ignore")
    path, _ = newest_sound(directory)
    sim = states.named(scene, with_grains=not path)
    sim.gravity = states.GRAVITY[gravity]
    if path:
        restore(sim, path)
    if write:
        die_in_write(int(write))
    checkpoints = Checkpoints(directory, bc.Every(int(every)))
    sim.writers.append(checkpoints)
    print("begun", sim.step_number, flush=True)
    sim.run(int(steps) - sim.step_number)
    checkpoints.write(sim)


if __name__ == "__main__":
    main(*sys.argv[1:])
