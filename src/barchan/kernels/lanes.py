"""Eight rows side by side, in vectors that are written out: LLVM finds none in loops as short as a run of neighbours, or in those
that list what they find.

The vectors are LLVM's own, so they work on every little-endian processor, as one register or as several. (Measured: the neighbour
search takes 3.0 ms instead of 4.3 with a vectorised loop over rows listed before.) What lies beside the rows asked for is read,
and sometimes written as it was: it has to exist, and must not be another thread's. Without compilation the functions below run
as they stand.
"""

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

#: Rows that are looked at together; the tables and shuffles below are made for this number.
LANES = 8

#: Of each axis: along which others an image beyond a face lies aside, and the number of that tilt.
ASIDE = ((), ((0, 0),), ((0, 1), (1, 2)))

_WORD, _INDEX, _BYTE, _DOUBLE = ir.IntType(64), ir.IntType(32), ir.IntType(8), ir.DoubleType()
_DOUBLES, _INDICES, _BYTES = (ir.VectorType(kind, LANES) for kind in (_DOUBLE, _INDEX, _BYTE))
_ALIGNED = {_DOUBLES: 8, _INDICES: 4}


def _tables():
    """For each set of lanes, as bits of a number: those that are in it, then zeros; and for each lane its place in the set, from
    1 on, 0 if it is not in it."""
    chosen, rank = np.zeros((2, 1 << LANES, LANES), dtype=np.uint8)
    for bits in range(1 << LANES):
        lanes = [lane for lane in range(LANES) if bits >> lane & 1]
        chosen[bits, : len(lanes)] = lanes
        rank[bits, lanes] = np.arange(1, len(lanes) + 1)
    return chosen.tobytes(), rank.tobytes()


CHOSEN, RANK = _tables()


class _Vectors:
    """What the intrinsics below are put together from."""

    def __init__(self, context, builder, signature):
        self.context, self.builder, self.types = context, builder, signature.args

    def array(self, number, value):
        """Argument ``number``, an array."""
        return self.context.make_array(self.types[number])(self.context, self.builder, value)

    def splat(self, number, vector):
        undefined = ir.Constant(vector, ir.Undefined)
        one = self.builder.insert_element(undefined, number, _INDEX(0))
        return self.builder.shuffle_vector(one, undefined, ir.Constant(_INDICES, [0] * LANES))

    def indices(self, number):
        """A row or a column in all lanes."""
        return self.splat(self.builder.trunc(number, _INDEX), _INDICES)

    def _pointer(self, array, line, column, vector):
        builder = self.builder
        if line is not None:
            column = builder.add(builder.mul(_WORD(line), builder.extract_value(array.shape, 1)), column)
        return builder.bitcast(builder.gep(array.data, [column]), vector.as_pointer())

    def load(self, array, line, column, vector):
        """Eight neighbours in a line of an array, or among all its numbers if ``line`` is None."""
        return self.builder.load(self._pointer(array, line, column, vector), align=_ALIGNED[vector])

    def store(self, value, array, line, column):
        self.builder.store(value, self._pointer(array, line, column, value.type), align=_ALIGNED[value.type])

    def bits(self, truths):
        """A set of lanes as a number."""
        return self.builder.zext(self.builder.bitcast(truths, ir.IntType(LANES)), _WORD)

    def lanes_before(self, begin, over):
        """The set of those lanes that lie before ``over``."""
        left = self.builder.sub(over, begin)
        left = self.builder.select(self.builder.icmp_unsigned("<", left, _WORD(LANES)), left, _WORD(LANES))
        return self.builder.sub(self.builder.shl(_WORD(1), left), _WORD(1))

    def looked_up(self, name, table, bits):
        """The entries of one of the tables for a set."""
        constant = ir.Constant(ir.ArrayType(_BYTE, len(table)), bytearray(table))
        table = cgutils.global_constant(self.builder, name, constant)
        entries = self.builder.gep(table, [_WORD(0), self.builder.mul(bits, _WORD(LANES))])
        return self.builder.zext(self.builder.load(self.builder.bitcast(entries, _BYTES.as_pointer()), align=1), _INDICES)

    def append(self, bits, begin, array, line, count):
        """Write ``begin`` and the lanes of a set, added, into a line of ``array`` from ``count`` on."""
        self.store(self.builder.add(self.looked_up("chosen", CHOSEN, bits), self.indices(begin)), array, line, count)

    def count(self, bits):
        return self.builder.call(self.builder.module.declare_intrinsic("llvm.ctpop", [_WORD]), [bits])

    def mixed(self, a, b, lanes):
        return self.builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_INDEX, LANES), list(lanes)))

    def rows_of_four(self, array, rows):
        """Eight rows of four numbers: those of lane k, and then those of lane k + 4."""
        builder, four = self.builder, ir.VectorType(_DOUBLE, 4)

        def row(lane):
            place = builder.zext(builder.extract_element(rows, _INDEX(lane)), _WORD)
            return builder.load(self._pointer(array, None, builder.mul(place, _WORD(4)), four), align=8)

        return [self.mixed(row(lane), row(lane + 4), range(LANES)) for lane in range(4)]

    def columns_of_four(self, rows):
        """The same eight rows as four vectors, one of each column."""
        even, odd = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)
        low, high = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
        halves = [(self.mixed(*rows[:2], lanes), self.mixed(*rows[2:], lanes)) for lanes in (even, odd)]
        return [self.mixed(*half, lanes) for lanes in (low, high) for half in halves]


