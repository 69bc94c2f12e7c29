"""Eight rows side by side, in vectors that are written out: LLVM finds none in loops as short as a run of neighbours.

The vectors are LLVM's own, so they work on every processor, as one register or as several. (Measured at 1,000,000 grains: the
neighbour search takes a third less than with a vectorised loop over rows listed before.)
"""

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

#: Rows that are looked at together.
LANES = 8

_WORD, _INDEX = ir.IntType(64), ir.IntType(32)
_DOUBLES, _INDICES, _BYTES = (ir.VectorType(kind, LANES) for kind in (ir.DoubleType(), _INDEX, ir.IntType(8)))


def _chosen():
    """For each set of lanes, as bits of a number, those that are in it; then zeros."""
    table = np.zeros((1 << LANES, LANES), dtype=np.uint8)
    for bits, row in enumerate(table):
        lanes = [lane for lane in range(LANES) if bits >> lane & 1]
        row[: len(lanes)] = lanes
    return table.tobytes()


def _list_near(typing_context, seen, begin, over, at, period, row, looked, count):
    """The vectors of ``list_near``."""

    def generate(context, builder, signature, arguments):
        seen, begin, over, at, period, row, looked, count = arguments
        seen, looked = (context.make_array(signature.args[k])(context, builder, array) for k, array in ((0, seen), (6, looked)))

        def splat(number, vector):
            undefined = ir.Constant(vector, ir.Undefined)
            one = builder.insert_element(undefined, number, _INDEX(0))
            return builder.shuffle_vector(one, undefined, ir.Constant(_INDICES, [0] * LANES))

        def pointer(array, line, column, vector):
            place = builder.add(builder.mul(_WORD(line), builder.extract_value(array.shape, 1)), column)
            return builder.bitcast(builder.gep(array.data, [place]), vector.as_pointer())

        def coordinates(axis):
            return builder.load(pointer(seen, axis, begin, _DOUBLES), align=8)

        def smaller(a, b):
            return builder.select(builder.fcmp_ordered("<", a, b), a, b)

        square = splat(ir.Constant(ir.DoubleType(), 0.0), _DOUBLES)
        for axis in range(3):
            there, here = coordinates(axis), splat(builder.extract_value(at, axis), _DOUBLES)
            forth, back = builder.fsub(there, here), builder.fsub(here, there)
            distance = builder.select(builder.fcmp_ordered("<", forth, back), back, forth)
            distance = smaller(distance, builder.fsub(splat(builder.extract_value(period, axis), _DOUBLES), distance))
            square = builder.fadd(square, builder.fmul(distance, distance))
        reach = builder.fadd(coordinates(3), splat(builder.extract_value(at, 3), _DOUBLES))
        near = builder.bitcast(builder.fcmp_ordered("<", square, builder.fmul(reach, reach)), ir.IntType(LANES))
        near = builder.zext(near, _WORD)
        left = builder.sub(over, begin)
        left = builder.select(builder.icmp_unsigned("<", left, _WORD(LANES)), left, _WORD(LANES))
        near = builder.and_(near, builder.sub(builder.shl(_WORD(1), left), _WORD(1)))

        table = _chosen()
        table = cgutils.global_constant(
            builder, "chosen", ir.Constant(ir.ArrayType(_BYTES.element, len(table)), bytearray(table))
        )
        lanes = builder.gep(table, [_WORD(0), builder.mul(near, _WORD(LANES))])
        lanes = builder.zext(builder.load(builder.bitcast(lanes, _BYTES.as_pointer()), align=1), _INDICES)
        rows = builder.add(lanes, splat(builder.trunc(begin, _INDEX), _INDICES))
        builder.store(splat(builder.trunc(row, _INDEX), _INDICES), pointer(looked, 0, count, _INDICES), align=4)
        builder.store(rows, pointer(looked, 1, count, _INDICES), align=4)
        ones = builder.module.declare_intrinsic("llvm.ctpop", [_WORD])
        return builder.add(count, builder.call(ones, [near]))

    word = types.uint64
    places, periods = types.UniTuple(types.float64, 4), types.UniTuple(types.float64, 3)
    return word(seen, word, word, places, periods, word, looked, word), generate


def list_near(seen, begin, over, at, period, row, looked, count):
    """Append what is near among rows ``begin`` to ``over``, of which the first eight are looked at.

    Args:
        seen: (4, ...) coordinates and radii; eight columns from ``begin`` on have to exist.
        at: coordinates of a grain, and its radius and the skin: near is whose surface is closer than the skin.
        period: three periods, infinite where there is none.
        row: of the grain.
        looked: (2, ...) ``row`` and what is near, from column ``count`` on; eight columns have to exist.

    Returns the new ``count``.
    """
    over = min(over, begin + np.uint64(LANES))
    distance = np.abs(seen[:3, begin:over] - np.array(at[:3])[:, None])
    distance = np.minimum(distance, np.array(period)[:, None] - distance)
    near = np.flatnonzero((distance**2).sum(axis=0) < (seen[3, begin:over] + at[3]) ** 2)
    last = count + np.uint64(len(near))
    looked[0, count:last], looked[1, count:last] = row, begin + near.astype(np.uint64)
    return last


if not config.DISABLE_JIT:
    list_near = intrinsic(_list_near)
