"""Packings from files that other programs wrote, or barchan itself."""

import re
from pathlib import Path

from barchan.packing.columns import read_csv
from barchan.packing.lammps_data import read_lammps_data
from barchan.packing.lammps_dump import read_lammps_dump
from barchan.packing.lines import read_lines
from barchan.packing.xyzr import read_xyzr


def read_packing(path):
    """Read grains from a text file. Which form it has is seen from what is in it, but for CSV, whose name ends so.

    - CSV, ``*.csv``: a line of column names: x, y, z, radius or diameter; perhaps id, material (counted from 0) or type (from
      1), and vx, vy, vz; other columns are left alone.
    - a dump file of LAMMPS or of ``barchan.writers.LammpsDump`` with columns x y z and radius or diameter: its last frame.
    - a data file of LAMMPS with ``atom_style sphere``.
    - else lines ``x y z r``, as YADE writes them; ``#`` begins a comment.

    Types of LAMMPS count from 1, materials from 0: type 1 is material 0. What is read is checked: numbers are finite, radii
    above 0, and there are as many rows as the file announces.

    Returns:
        A ``Packing``: ``sim.add_grains(p.position, p.radius, p.material, p.velocity)`` adds its grains.

    Raises:
        PackingError: the file is missing, damaged, or has none of these forms; it names file and line.
    """
    if Path(path).suffix.lower() == ".csv":
        return read_csv(path)
    lines = read_lines(path)
    if any(line.startswith("ITEM:") for line in lines[:1]):
        return read_lammps_dump(path)
    if any(re.fullmatch(r"\s*\S+\s+atoms\s*", line.partition("#")[0]) for line in lines[:100]):
        return read_lammps_data(path)
    return read_xyzr(path)