def _list_near(typing_context, seen, begin, over, at, period, row, looked, count):
    """The vectors of ``list_near``."""

    def generate(context, builder, signature, arguments):
        seen, begin, over, at, period, row, looked, count = arguments
        vectors = _Vectors(context, builder, signature)
        seen, looked = vectors.array(0, seen), vectors.array(6, looked)

        def smaller(a, b):
            return builder.select(builder.fcmp_ordered("<", a, b), a, b)

        square = vectors.splat(_DOUBLE(0.0), _DOUBLES)
        for axis in range(3):
            there = vectors.load(seen, axis, begin, _DOUBLES)
            here, length = (vectors.splat(builder.extract_value(three, axis), _DOUBLES) for three in (at, period))
            forth, back = builder.fsub(there, here), builder.fsub(here, there)
            distance = builder.select(builder.fcmp_ordered("<", forth, back), back, forth)
            distance = smaller(distance, builder.fsub(length, distance))
            square = builder.fadd(square, builder.fmul(distance, distance))
        own = vectors.splat(builder.extract_value(at, 3), _DOUBLES)
        reach = builder.fadd(vectors.load(seen, 3, begin, _DOUBLES), own)
        near = vectors.bits(builder.fcmp_ordered("<", square, builder.fmul(reach, reach)))
        near = builder.and_(near, vectors.lanes_before(begin, over))
        vectors.store(vectors.indices(row), looked, 0, count)
        vectors.append(near, begin, looked, 1, count)
        return builder.add(count, vectors.count(near))

    word = types.uint64
    places, periods = types.UniTuple(types.float64, 4), types.UniTuple(types.float64, 3)
    return word(seen, word, word, places, periods, word, looked, word), generate


