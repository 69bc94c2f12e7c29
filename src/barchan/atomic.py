"""Files that are whole or not there: written under another name, renamed when complete."""

import hashlib
import io
import os
from contextlib import contextmanager
from pathlib import Path

import h5py


@contextmanager
def writing(path):
    """Write the file ``path`` so that whoever looks sees the old one or the new one, never a part.

    >>> with writing("scene.json") as partial:  # doctest: +SKIP
    ...     partial.write_text("{}")

    Args:
        path: the file to make; an older file of that name stays until the new one is complete and on the disk.

    Yields:
        The path to write to, beside ``path``. It is renamed when the block ends well, and removed when it does not.

    Raises:
        OSError: the operating system refuses.
    """
    path = Path(path)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        yield partial
        with open(partial, "r+b") as file:  # a rename must not reach the disk before what it names
            os.fsync(file.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


#: The first bytes of our HDF5 files, a block that HDF5 leaves to the user and every reader skips: how it begins, and its length.
_MAGIC, _HEAD = b"barchan: sha256 of what follows these 512 bytes: ", 512


@contextmanager
def writing_hdf5(path):
    """Write the HDF5 file ``path`` as ``writing`` does, with a checksum in its first bytes.

    The file is made in memory: where the disk is full, HDF5 itself fails when it closes the file, and takes the process down
    with a segmentation fault (HDF5 2.0, h5py 3.16).

    Yields:
        An open ``h5py.File``.

    Raises:
        OSError: the operating system refuses.
    """
    image = io.BytesIO()
    with h5py.File(image, "w", userblock_size=_HEAD) as file:
        yield file
    content = image.getbuffer()[_HEAD:]
    with writing(path) as partial, open(partial, "wb") as file:
        file.write(_head(hashlib.sha256(content)))
        file.write(content)


@contextmanager
def reading_hdf5(path):
    """Read a file that ``writing_hdf5`` wrote. It is opened only if its checksum is right: HDF5 can crash on damaged files.

    Yields:
        An open ``h5py.File``.

    Raises:
        ValueError: the file was cut or altered, or ``writing_hdf5`` did not write it.
        OSError: it cannot be read.
    """
    with open(path, "rb") as file:
        head, expected = file.read(_HEAD), _head(hashlib.file_digest(file, "sha256"))
    if head != expected:
        raise ValueError("its checksum is wrong" if head.startswith(_MAGIC) else "it does not begin as one")
    with h5py.File(path, "r") as file:
        yield file


def _head(digest):
    """The first bytes of a file whose other bytes have this digest."""
    return (_MAGIC + digest.hexdigest().encode()).ljust(_HEAD, b"\n")
