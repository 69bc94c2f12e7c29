"""A code's side of a benchmark: waits for commands as files, idle in between, and answers. Needs the standard library and NumPy.

Files, because no rank of an MPI program may wait inside MPI: it would spin on a core that another code is timed on. Every rank
reads the same requests; rank 0 answers.

An *engine* has ``rank``, ``version`` (text) and

- ``set_up(case, skin)``: start anew from the grains of a ``Case``; ``skin`` relative to the largest diameter;
- ``ghosts()``: grains of other ranks that this one has, each counted once; only of codes on several ranks;
- ``divide(ends, cells)``: search as a ``Division`` says; only of codes that are told;
- ``run(steps, forced)``: advance, rebuilding at every step if ``forced``; returns (seconds, rebuilds);
- ``observe()``: {"position", "velocity", "omega"}, (n, 3) each, in the order of the case's grains, at the full step. All ranks
  are asked; what rank 0 returns counts.
"""

import json
import os
import sys
import time
import traceback
from itertools import count
from pathlib import Path

import numpy as np

#: Seconds between looks for a request.
POLL = 0.01


def serve(engine, folder, load):
    """Answer requests ``request-1.json``, ``request-2.json``, ... in ``folder`` until told to quit, or the one who asks is gone.

    Args:
        engine: see above.
        load: function that returns the ``Case``; called for every set-up, so that an idle driver holds no grains.
    """
    folder = Path(folder)
    asker = int((folder / "asker").read_text())
    for number in count(1):
        request = _next_request(folder / f"request-{number}.json", asker)
        if request["command"] == "quit":
            return
        try:
            answer = COMMANDS[request.pop("command")](engine, load, folder, **request)
        except BaseException as error:
            _write(folder / f"answer-{number}.json", {"error": f"{type(error).__name__}: {' '.join(str(error).split())}"})
            traceback.print_exc()
            sys.exit(1)
        if engine.rank == 0:
            _write(folder / f"answer-{number}.json", answer)


def _start(engine, load, folder):
    """Two grains for two steps: afterwards all is loaded that does not grow with the grains."""
    case = load()
    engine.set_up(case.first(2), case.skins[0])
    engine.run(2, False)
    return {"version": engine.version}


def _set_up(engine, load, folder, skin):
    engine.set_up(load(), skin)
    return {}


def _divide(engine, load, folder, ends, cells):
    engine.divide(ends, cells)
    return {}


def _run(engine, load, folder, steps, forced):
    seconds, rebuilds = engine.run(steps, forced)
    return {"seconds": seconds, "rebuilds": rebuilds}


def _ghosts(engine, load, folder):
    return {"ghosts": engine.ghosts()}


def _observe(engine, load, folder):
    seen = engine.observe()
    if engine.rank == 0:
        np.savez(folder / "seen.npz", **seen)
    return {}


#: What can be asked for.
COMMANDS = {"start": _start, "set_up": _set_up, "divide": _divide, "run": _run, "ghosts": _ghosts, "observe": _observe}


def _next_request(path, asker):
    while not path.exists():
        time.sleep(POLL)
        try:
            os.kill(asker, 0)
        except ProcessLookupError:
            return {"command": "quit"}
    return json.loads(path.read_text(encoding="utf-8"))


def _write(path, answer):
    partial = path.with_suffix(f".{os.getpid()}")
    partial.write_text(json.dumps(answer), encoding="utf-8")
    os.replace(partial, path)
