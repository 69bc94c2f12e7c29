"""The test of bonds leaves the same tables on any number of ranks, of which some share a pair."""

import pytest

from barchan.experiments.bond import BondTest, build, instruments, stages
from barchan.parallel import virtual_ranks

SCENE = {"tensile_strength": "145 kPa", "shear_strength": "194 kPa", "steps": 60, "table_steps": 5}


def run(directory):
    """Whether this rank had bonds with grains of others; the instruments write into ``directory``."""
    scene = BondTest.make(SCENE)
    sim = build(scene, threads=1)
    sim.writers = instruments(scene, directory)
    for stage in stages(scene):
        stage.begin(sim)
        shared = bool((sim.bonds.owners[:, 0] != sim.bonds.owners[:, 1]).any())
        sim.run(stage.end - sim.step_number)
    return shared


@pytest.mark.parametrize("ranks", [2, 4])
def test_ranks_change_no_byte(ranks, tmp_path):
    run(tmp_path / "alone")
    shared = virtual_ranks(ranks, run, tmp_path / "many")
    assert any(shared)
    for name in ("bonds.csv", "cracks.csv"):
        assert (tmp_path / "many" / "tables" / name).read_bytes() == (tmp_path / "alone" / "tables" / name).read_bytes()
    assert len((tmp_path / "alone" / "tables" / "cracks.csv").read_text().splitlines()) == 4
