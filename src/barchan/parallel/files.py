"""HDF5 files that all ranks write together, each its own part: nobody ever holds the whole.

Rank 0 lays the file out without its numbers: where each array will be. Then all ranks write their rows there. What is read by
others is an ordinary HDF5 file; its first bytes, which HDF5 leaves to the user, hold a checksum of all that follows, made of
blocks that the ranks share, too.
"""

import hashlib
import io
import os
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from barchan.parallel.comm import Serial
from barchan.parallel.guard import on_first_rank, raise_together

#: How the first bytes begin, and how many there are; bytes that are hashed at a time.
_MAGIC, _HEAD, _BLOCK = b"barchan: sha256 of the sha256 of each 16 MiB of what follows these 512 bytes: ", 512, 1 << 24


class Array(NamedTuple):
    """An array of the file: ``shape`` over all ranks, of the type ``dtype``."""

    dtype: np.dtype
    shape: tuple


class SharedFile:
    """A file that is being written."""

    def __init__(self, path, arrays, offsets):
        self._arrays, self._offsets, self.failure, self._file = arrays, offsets, None, None
        try:
            self._file = open(path, "r+b", buffering=0)
        except OSError as error:
            self.failure = error

    def put(self, name, begin, rows):
        """Write ``rows`` of the array ``name`` from its row ``begin`` on. A failure is told at the end, to all ranks."""
        try:
            if self.failure is None:
                self._put(self._arrays[name], name, begin, rows)
        except OSError as error:
            self.failure = error

    def _put(self, array, name, begin, rows):
        content = memoryview(np.ascontiguousarray(rows, dtype=array.dtype)).cast("B") if len(rows) else b""
        at = (self._offsets[name] or 0) + begin * array.dtype.itemsize * int(np.prod(array.shape[1:], dtype=np.int64))
        while len(content):
            written = os.pwrite(self._file.fileno(), content, at)
            content, at = content[written:], at + written

    def close(self):
        """Bring all to the disk."""
        try:
            if self._file:
                os.fsync(self._file.fileno())
                self._file.close()
        except OSError as error:
            self.failure = self.failure or error


@contextmanager
def writing_hdf5(comm, path, arrays, attributes):
    """Write the HDF5 file ``path`` together, so that whoever looks sees the old one or the new one, never a part.

    Args:
        arrays: name -> ``Array``, the same on all ranks.
        attributes: name of a group -> name -> value; those of rank 0 count.

    Yields:
        A ``SharedFile``; each rank puts its rows.

    Raises:
        OSError: the operating system refuses, on any rank (RankError on the others).
    """
    path = Path(path)
    with _partial(comm, path) as partial:
        offsets = on_first_rank(comm, lambda: _lay_out(partial, arrays, attributes))
        file = SharedFile(partial, arrays, offsets)
        yield file
        file.close()
        raise_together(comm, file.failure)
        digest = checksum(comm, partial)
        on_first_rank(comm, lambda: _finish(partial, path, digest))


def _finish(partial, path, digest):
    with open(partial, "r+b") as file:  # a rename must not reach the disk before what it names
        file.write(_head(digest))
        file.flush()
        os.fsync(file.fileno())
    os.replace(partial, path)


