"""Grains as a table of comma-separated values with a line of column names on top, from any spreadsheet or program."""

from barchan.errors import PackingError
from barchan.packing.lines import read_lines, table, wrong
from barchan.packing.packing import check_names, packing_of

#: Columns that are read; others are left alone.
_KNOWN = ("id", "x", "y", "z", "radius", "diameter", "material", "type", "vx", "vy", "vz")


def read_csv(path):
    """Read columns x, y, z, radius or diameter, and perhaps id, material (from 0) or type (from 1), vx, vy, vz.

    Returns:
        A ``Packing`` without a box.

    Raises:
        PackingError: the file is no such file, or damaged.
    """
    filled = [(number, line) for number, line in enumerate(read_lines(path), 1) if line.strip()]
    if not filled:
        raise PackingError(f"packing {path} is empty; it must begin with column names, such as x,y,z,radius")
    (first, head), *lines = filled
    names = [name.strip().strip('"') for name in head.split(",")]
    check_names(path, first, names)
    wanted, rows = [k for k, name in enumerate(names) if name in _KNOWN], []
    for number, line in lines:
        words = line.split(",")
        if len(words) != len(names):
            raise wrong(path, number, f"{len(words)} values for {len(names)} columns")
        rows.append((number, [words[k].strip() for k in wanted]))
    columns = dict(zip([names[k] for k in wanted], table(path, rows, (len(wanted),)).T))
    return packing_of(path, [number for number, _ in rows], columns, None)
