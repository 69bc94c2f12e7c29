"""Arrays by their addresses, for compiled code that goes through things of which there may be any number, with arrays of any
length each: passed on as arrays, every number of them would be a function of its own to compile."""

import ctypes

from numba import carray, config, types
from numba.extending import intrinsic

from barchan.kernels.compiler import helper


def _pointer(typing_context, address):
    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(address), generate


def pointer(address):
    """A place in memory."""
    return ctypes.c_void_p(int(address))


if not config.DISABLE_JIT:
    pointer = intrinsic(_pointer)


def whereabouts(array):
    """Address and rows of an array that lies in one piece; it must live on while somebody uses them.

    Raises:
        ValueError: it does not lie in one piece.
    """
    if not array.flags.c_contiguous:
        raise ValueError(f"an array with strides {array.strides} does not lie in one piece, and cannot be told by its address")
    return array.ctypes.data, len(array)


@helper
def array_at(where, shape, kind):
    """The array that lies there.

    Args:
        where: what ``whereabouts`` returned, as an array.
        shape: of one row.
        kind: of its numbers.
    """
    return carray(pointer(where[0]), (where[1],) + shape, kind)  # noqa: RUF005, Numba joins tuples so
