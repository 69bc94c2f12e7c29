"""Numbers against time as CSV files, for every spreadsheet, pandas and a text editor."""

import os
from numbers import Integral, Real
from pathlib import Path
from zlib import crc32

import numpy as np

from barchan.atomic import writing
from barchan.errors import OutputError, ResultError
from barchan.triggers import trigger
from barchan.words import shown
from barchan.writers.output import write_on_first_rank

#: The first two columns of every table.
NOW = ("step", "time [s]")


class Table:
    """A writer: a row, or several, of numbers each time it is due, in one CSV file with a line of column names on top.

    Numbers are written with as many digits as they have, so that reading gives the same bits. The first write drops the rows
    of its own and of later steps: they were left by a run that was killed after its last checkpoint, and this run writes
    them again.

    Args:
        path: the file; its directory is made if it does not exist.
        due: trigger, a function of the step.
        columns: function of the simulation, called on all ranks. It returns column name, with its unit, as in
            "speed [m/s]" -> number; or a list of such dicts, one a row. The names are the same in all rows; the columns
            ``step`` and ``time [s]`` are put before them. The rows are the same on all ranks: give what ``barchan.measure``
            or a reduction of ``sim.comm`` returns, not what belongs to the grains of one rank.
    """

    def __init__(self, path, due, columns):
        self.path, self.due, self.columns = Path(path), trigger(due, f"table {path}"), columns
        self._names, self._is_first = None, True

    def write(self, sim):
        """Append the present rows.

        Raises:
            OutputError: the operating system refused, there is a file in its place that is no table or has other columns, or
                a row cannot be written, or ranks gave different rows; the table is as it was.
        """
        given = self.columns(sim)
        rows = [given] if isinstance(given, dict) else list(given)
        if sim.comm.size > 1:
            self._compare(sim, rows)

        def write():
            if self._is_first:
                self._names, self._is_first = self._continue_from(sim.step_number), False
            if rows:
                self._append(rows, f"{sim.step_number},{sim.time!r}")

        write_on_first_rank(sim, self.path, write)

    def _compare(self, sim, rows):
        """Refuse rows that belong to one rank."""
        digest = float(crc32(repr(rows).encode()))
        largest, smallest = sim.comm.maximum([digest, -digest]).tolist()
        if largest != -smallest:
            raise OutputError(
                f"step {sim.step_number}: table {self.path}: the ranks gave different rows, here {shown(rows)}; give sums "
                f"over all ranks, as barchan.measure returns them (sim.n_grains instead of sim.grains.n)"
            )

    def _continue_from(self, step):
        """Drop the rows of ``step`` and later, and a last one that was cut; returns the column names, None without a file."""
        if not self.path.exists():
            return None
        try:
            names, rows = _read(self.path)
            kept = [row for row in rows if _step(self.path, row) < step]
        except ResultError as error:
            raise OutputError(f"{error}. Move it away, or choose another name for this table") from None
        with writing(self.path) as partial:
            partial.write_bytes("".join(f"{line}\n" for line in (",".join(names), *kept)).encode())
        return names

    def _append(self, rows, now):
        names = self._names or _checked(self.path, [*NOW, *rows[0]])
        lines = [f"{now}{_cells(self.path, names[2:], row)}\n" for row in rows]
        if self._names is None:
            with writing(self.path) as partial:
                partial.write_bytes((",".join(names) + "\n").encode())
            self._names = names
        size = self.path.stat().st_size
        try:
            with open(self.path, "ab") as file:
                file.write("".join(lines).encode())
        except OSError:
            os.truncate(self.path, size)
            raise


def _checked(path, names):
    bad = [name for name in names if not isinstance(name, str) or not name or set(name) & set(',"\r\n')]
    if bad:
        raise OutputError(f"table {path}: column name {bad[0]!r} must be a text without commas, quotes and line ends")
    if len(set(names)) < len(names):
        raise OutputError(f"table {path}: the columns {' and '.join(NOW)} are put there by the table; leave them out")
    return names


def _cells(path, names, row):
    """The numbers of a row as text, each after a comma."""
    if set(row) != set(names):
        odd = ", ".join(repr(name) for name in names if name not in row) or "nothing"
        new = ", ".join(repr(name) for name in row if name not in names) or "nothing"
        raise OutputError(
            f"table {path} has the columns {', '.join(names)}; this row lacks {odd} and adds {new}. All rows of a table have the "
            f"same columns: move the table away, or give it another name"
        )
    for name, value in row.items():
        if not isinstance(value, Real):
            raise OutputError(f"table {path}: {name} = {value!r} must be a number")
    return "".join(f",{(int if isinstance(row[name], Integral) else float)(row[name])!r}" for name in names)


def read_table(path):
    """A table that a ``Table`` wrote, also of a run that is still writing it or was killed: a last row that was cut is left out.

    Returns:
        Column name -> (rows,) array: ``step`` of int64, all others of float64 with the bits that were written.

    Raises:
        ResultError: the file is missing, damaged, or no such table; the message names the line.
    """
    try:
        names, rows = _read(path)
    except OSError as error:
        raise ResultError(f"table {path} cannot be read: {os.strerror(error.errno)}") from None
    cells = [row.split(",") for row in rows]
    for number, row in enumerate(cells, 2):
        if len(row) != len(names):
            raise ResultError(f"table {path}: line {number} has {len(row)} values for {len(names)} columns; it is damaged")
    try:
        columns = {name: [float(row[k]) for row in cells] for k, name in enumerate(names)}
    except ValueError as error:
        raise ResultError(f"table {path} holds something else than numbers ({error}); it is damaged") from None
    steps = np.array([_step(path, row) for row in rows], dtype=np.int64)
    return {name: np.array(column, dtype=np.float64) for name, column in columns.items()} | {"step": steps}


def _read(path):
    """Column names and rows of a table, as text; what follows the last line end is a row that was cut."""
    try:
        head, *rows = Path(path).read_bytes().decode().split("\n")
    except UnicodeDecodeError:
        head, rows = "", []
    names = head.split(",")
    if tuple(names[:2]) != NOW or len(set(names)) < len(names) or not rows:
        raise ResultError(
            f"table {path} does not begin with a line of column names, {', '.join(NOW)} first; it is no table of barchan"
        )
    return names, rows[:-1]


def _step(path, row):
    try:
        return int(row.partition(",")[0])
    except ValueError:
        raise ResultError(f"table {path}: the row {row[:60]!r} does not begin with a step; it is damaged") from None
