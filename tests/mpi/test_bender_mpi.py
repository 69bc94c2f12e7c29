"""A sample that is pressed and shaken leaves the same files on processes of MPI as on one."""

from pathlib import Path

import pytest
from staged import files, run
from test_bender_bits import SCENE

from barchan.experiments.bender import BENDER
from barchan.parallel import virtual_ranks


@pytest.mark.validate
def test_the_bender_leaves_the_same_files(comm, tmp_path):
    shared = Path(comm.all_gather(str(tmp_path))[0]) / "shared"
    run(BENDER, SCENE, shared, 1)
    virtual_ranks(1, run, BENDER, SCENE, tmp_path / "alone", 1)
    comm.all_gather(None)
    assert files(shared) == files(tmp_path / "alone")
    assert any(name.startswith("frames") for name in files(shared))
