"""How kernels are compiled and where the machine code is kept.

Numba's disk cache does not notice an edited callee in another module, so the cache directory carries a hash of all kernel
sources. It is set only while a kernel is being declared: a user's own compiled functions keep their own cache.
"""

import hashlib
import os
import sys
import tempfile
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import FunctionType

import numba
import numpy as np
from llvmlite import ir
from numba import config, njit, prange, types
from numba.core import event
from numba.extending import intrinsic

__all__ = ["announced", "cache_root", "helper", "kernel", "on_one_thread", "piece", "prange", "use_threads", "widest_lanes"]

_HERE = Path(__file__).parent

# Threads that wait between two loops spin for a moment, then sleep. Sleeping at once costs 0.6 ms a step (measured, two threads:
# 8,000 grains 1.0 ms against 0.46, 32,000 grains 2.2 against 1.6); spinning without end makes a step 9 times slower beside
# another program on the same cores, where this moment costs nothing. Read by OpenMP when its library is loaded.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ["OMP_WAIT_POLICY"] = "passive"
    os.environ.setdefault("GOMP_SPINCOUNT", "20000")

# Numba would take TBB where the system has it, whose threads spin (seen beside two other programs: 5 steps a second, not 90).
if "NUMBA_THREADING_LAYER_PRIORITY" not in os.environ:
    config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]


def cache_root():
    """Directory of everything compiled: ``$BARCHAN_CACHE_DIR`` or the user's cache directory."""
    chosen = os.environ.get("BARCHAN_CACHE_DIR")
    return _usable(chosen or os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "barchan"))


@lru_cache
def _usable(root):
    """The directory ``root``, or a temporary one where ``root`` cannot be written."""
    try:
        os.makedirs(root, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            return Path(root)
    except OSError as error:
        other = tempfile.mkdtemp(prefix="barchan-")
        print(
            f"barchan: compiled code cannot be kept in {root} ({error.strerror}); it goes to {other}, and the next start "
            f"compiles again. Set BARCHAN_CACHE_DIR to a directory that can be written",
            file=sys.stderr,
        )
        return Path(other)


@lru_cache(maxsize=1)
def fingerprint():
    """Hash of the kernels' sources, of Numba's version and of its switches."""
    digest = hashlib.sha256(f"{numba.__version__} {config.BOUNDSCHECK}".encode())
    for path in sorted(_HERE.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@contextmanager
def _own_cache():
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_root() / fingerprint())
    try:
        yield
    finally:
        config.CACHE_DIR = before


def kernel(parallel=False):
    """Decorator: compile a loop over arrays, kept on disk. Division by zero gives inf, as on the processor."""

    def decorate(function):
        with _own_cache():
            return njit(cache=True, error_model="numpy", nogil=True, parallel=parallel)(function)

    return decorate


def on_one_thread(parallel_kernel):
    """A kernel compiled once more, as plain loops: for few grains, where waking threads would take longer than the work.

    It gets a name of its own, since Numba's disk cache would take it for the other one.
    """
    if config.DISABLE_JIT:
        return parallel_kernel
    function = parallel_kernel.py_func
    name = f"{function.__name__}_alone"
    code = function.__code__.replace(co_name=name, co_qualname=name)
    copy = FunctionType(code, function.__globals__, name)
    copy.__module__, copy.__doc__ = function.__module__, function.__doc__
    return kernel()(copy)


def helper(function):
    """Decorator: a small function on numbers, inlined into the kernels that call it."""
    return njit(error_model="numpy", forceinline=True)(function)


def piece(function):
    """Decorator: a piece of a kernel that is given arrays or tuples of them, inlined. Who holds an array is not counted in it, as
    nothing is made or freed there (counted, contacts with meshes take four times as long)."""
    return njit(error_model="numpy", forceinline=True, _nrt=False)(function)


def subroutine(function):
    """Decorator: a larger function that kernels call; inlined into each it would be compiled as often."""
    return njit(error_model="numpy")(function)


def _widest_lanes(typing_context):
    """Called in the body of a loop: the function around it may use the widest vectors of the processor, and its arrays do not
    overlap. LLVM stays at 256 bits on processors that have 512 (measured with 512: the loop over pairs of ``hertz_standard``
    takes 1.27 ms instead of 1.65). Of arrays Numba says that they do not overlap in parallel loops only; without it nothing
    is vectorised."""

    def generate(context, builder, signature, arguments):
        # llvmlite's own ``add`` knows only attributes without a value
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        for argument in builder.function.args:
            if isinstance(argument.type, ir.PointerType) and argument.type.pointee != ir.IntType(8):  # not of shared counters
                argument.add_attribute("noalias")
        return context.get_dummy_value()

    return types.void(), generate


widest_lanes = (lambda: None) if config.DISABLE_JIT else intrinsic(_widest_lanes)


#: Grains that one thread should have before another is worth waking (a parallel call on 64 contacts: 5 us on 1 thread,
#: 67 us on 2).
GRAINS_PER_THREAD = 2000


def use_threads(wanted, n_grains):
    """Set the threads of the following kernels: ``wanted``, or fewer when there is too little work for them."""
    useful = max(1, min(wanted, n_grains // GRAINS_PER_THREAD, config.NUMBA_NUM_THREADS))
    numba.set_num_threads(useful)
    return useful


def shares(count):
    """Where the share of each thread of ``count`` things begins, (threads + 1,): for kernels that have room for each thread."""
    threads = numba.get_num_threads()
    return np.arange(threads + 1, dtype=np.uint64) * np.uint64(count) // np.uint64(threads)


def default_threads(processes=1):
    """Threads that this process may use, if ``processes`` of one program share the cores of this machine."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    bound = allowed < (os.cpu_count() or 1)  # to cores of its own, by who started it
    return max(1, min(config.NUMBA_NUM_THREADS, allowed // (1 if bound else processes)))


#: Kernels of a scene that starts with an empty cache, and those that only several ranks, bonds and meshes need.
_KERNELS, _OF_RANKS, _OF_BONDS, _OF_MESHES = 42, 4, 5, 9


class _Kernels(event.Listener):
    """Tells of each kernel that Numba begins to compile."""

    def __init__(self, title, announce, most):
        self.title, self.announce, self.most, self.count = title, announce, most, 0

    def on_start(self, event):
        """A function is about to be compiled; kernels are those that are kept on disk."""
        dispatcher = event.data["dispatcher"]
        if dispatcher.targetoptions.get("nogil"):
            self.count += 1
            self.announce(f"{self.title}: {dispatcher.py_func.__name__} ({self.count} of at most {self.most})")

    def on_end(self, event):
        """Nothing to tell."""


@contextmanager
def announced(title, announce, several_ranks=False, bonds=False, meshes=False):
    """While this lasts, ``announce`` is called with a line of text for each kernel that has to be compiled."""
    most = _KERNELS + _OF_RANKS * several_ranks + _OF_BONDS * bonds + _OF_MESHES * meshes
    listener = _Kernels(title, announce, most)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
