"""Grains that crossed into another rank's part of space move there, with all their fields and remembered contacts."""

import numpy as np

from barchan.errors import LostGrainError
from barchan.neighbors.rows import ContactRows
from barchan.parallel.message import Reader, pack


def migrate(comm, topology, grains, rows):
    """Send every owned grain to its owner.

    Args:
        grains: ``Grains`` without ghosts; modified.
        rows: ``ContactRows`` of its grains.

    Returns:
        The rows of the grains that are owned now.

    Raises:
        LostGrainError: the number of grains over all ranks has changed.
    """
    if comm.size == 1:
        return rows
    before = int(comm.sum([grains.n])[0])
    owner = topology.owner(grains.view("position"))
    messages = {}
    for rank in np.unique(owner[owner != comm.rank]):
        leaving = np.flatnonzero(owner == rank)
        part = rows.take(leaving)
        header = np.array([len(leaving), len(part.keys)], dtype=np.int64)
        blocks = [grains.block(name)[leaving] for name in grains.block_names]
        messages[int(rank)] = pack([header, np.diff(part.start), part.keys, part.values, *blocks])
    staying = np.flatnonzero(owner == comm.rank)
    parts = [rows.take(staying)]
    grains.keep(staying)
    received = comm.exchange(messages)
    for source in sorted(received):
        reader = Reader(received[source])
        count, n_rows = (int(v) for v in reader.take(np.int64, 2))
        counts = reader.take(np.int64, count)
        keys, values = reader.take(np.int64, n_rows), reader.take(np.float64, (n_rows, rows.values.shape[1]))
        parts.append(ContactRows(np.concatenate([[0], np.cumsum(counts)]), keys, values))
        grains.append_rows({name: _take_block(reader, grains, name, count) for name in grains.block_names}, count)
    after = int(comm.sum([grains.n])[0])
    if after != before:
        raise LostGrainError(f"{before} grains before the migration, {after} after it: an error of barchan, please report it")
    return ContactRows.join(parts)


def _take_block(reader, grains, name, count):
    example = grains.block(name)
    return reader.take(example.dtype, (count, *example.shape[1:]))
