"""What all unit tests share."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))      # for scenes.py

# Without a deadline, since the first example may compile; the same examples in every run, so that a failure comes back.
settings.register_profile("barchan", deadline=None, derandomize=True, database=None)
settings.load_profile("barchan")
