"""An error on one rank becomes the same decision on all: every rank stops, with one message that names the rank."""

from barchan.errors import RankError


def raise_together(comm, error):
    """Raise ``error`` on the rank that has one and a RankError that quotes it on the others; all ranks must call this.

    Args:
        error: this rank's error, or None.
    """
    texts = comm.all_gather(None if error is None else str(error))
    if error is not None:
        raise error
    for rank, text in enumerate(texts):
        if text is not None:
            raise RankError(f"stopped because rank {rank} failed: {text}")
