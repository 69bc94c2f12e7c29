"""Grains in a region are taken out and counted, on any number of ranks."""

import numpy as np
import pytest
from scenes import pile

from barchan.actions import remove_where
from barchan.errors import SceneError
from barchan.parallel import virtual_ranks

REGIONS = {
    "above": lambda p: p[:, 2] > 2.0,
    "brick": lambda p: ((p > (1, 1, 0)) & (p < (4, 5, 3))).all(axis=1),
    "outside a cylinder": lambda p: (p[:, 0] - 3) ** 2 + (p[:, 1] - 3) ** 2 > 2.0**2,
    "nowhere": lambda p: p[:, 2] > 99.0,
}


@pytest.mark.parametrize("name", REGIONS)
@pytest.mark.parametrize("ranks", [1, 3])
def test_number_and_mass_of_what_is_in_a_region(name, ranks):
    def program():
        sim = pile()
        removed = remove_where(sim, REGIONS[name])
        left = sim.grains.view("id").tolist()
        sim.run(2)
        return removed, left

    whole = pile().grains
    gone = REGIONS[name](whole.sorted_by_id("position"))
    assert gone.any() == (name != "nowhere") and not gone.all()
    results = virtual_ranks(ranks, program)
    assert sorted(id for _, left in results for id in left) == np.flatnonzero(~gone).tolist()
    for removed, _ in results:
        assert removed == results[0][0] and removed.grains == gone.sum()
        assert removed.mass == pytest.approx(whole.sorted_by_id("mass")[gone].sum(), rel=1e-13)


@pytest.mark.parametrize("region", [lambda p: p, lambda p: True, lambda p: np.arange(len(p)), lambda p: p[:-1, 0] > 0])
def test_a_region_that_gives_no_mask_is_refused(region):
    with pytest.raises(SceneError, match="must return a boolean for each"):
        remove_where(pile(), region)
