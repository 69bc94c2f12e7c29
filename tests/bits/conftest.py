"""Which laws are tested how much: each is in every commit, but one whose loops are made of the same parts as another's less."""

import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "unit")]  # and the meshes of unit tests

#: Laws made of the same parts as others, which are tested at full size in each respect.
ALIKE = (
    "linear_standard",
    "silbert_standard",
    "hertz_standard",
    "hertz_mindlin_standard",
    "shm",
    "hertz",
    "dmt",
    "hertz_mindlin_constant_rolling",
)

#: What is tested of them in every commit: ranks, threads and rebuilds together, and a stop.
ALWAYS = ("test_ranks_threads_and_rebuilds_together", "test_run_in_two_parts", "test_stop_and_resume")


def pytest_collection_modifyitems(items):
    """Leave the rest of them to full-size checks."""
    for item in items:
        law = getattr(item, "callspec", None) and item.callspec.params.get("law")
        here = item.path.parent == Path(__file__).parent
        if here and getattr(law, "name", None) in ALIKE and item.originalname not in ALWAYS:
            item.add_marker(pytest.mark.validate)
