"""Reading back the tables of a run, as far as there are any: it may have been stopped early."""

import numpy as np

from barchan.writers import read_table


def stored(directory, names):
    """The tables of these names that the run in ``directory`` has left; None for one that has no row yet.

    Raises:
        ResultError: a table is damaged.
    """
    paths = (directory / "tables" / f"{name}.csv" for name in names)
    tables = (read_table(path) if path.exists() else None for path in paths)
    return [table if table is not None and len(table["step"]) else None for table in tables]


def rows_at(table, step):
    """The rows of a table, or of None, at a step; None if there are none."""
    at = np.flatnonzero(table["step"] == step) if table is not None else ()
    return {name: column[at] for name, column in table.items()} if len(at) else None