def checksum(comm, path):
    """Digest of all that follows the first bytes of a file; each rank reads a part, all must call this.

    Raises:
        OSError: it cannot be read on some rank.
    """
    digests, failure = [], None
    try:
        size = max(os.path.getsize(path) - _HEAD, 0)
        with open(path, "rb") as file:
            for begin in range(comm.rank * _BLOCK, size, comm.size * _BLOCK):
                file.seek(_HEAD + begin)
                digests.append(hashlib.sha256(file.read(_BLOCK)).digest())
    except OSError as error:
        failure = error.errno, error.strerror
    parts = comm.all_gather((digests, failure))
    for rank, (_, failure) in enumerate(parts):
        if failure:
            raise OSError(failure[0], f"{failure[1]} (on rank {rank})" if comm.size > 1 else failure[1])
    return hashlib.sha256(b"".join(parts[k % comm.size][0][k // comm.size] for k in range(-(-size // _BLOCK)))).hexdigest()


def check(comm, path):
    """Refuse a file that ``writing_hdf5`` did not write or that was changed since: HDF5 can crash on damaged files. All ranks
    must call this, before they open it.

    Raises:
        ValueError: the file was cut or altered, or is another.
        OSError: it cannot be read.
    """
    expected = _head(checksum(comm, path))
    with open(path, "rb") as file:
        head = file.read(_HEAD)
    if head != expected:
        raise ValueError("its checksum is wrong" if head.startswith(_MAGIC) else "it does not begin as one")


@contextmanager
def reading_hdf5(path):
    """Read a whole file that ``writing_hdf5`` wrote. Yields an open ``h5py.File``; raises what ``check`` does."""
    check(Serial(), path)
    with h5py.File(path, "r") as file:
        yield file


def write_bytes(comm, path, content):
    """Write the bytes that each rank gives, one after another, as one file; raises what ``writing_hdf5`` does."""
    path, begin, total = Path(path), int(comm.before([len(content)])[0]), int(comm.sum([len(content)])[0])
    with _partial(comm, path) as partial:
        on_first_rank(comm, lambda: _Holes(total).write_to(partial))
        file = SharedFile(partial, {"": Array(np.dtype(np.uint8), (total,))}, {"": 0})
        file.put("", begin, np.frombuffer(content, dtype=np.uint8))
        file.close()
        raise_together(comm, file.failure)
        on_first_rank(comm, lambda: os.replace(partial, path))


@contextmanager
def _partial(comm, path):
    """Another name for a file that is not complete; it is removed if nobody renames it."""
    partial = path.with_name(f".{path.name}.{comm.from_first(os.getpid())}.partial")
    try:
        yield partial
    finally:
        if comm.rank == 0:
            partial.unlink(missing_ok=True)


def _head(digest):
    """The first bytes of a file whose other bytes have this digest."""
    return (_MAGIC + digest.encode()).ljust(_HEAD, b"\n")


def _lay_out(path, arrays, attributes):
    """Make the file with its arrays, but without the numbers in them; returns where each begins, None if it is empty."""
    image = _Holes()
    with h5py.File(image, "w", userblock_size=_HEAD) as file:
        spaces = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        spaces.set_layout(h5py.h5d.CONTIGUOUS)
        spaces.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        spaces.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        spaces.set_obj_track_times(False)  # the same file whenever it is written
        links = h5py.h5p.create(h5py.h5p.LINK_CREATE)
        links.set_create_intermediate_group(True)
        for name, array in arrays.items():
            kind, extent = h5py.h5t.py_create(array.dtype, logical=True), h5py.h5s.create_simple(array.shape)
            h5py.h5d.create(file.id, name.encode(), kind, extent, dcpl=spaces, lcpl=links)
        for group, values in attributes.items():
            for name, value in values.items():
                file.require_group(group).attrs[name] = value
        offsets = {name: file[name].id.get_offset() for name in arrays}
    image.write_to(path)
    return offsets


class _Holes(io.RawIOBase):
    """A file in memory that keeps only what was written, so that room for arrays takes none. The file itself is written by
    us: where the disk is full, HDF5 fails when it closes a file, and takes the process down (HDF5 2.0, h5py 3.16)."""

    def __init__(self, size=0):
        self._pieces, self._at, self._size = [], 0, size

    def write(self, data):
        """Keep a piece."""
        piece = bytes(data)
        self._pieces.append((self._at, piece))
        self._at += len(piece)
        self._size = max(self._size, self._at)
        return len(piece)

    def readinto(self, buffer):
        """What was written, zeros elsewhere."""
        count = max(min(len(buffer), self._size - self._at), 0)
        seen = bytearray(count)
        for begin, piece in self._pieces:
            first, last = max(begin, self._at), min(begin + len(piece), self._at + count)
            if first < last:
                seen[first - self._at : last - self._at] = piece[first - begin : last - begin]
        buffer[:count] = seen
        self._at += count
        return count

    def seek(self, offset, whence=os.SEEK_SET):
        """Go to a place."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        return self._at

    def tell(self):
        """Where it is."""
        return self._at

    def truncate(self, size=None):
        """Set the length."""
        self._size = self._at if size is None else size
        return self._size

    def readable(self):
        """Yes."""
        return True

    def writable(self):
        """Yes."""
        return True

    def seekable(self):
        """Yes."""
        return True

    def write_to(self, path):
        """Make the real file, with holes."""
        with open(path, "wb") as file:
            for begin, piece in self._pieces:
                file.seek(begin)
                file.write(piece[: max(self._size - begin, 0)])
            file.truncate(self._size)
