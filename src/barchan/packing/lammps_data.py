"""Data files of LAMMPS and LIGGGHTS, ``atom_style sphere``: https://docs.lammps.org/read_data.html."""

import re

import numpy as np

from barchan.errors import PackingError
from barchan.packing.lines import read_lines, table, whole, wrong
from barchan.packing.packing import box_of, order_of, packing_of

#: Columns of the two sections that are read; image flags may follow those of the first.
_ATOMS = ("id", "type", "diameter", "density", "x", "y", "z")
_VELOCITIES = ("id", "vx", "vy", "vz", "wx", "wy", "wz")


def read_lammps_data(path):
    """Read the sections Atoms and Velocities, and the box, of which such files do not tell what is periodic: nothing is.

    Densities and angular velocities are left alone. A section Atoms without the comment that names its style is taken for
    one of spheres: id type diameter density x y z.

    Returns:
        A ``Packing``.

    Raises:
        PackingError: the file is no such file, or damaged.
    """
    head, sections = _sections(read_lines(path))
    count, box = _count(path, head), _box(path, head)
    if "Atoms" not in sections:
        raise PackingError(f"packing {path}: no section Atoms; it is no data file of LAMMPS, or cut")
    line, style, _ = sections["Atoms"]
    if style not in ("", "sphere"):
        raise wrong(path, line, f"atom_style {style} has no radii; write the file with atom_style sphere")
    columns, lines = _columns(path, sections["Atoms"], count, _ATOMS, (7, 10))
    if "Velocities" in sections:
        moving, there = _columns(path, sections["Velocities"], count, _VELOCITIES, (7,))
        order, theirs = order_of(path, lines, columns["id"]), order_of(path, there, moving["id"])
        strange = np.flatnonzero(columns["id"][order] != moving["id"][theirs])
        if len(strange):
            row = theirs[strange[0]]
            raise wrong(path, there[row], f"no atom has the id {moving['id'][row]:g} of these velocities, or another has none")
        for name in ("vx", "vy", "vz"):
            columns[name] = np.empty(count)
            columns[name][order] = moving[name][theirs]
    return packing_of(path, lines, columns, box)


def _sections(lines):
    """The header, (line number, words) each, and name of a section -> (line number, comment behind the name, rows)."""
    head, sections = [], {}
    rows = head
    for number, line in enumerate(lines[1:], 2):  # the first is a comment
        text, _, comment = line.partition("#")
        words = text.split()
        if words and words[0][0].isalpha():
            rows = []
            sections[" ".join(words)] = (number, comment.strip(), rows)
        elif words:
            rows.append((number, words))
    return head, sections


def _count(path, head):
    found = [(number, words) for number, words in head if words[1:] == ["atoms"]]
    if len(found) != 1:
        raise PackingError(f"packing {path}: no line such as '1000 atoms' in its header; it is no data file of LAMMPS")
    (number, words), *_ = found
    return int(whole(path, [number], table(path, [(number, words[:1])], (1,))[0], "atoms", 0)[0])


def _box(path, head):
    """The box of the header."""
    edges = {words[2][0]: (number, words[:2]) for number, words in head if re.fullmatch(r"([xyz])lo \1hi", " ".join(words[2:]))}
    tilted = [number for number, words in head if words[-3:] == ["xy", "xz", "yz"] or "avec" in words]
    if tilted:
        raise wrong(path, tilted[0], "the box is tilted; only boxes with right angles can be read")
    if set(edges) != set("xyz"):
        raise PackingError(f"packing {path}: its header does not give the box as 'xlo xhi', 'ylo yhi' and 'zlo zhi'")
    low, high = table(path, [edges[axis] for axis in "xyz"], (2,)).T
    return box_of(path, edges["x"][0], low, high)


def _columns(path, section, count, names, widths):
    """Column name -> values of a section, and the number of the line of each row."""
    line, _, rows = section
    if len(rows) != count:
        raise wrong(path, line, f"{len(rows)} rows follow, but the header announces {count} atoms; the file is cut or altered")
    return dict(zip(names, table(path, rows, widths).T)), np.array([number for number, _ in rows], dtype=np.int64)