def list_near(seen, begin, over, at, period, row, looked, count):
    """Append what is near among rows ``begin`` to ``over``, of which the first eight are looked at.

    Args:
        seen: (4, ...) coordinates and radii; eight columns from ``begin`` on have to exist.
        at: coordinates of a grain, and its radius and a reach: near is whose surface is closer than that.
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


def _list_touching(_, first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found):
    """The vectors of ``list_touching``."""
    return _touching(first, second, place, slot, rows, branch, False)


def _list_touching_aside(_, first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found):
    """The vectors of ``list_touching_aside``."""
    return _touching(first, second, place, slot, rows, branch, True)


def _touching(first, second, place, slot, rows, branch, tilted):
    """The vectors of both."""

    def generate(context, builder, signature, arguments):
        first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found = arguments
        vectors = _Vectors(context, builder, signature)
        first, second, place = (vectors.array(k, array) for k, array in enumerate((first, second, place)))
        slot, rows, branch = vectors.array(8, slot), vectors.array(11, rows), vectors.array(12, branch)
        count, news, before = (builder.extract_value(found, k) for k in range(3))

        valid = vectors.lanes_before(begin, over)
        is_valid = builder.bitcast(builder.trunc(valid, ir.IntType(LANES)), ir.VectorType(ir.IntType(1), LANES))
        none = ir.Constant(_INDICES, [0] * LANES)
        i, j = (builder.select(is_valid, vectors.load(array, None, begin, _INDICES), none) for array in (first, second))
        is_radius = ir.Constant(ir.VectorType(ir.IntType(1), LANES), [0, 0, 0, 1] * 2)
        rows_of_both = zip(vectors.rows_of_four(place, i), vectors.rows_of_four(place, j))
        both = [builder.select(is_radius, builder.fadd(a, b), builder.fsub(a, b)) for a, b in rows_of_both]
        *branches, reach = vectors.columns_of_four(both)
        for axis in (2, 1, 0):
            length, half = (vectors.splat(builder.extract_value(three, axis), _DOUBLES) for three in (lengths, halves))
            above = builder.fcmp_ordered(">", branches[axis], half)
            below = builder.fcmp_ordered("<", branches[axis], builder.fneg(half))
            aside = ASIDE[axis] if tilted else ()
            aside = [(flow, vectors.splat(builder.extract_value(tilts, k), _DOUBLES)) for flow, k in aside]
            for moved, shift in ((axis, length), *aside):
                d = builder.select(above, builder.fsub(branches[moved], shift), branches[moved])
                branches[moved] = builder.select(below, builder.fadd(d, shift), d)
        square = None
        for axis, d in enumerate(branches):
            vectors.store(d, branch, axis, b)
            part = builder.fmul(d, d)
            square = part if square is None else builder.fadd(square, part)
        touch = builder.and_(vectors.bits(builder.fcmp_ordered("<", square, builder.fmul(reach, reach))), valid)

        old = vectors.load(slot, None, begin, _INDICES)
        rank = vectors.looked_up("rank", RANK, touch)
        columns = builder.add(rank, vectors.indices(builder.sub(builder.add(column, count), _WORD(1))))
        columns = builder.select(builder.icmp_unsigned("!=", rank, none), columns, none)
        vectors.store(builder.select(is_valid, columns, old), slot, None, begin)
        vectors.append(touch, b, rows, 0, count)
        touched = builder.and_(vectors.bits(builder.icmp_unsigned("!=", old, none)), valid)
        rank = vectors.looked_up("rank", RANK, touched)
        columns = builder.add(rank, vectors.indices(builder.add(builder.sub(begin, b), before)))
        vectors.store(builder.select(builder.icmp_unsigned("!=", rank, none), columns, none), rows, 1, b)
        turned = builder.xor(touch, touched)
        vectors.append(turned, b, rows, 2, news)
        totals = zip((count, news, before), (touch, turned, touched))
        totals = [builder.add(total, vectors.count(lanes)) for total, lanes in totals]
        return context.make_tuple(builder, signature.return_type, totals)

    word, threes = types.uint64, types.UniTuple(types.float64, 3)
    counts = types.UniTuple(word, 3)
    arguments = (first, second, place, word, word, threes, threes, threes, slot, word, word, rows, branch, counts)
    return counts(*arguments), generate


def list_touching_aside(first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found):
    """List what touches among the pairs ``begin`` to ``over``, of which the first eight are looked at.

    Args:
        first, second: rows of the pairs; eight from ``begin`` on have to exist in memory.
        place: (n, 4) coordinates and radii.
        lengths, halves, tilts: of the box, three numbers each; the halves are infinite where it has no period.
        slot: like ``first``; becomes ``column`` and the number of those that touch before, or 0.
        b: what the pair ``begin`` is called in ``rows`` and ``branch``, its place in a block; the next is ``b`` + 1.
        rows: (3, ...) those that touch, by appending; the column of the memory of each, or 0, at its ``b``; those that touch and
            did not or did and do not touch, by appending.
        branch: (3, ...) from the second to the first, nearest images, at ``b``.
        found: how many of the block touch, began or ended, and touched before, so far.

    Returns the new ``found``.
    """
    over = min(over, begin + np.uint64(LANES))
    some, at = slice(begin, over), slice(b, b + over - begin)
    d = (place[first[some], :3] - place[second[some], :3]).T
    for axis in (2, 1, 0):
        above, below = d[axis] > halves[axis], d[axis] < -halves[axis]
        for moved, shift in ((axis, lengths[axis]), *((flow, tilts[k]) for flow, k in ASIDE[axis])):
            d[moved] = np.where(above, d[moved] - shift, d[moved])
            d[moved] = np.where(below, d[moved] + shift, d[moved])
    branch[:, at] = d
    reach = place[first[some], 3] + place[second[some], 3]
    touch = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < reach * reach
    touched = slot[some] != 0
    rows[1, at] = np.where(touched, int(begin - b) + int(found[2]) + np.cumsum(touched), 0)
    lists = np.flatnonzero(touch), np.flatnonzero(touch != touched), np.flatnonzero(touched)
    counts = [count + np.uint64(len(lanes)) for count, lanes in zip(found, lists)]
    for line, count, lanes in zip((0, 2), found, lists):
        rows[line, count : count + np.uint64(len(lanes))] = lanes + int(b)
    slot[some] = np.where(touch, int(column) + int(found[0]) + np.cumsum(touch) - 1, 0)
    return tuple(counts)


def list_touching(first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found):
    """The same, if the box has no tilts."""
    return list_touching_aside(first, second, place, begin, over, lengths, halves, tilts, slot, column, b, rows, branch, found)


if not config.DISABLE_JIT:
    list_near, list_touching = intrinsic(_list_near), intrinsic(_list_touching)
    list_touching_aside = intrinsic(_list_touching_aside)
