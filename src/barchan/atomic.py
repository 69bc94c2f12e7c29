"""Files that are whole or not there: written under another name, renamed when complete."""

import os
from contextlib import contextmanager
from pathlib import Path


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
