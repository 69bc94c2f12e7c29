"""A code in a process of its own: started, asked, its memory read, ended whatever happens."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from barchan import atomic
from barchan.errors import RunError

#: Seconds after which a code that does not answer counts as hung.
TIMEOUT = 1800.0

#: Seconds that a code has to quit by itself.
PATIENCE = 5.0


class Code:
    """A running code; a context manager that leaves no process behind.

    Args:
        peer: a ``Peer`` that can be run.
        folder: of the case; the code gets a folder of its own in it.
        timeout: seconds for an answer.
    """

    def __init__(self, peer, folder, timeout=TIMEOUT):
        self.peer, self.timeout, self._number = peer, timeout, 0
        self.folder = Path(mkdtemp(prefix=f"{peer.name}-", dir=folder))
        (self.folder / "asker").write_text(str(os.getpid()))
        self._output = open(self.folder / "output.txt", "wb")
        self._process = subprocess.Popen(
            [*peer.command, str(self.folder)],
            env=os.environ | peer.environment,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is for the benchmark; it ends its codes
        )

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close(politely=kind is None)

    def ask(self, command, **arguments):
        """Send a command (see ``serving``); returns the answer.

        Raises:
            RunError: the code died, hung, or answered with an error.
        """
        self._send(command, arguments)
        path, began = self.folder / f"answer-{self._number}.json", time.monotonic()
        while not path.exists():
            if self._process.poll() is not None and not path.exists():
                raise RunError(f"died with status {self._process.returncode}{self._last_words()}")
            if time.monotonic() - began > self.timeout:
                raise RunError(f"gave no answer to '{command}' in {self.timeout:g} s")
            time.sleep(0.01)
        answer = json.loads(path.read_text(encoding="utf-8"))
        if "error" in answer:
            raise RunError(answer["error"])
        return answer

    def observe(self):
        """Positions and velocities of all grains: {"position", "velocity", "omega"}, (n, 3) each. Raises what ``ask`` does."""
        self.ask("observe")
        with np.load(self.folder / "seen.npz", allow_pickle=False) as seen:
            return {name: seen[name] for name in seen.files}

    def resident(self):
        """Memory of the process and of all it has started [bytes]; None where the system does not tell."""
        sizes = [_resident(pid) for pid in family(self._process.pid)]
        return sum(sizes) or None

    def close(self, politely=True):
        """End the code and all its ranks."""
        if politely and self._process.poll() is None:
            self._send("quit", {})
            try:
                self._process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                pass
        pids = family(self._process.pid) if self._process.poll() is None else []
        for end, pid in ((os.killpg, self._process.pid), *((os.kill, pid) for pid in pids)):
            try:
                end(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self._process.wait()
        self._output.close()

    def _send(self, command, arguments):
        self._number += 1
        with atomic.writing(self.folder / f"request-{self._number}.json") as partial:
            partial.write_text(json.dumps({"command": command} | arguments), encoding="utf-8")

    def _last_words(self):
        said = (self.folder / "output.txt").read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return f": {said[-1].strip()}" if said else ""


def family(pid):
    """A process and all its descendants, by /proc; only itself where there is none."""
    children = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:  # it has just ended
            continue
        children.setdefault(parent, []).append(int(path.parent.name))
    found = [pid]
    for one in found:
        found += children.get(one, [])
    return found


def _resident(pid):
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0
