"""Messages between ranks from compiled code: a call of Python would take longer than a step of a few thousand grains does.

What goes where is laid down beforehand in persistent requests of MPI (``parallel.wire``); in each step they are started and
waited for, by the addresses of MPI's own functions. Those take and return nothing but whole numbers and places in memory, which
are the same in every MPI library.
"""

import ctypes
from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

from barchan.kernels.compiler import helper

#: Numbers of which all ranks learn the largest at a time; those of a grain that its ghosts need in every step.
NUMBERS, GHOST = 8, 9

#: Places in ``watch``: [time].
SINCE, WAITED, OWN, SLOWEST, WAITING = range(5)


class Wire(NamedTuple):
    """The lines of one rank to others, and what travels on them.

    ``start``, ``wait``, ``clock``: addresses of MPI_Startall, MPI_Waitall and MPI_Wtime. ``requests``: (n, bytes) of the ghosts'
    messages, from ``sent`` (m, GHOST), which are the grains ``rows`` (m,), and into ``received`` (ghosts, GHOST). ``rounds``:
    (rounds, 2, bytes) of those from ``told`` (rounds, NUMBERS) and into ``heard``, none on one rank. ``statuses``: room for what
    MPI says. ``numbers``: (NUMBERS,) that all ranks have to agree on. ``watch``: times of this rank, by the names above.
    """

    start: np.uint64
    wait: np.uint64
    clock: np.uint64
    requests: np.ndarray
    rows: np.ndarray
    sent: np.ndarray
    received: np.ndarray
    rounds: np.ndarray
    told: np.ndarray
    heard: np.ndarray
    statuses: np.ndarray
    numbers: np.ndarray
    watch: np.ndarray


def unconnected():
    """The wire of a rank that is alone."""
    none = np.uint64(0)
    nobody, nothing = np.zeros((0, 1), np.uint8), np.zeros((2, 0, GHOST))
    rounds = (np.zeros((0, 2, 1), np.uint8), *np.zeros((2, 0, NUMBERS)))
    rest = (np.zeros(1, np.uint8), np.zeros(NUMBERS), np.zeros(5))
    return Wire(none, none, none, nobody, np.zeros(0, np.int64), *nothing, *rounds, *rest)


def _called(result, *parameters):
    """An intrinsic that calls the function at an address: its code, given what makes the arguments out of the arrays."""
    kind = ir.FunctionType(result, parameters)

    def generate(context, builder, signature, arguments):
        address, *arrays = arguments
        made = []
        for given, array in zip(signature.args[1:], arrays):
            array = context.make_array(given)(context, builder, array)
            if not made:
                made.append(builder.trunc(builder.extract_value(array.shape, 0), ir.IntType(32)))
            made.append(builder.bitcast(array.data, ir.IntType(8).as_pointer()))
        answer = builder.call(builder.inttoptr(address, kind.as_pointer()), made)
        return answer if isinstance(result, ir.DoubleType) else builder.sext(answer, ir.IntType(64))

    return generate


_INT, _PLACE = ir.IntType(32), ir.IntType(8).as_pointer()


def _start_all(typing_context, address, requests):
    return types.int64(types.uint64, requests), _called(_INT, _INT, _PLACE)


def _wait_all(typing_context, address, requests, statuses):
    return types.int64(types.uint64, requests, statuses), _called(_INT, _INT, _PLACE, _PLACE)


def _seconds(typing_context, address):
    return types.float64(types.uint64), _called(ir.DoubleType())


def start_all(address, requests):
    """MPI_Startall of the ``requests``."""
    return ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_void_p)(int(address))(len(requests), requests.ctypes.data)


def wait_all(address, requests, statuses):
    """MPI_Waitall of the ``requests``."""
    call = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(int(address))
    return call(len(requests), requests.ctypes.data, statuses.ctypes.data)


def seconds(address):
    """MPI_Wtime."""
    return ctypes.CFUNCTYPE(ctypes.c_double)(int(address))()


if not config.DISABLE_JIT:
    start_all, wait_all, seconds = intrinsic(_start_all), intrinsic(_wait_all), intrinsic(_seconds)


@helper
def largest_of_all(wire):
    """``numbers`` become the largest that any rank has. In round k each tells the rank 2^k further what it knows: a maximum may
    count a rank twice, so log2 of the ranks rounds, rounded up, do for any number of them."""
    for k in range(wire.rounds.shape[0]):
        wire.told[k, :] = wire.numbers
        start_all(wire.start, wire.rounds[k])
        wait_all(wire.wait, wire.rounds[k], wire.statuses)
        for c in range(NUMBERS):
            wire.numbers[c] = max(wire.numbers[c], wire.heard[k, c])


@helper
def start_watch(wire):
    """Begin to count what this rank computes and waits for."""
    wire.watch[:] = 0.0
    if wire.rounds.shape[0] > 0:
        wire.watch[SINCE] = seconds(wire.clock)


@helper
def agree(wire, speed, stops):
    """The largest speed on any rank, and whether any stops."""
    if wire.rounds.shape[0] == 0:
        return speed, stops
    watch = wire.watch
    now = seconds(wire.clock)
    own = now - watch[SINCE] - watch[WAITED]
    wire.numbers[0], wire.numbers[1], wire.numbers[2] = speed, 1.0 if stops else 0.0, own
    largest_of_all(wire)
    watch[OWN] += own
    watch[SLOWEST] += wire.numbers[2]
    watch[SINCE] = seconds(wire.clock)
    watch[WAITING] += watch[WAITED] + watch[SINCE] - now
    watch[WAITED] = 0.0
    return wire.numbers[0], wire.numbers[1] > 0.0


@helper
def send_ghosts(wire, place, motion, spin):
    """Send the grains that others have as ghosts."""
    for q in range(wire.rows.shape[0]):
        i = wire.rows[q]
        for c in range(3):
            wire.sent[q, c], wire.sent[q, 3 + c], wire.sent[q, 6 + c] = place[i, c], motion[i, c], spin[i, c]
    start_all(wire.start, wire.requests)


@helper
def receive_ghosts(wire, n_owned, place, motion, spin):
    """Wait for the ghosts, and write them behind the ``n_owned`` grains."""
    begin = seconds(wire.clock)
    wait_all(wire.wait, wire.requests, wire.statuses)
    wire.watch[WAITED] += seconds(wire.clock) - begin
    for q in range(wire.received.shape[0]):
        i = n_owned + q
        for c in range(3):
            place[i, c], motion[i, c], spin[i, c] = wire.received[q, c], wire.received[q, 3 + c], wire.received[q, 6 + c]
