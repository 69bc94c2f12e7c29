"""Text files of numbers from outside: read as data, line by line; what is wrong is told with file and line."""

from pathlib import Path

import numpy as np

from barchan.errors import PackingError
from barchan.words import shown

#: Largest whole number up to which doubles hold all.
_MOST = 2.0**53


def wrong(path, line, text):
    """The error for what is wrong in a line of a file; lines count from 1."""
    return PackingError(f"packing {path}, line {line}: {text}")


def read_lines(path):
    """Lines of a text file, without their ends.

    Raises:
        PackingError: there is no such file, it cannot be read, or holds no text.
    """
    try:
        return Path(path).read_bytes().decode("utf-8-sig").splitlines()
    except OSError as error:
        raise PackingError(f"packing {path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise PackingError(
            f"packing {path} holds no text; it must be a file of one of the forms that read_packing names"
        ) from None


def table(path, rows, widths):
    """Numbers of rows of words.

    Args:
        rows: (number of the line, list of words) of each row.
        widths: how many words a row may have, ascending; of longer ones the first ``widths[0]`` are taken.

    Returns:
        (rows, widths[0]) doubles, all finite.

    Raises:
        PackingError: a row has another width, or something else than finite numbers.
    """
    values = np.empty((len(rows), widths[0]))
    for k, (line, words) in enumerate(rows):
        if len(words) not in widths:
            raise wrong(path, line, f"{len(words)} values, where there must be {' or '.join(map(str, widths))}")
        try:
            values[k] = [float(word) for word in words[: widths[0]]]
        except ValueError:
            raise wrong(path, line, f"{shown(' '.join(words))} holds something else than numbers") from None
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        line, words = rows[bad[0]]
        raise wrong(path, line, f"{shown(' '.join(words))} holds a number that is not finite")
    return values


def whole(path, lines, values, what, least):
    """Values as whole numbers of at least ``least``.

    Args:
        lines: (k,) number of the line of each.

    Raises:
        PackingError: one is no such number.
    """
    bad = np.flatnonzero((values != np.floor(values)) | (values < least) | (values > _MOST))
    if len(bad):
        raise wrong(path, lines[bad[0]], f"{what} = {values[bad[0]]:g} must be a whole number >= {least}")
    return values.astype(np.int64)
