"""What all unit tests share."""

from hypothesis import settings

# Without a deadline, since the first example may compile; the same examples in every run, so that a failure comes back.
settings.register_profile("barchan", deadline=None, derandomize=True, database=None)
settings.load_profile("barchan")
