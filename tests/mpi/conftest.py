"""Tests that several processes run together: ``mpiexec -n 2 python -m pytest tests/mpi`` (``make test`` does;
``make validate`` with 3, 4 and 8).

Every rank runs every test. One that fails on some rank fails on all; if others wait for a rank that failed, all are ended.
"""

import os
import sys
import time
from pathlib import Path

import pytest

from barchan.parallel import world

sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in ("bits", "unit")]

COMM = world()

#: Nothing in here can be run by one rank alone.
collect_ignore_glob = ["test_*"] if COMM.size == 1 else []

#: Seconds that a rank waits for the others at the end of a test.
PATIENCE = 60.0


def pytest_configure(config):
    """The first rank speaks for all."""
    if COMM.rank:
        sys.stdout = open(os.devnull, "w")
        config.pluginmanager.unregister(name="terminalreporter")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    """A test passes if it does on all ranks."""
    outcome = yield
    report = outcome.get_result()
    if call.when != "call" or COMM.size == 1:
        return
    everybody, patience = COMM._end.Ibarrier(), time.monotonic() + PATIENCE
    while not everybody.Test():
        if time.monotonic() > patience:
            sys.__stderr__.write(f"rank {COMM.rank}: {item.nodeid} {report.outcome}, and others hang\n{report.longreprtext}\n")
            sys.__stderr__.flush()
            COMM._comm.Abort(1)
        time.sleep(0.001)
    reports = COMM._end.allgather(report.longreprtext if report.failed else None)
    failed = [(rank, text) for rank, text in enumerate(reports) if text is not None]
    if failed and not report.failed:
        report.outcome, report.longrepr = "failed", f"on rank {failed[0][0]}:\n{failed[0][1]}"


@pytest.fixture
def comm():
    """The communicator of all ranks."""
    return COMM


@pytest.fixture
def shared_path(tmp_path):
    """A directory that all ranks see."""
    return COMM.from_first(tmp_path)
