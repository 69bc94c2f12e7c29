"""A code that is compared, in the way it is started."""

import shutil
import sys
from typing import NamedTuple


class Peer(NamedTuple):
    """A code, as a row of the table.

    Attributes:
        name: such as "lammps-2".
        command: what starts it; the path of its folder is appended.
        environment: variables that it needs besides those of this process.
        missing: why it cannot be run; None if it can.
        same_law: False if it cannot compute the very law of the case, so that energies may differ.
        ranks: of MPI.
        told: True if somebody has to tell it the size classes of its grains. cells: the same, and how large cells are.
    """

    name: str
    command: tuple = ()
    environment: dict = {}
    missing: str | None = None
    same_law: bool = True
    ranks: int = 1
    told: bool = False
    cells: bool = False


def driver(module, threads):
    """Command for a code with an ``Engine`` in ``barchan.bench.peers``."""
    return (sys.executable, "-m", "barchan.bench.drivers", module, str(threads))


def of_debian(program, package):
    """A row for a program of Debian that does not run: it is not installed, or has no driver."""
    if shutil.which(program) is None:
        return Peer(package, missing=f"not installed (Debian: apt install {package})")
    return Peer(package, missing="installed, but barchan cannot drive it yet")
