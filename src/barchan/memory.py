"""Large arrays in huge pages: a step reads some twenty arrays side by side, more pages of 4 kB than a processor keeps track of
(measured at 32,000 grains: chute 1.59 ms a step to 1.50, dense 2.80 to 2.71)."""

import mmap

import numpy as np

#: Bytes of a huge page, and of the smallest array that gets some.
HUGE, LEAST = 1 << 21, 1 << 18


def empty(shape, dtype=np.float64):
    """An uninitialised array, contiguous, like ``numpy.empty``."""
    count = int(np.prod(shape, dtype=np.int64))
    size = count * np.dtype(dtype).itemsize
    if size < LEAST or not hasattr(mmap, "MADV_HUGEPAGE"):
        return np.empty(shape, dtype)
    pages = mmap.mmap(-1, -(-size // HUGE) * HUGE + HUGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    try:
        pages.madvise(mmap.MADV_HUGEPAGE)
    except OSError:  # a kernel without them
        return np.empty(shape, dtype)
    memory = np.frombuffer(pages, dtype=np.uint8)
    begin = -memory.ctypes.data % HUGE
    return memory[begin : begin + size].view(dtype).reshape(shape)
