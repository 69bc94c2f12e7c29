"""Text dump files of LAMMPS, LIGGGHTS and ``barchan.writers.LammpsDump``: https://docs.lammps.org/dump.html."""

import numpy as np

from barchan.errors import PackingError
from barchan.packing.lines import read_lines, table, whole, wrong
from barchan.packing.packing import box_of, check_names, packing_of

#: Places that do not end at periodic faces are as good as those that do: they are folded into the box when grains are added.
_SAME = {"xu": "x", "yu": "y", "zu": "z"}


def read_lammps_dump(path):
    """Read the last frame, with its box: columns x y z (or xu yu zu), radius or diameter, perhaps id, type, vx vy vz.

    Returns:
        A ``Packing``.

    Raises:
        PackingError: the file is no such file, or damaged.
    """
    items = _last_frame(path, read_lines(path))
    for name in ("NUMBER OF ATOMS", "BOX BOUNDS", "ATOMS"):
        if name not in items:
            raise PackingError(f"packing {path}: its last frame has no 'ITEM: {name}'; it is no dump file of LAMMPS, or cut")
    line, _, rows = items["NUMBER OF ATOMS"]
    count = int(whole(path, [line], table(path, rows[:1] or [(line, [])], (1,))[0], "number of atoms", 0)[0])
    line, names, rows = items["ATOMS"]
    names = [_SAME.get(name, name) for name in names]
    check_names(path, line, names)
    if len(rows) != count:
        raise wrong(path, line, f"{len(rows)} rows follow, but the frame announces {count} atoms; the file is cut or altered")
    return packing_of(path, [number for number, _ in rows], _columns(path, names, rows), _box(path, *items["BOX BOUNDS"]))


def _last_frame(path, lines):
    """Name of an item of the last frame -> (line number, words behind the name, rows)."""
    frame, rows = {}, []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:1] == ["ITEM:"]:
            said = " ".join(words[1:])
            name = next((name for name in ("NUMBER OF ATOMS", "BOX BOUNDS") if said.startswith(name)), said.partition(" ")[0])
            frame = {} if "ATOMS" in frame else frame
            rows = []
            frame[name] = (number, words[1 + len(name.split()) :], rows)
        elif words:
            rows.append((number, words))
    return frame


def _columns(path, names, rows):
    """Column name -> values; of those that are read, since others may be text."""
    wanted = [k for k, name in enumerate(names) if name in ("id", "type", "x", "y", "z", "radius", "diameter", "vx", "vy", "vz")]
    for number, words in rows:
        if len(words) != len(names):
            raise wrong(path, number, f"{len(words)} values for {len(names)} columns")
    values = table(path, [(number, [words[k] for k in wanted]) for number, words in rows], (len(wanted),))
    return dict(zip([names[k] for k in wanted], np.ascontiguousarray(values.T)))


def _box(path, line, flags, rows):
    """The box; a face that is no 'p' is not periodic."""
    if len(flags) > 3 or len(rows) != 3:
        raise wrong(path, line, "the box is tilted, or has not three edges; only boxes with right angles can be read")
    low, high = table(path, rows, (2,)).T
    periodic = [flag == "pp" for flag in flags] or [False] * 3
    if len(periodic) != 3:
        raise wrong(path, line, f"{' '.join(flags)} must be three pairs of letters, such as 'pp pp ff'")
    return box_of(path, line, low, high, periodic)
