"""Drives one code: ``python -m barchan.bench.drivers PEER THREADS FOLDER``, started by ``process.Code``.

PEER is a module of ``barchan.bench.peers`` with a class ``Engine``; FOLDER is private to this code, and stands in the folder of
the case.
"""

import sys
from importlib import import_module
from pathlib import Path

from barchan.bench.case import Case
from barchan.bench.serving import serve


def main(peer, threads, folder):
    """Serve until told to quit."""
    home = Path(folder).parent
    engine = import_module(f"barchan.bench.peers.{peer}").Engine(int(threads), home)
    serve(engine, folder, lambda: Case.load(home))


if __name__ == "__main__":
    main(*sys.argv[1:4])
