"""Arrays in huge pages are arrays like others."""

import gc

import numpy as np
import pytest

from barchan.memory import HUGE, LEAST, empty

pytestmark = pytest.mark.nojit


@pytest.mark.parametrize("dtype", [np.float64, np.uint32, np.uint8])
@pytest.mark.parametrize("count", [0, 1, 1000, LEAST - 1, LEAST, HUGE, 3 * HUGE + 5])
def test_shape_type_and_contents(dtype, count):
    array = empty((count, 3), dtype)
    assert array.shape == (count, 3) and array.dtype == dtype and array.flags.c_contiguous and array.flags.writeable
    array[...] = 7
    assert (array == 7).all()


@pytest.mark.skipif(not hasattr(__import__("mmap"), "MADV_HUGEPAGE"), reason="a system without huge pages")
def test_large_arrays_begin_at_a_huge_page():
    assert [empty((size,), np.uint8).ctypes.data % HUGE for size in (LEAST, HUGE, HUGE + 1)] == [0, 0, 0]


def test_memory_lives_as_long_as_any_view_of_it():
    view = empty((HUGE,), np.uint8)[10:20]
    view[:] = 5
    gc.collect()
    others = [empty((HUGE,), np.uint8) for _ in range(4)]
    for other in others:
        other[:] = 9
    assert view.tolist() == [5] * 10
