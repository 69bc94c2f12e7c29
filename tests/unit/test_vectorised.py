"""Every shipped law runs in vector lanes: asserted on the machine code."""

import re

import llvmlite.binding
import pytest

import barchan as bc
from barchan.testing import machine_code, packed_square_roots

#: Laws of which every loop is looked at in every commit, and those of which one is; the others at full size.
EACH_LOOP = (bc.laws.jkr,)
ONE_LOOP = (bc.laws.linear, bc.laws.hertz_mindlin, bc.laws.hertz_mindlin_rolling, bc.laws.dmt)


def loops():
    """Law, whether it is for one material, and whether for few grains."""
    for law in bc.laws.SHIPPED.values():
        for uniform in (True, False):
            for alone in (False, True):
                later = law not in EACH_LOOP and not (law in ONE_LOOP and uniform and not alone)
                name = f"{law.name}-{'one material' if uniform else 'several materials'}-{'few grains' if alone else 'threads'}"
                yield pytest.param(law, uniform, alone, id=name, marks=[pytest.mark.validate] if later else [])


@pytest.mark.parametrize(("law", "uniform", "alone"), loops())
def test_the_loop_has_packed_square_roots(law, uniform, alone):
    assert packed_square_roots(law, uniform, alone) > 0


@pytest.mark.skipif(not llvmlite.binding.get_host_cpu_features().get("avx512f"), reason="a processor without 512-bit lanes")
def test_the_loop_uses_lanes_of_512_bits_where_there_are_some():
    assert re.findall(r"vsqrtpd\s.*%zmm", machine_code(bc.laws.SHIPPED["hertz"]))


def test_a_loop_that_is_not_vectorised_is_noticed():
    """A law with a loop of its own cannot be put into lanes."""

    @bc.law(properties={"kn": "force/length"})
    def iterates(overlap, kn):
        total = 0.0
        depth = overlap
        while depth > 1e-9:
            total += kn * depth
            depth *= 0.5
        return total, (0.0, 0.0, 0.0)

    assert packed_square_roots(iterates) == 0
