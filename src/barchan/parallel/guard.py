"""An error on one rank becomes the same decision on all: every rank stops, with one message that names the rank."""

from barchan.errors import BarchanError, RankError


def raise_together(comm, error):
    """Raise ``error`` on the rank that has one and a RankError that quotes it on the others; all ranks must call this.

    Args:
        error: this rank's error, or None.
    """
    if comm.maximum([float(error is not None)])[0] == 0.0:
        return
    texts = comm.all_gather(None if error is None else str(error))
    guilty = next(rank for rank, text in enumerate(texts) if text is not None)
    if error is None:
        error = RankError(f"stopped because rank {guilty} failed: {texts[guilty]}")
    error.told_by = guilty  # all ranks know of it, one has to tell
    raise error


def on_first_rank(comm, action):
    """What ``action()`` returns on rank 0, on all ranks; all must call this.

    Raises:
        what ``action`` raises (on rank 0; a RankError that quotes it on the others).
    """
    result = failure = None
    if comm.rank == 0:
        try:
            result = action()
        except (BarchanError, OSError) as error:
            failure = error
    raise_together(comm, failure)
    return comm.from_first(result)


def told_as(error, other):
    """``error`` in place of ``other``, of which all ranks know."""
    error.told_by = getattr(other, "told_by", None)
    return error


def first_on_node(comm, action):
    """Call ``action()`` on all ranks, but on one of each node before the others: what it makes, they find."""
    if comm.rank_on_node == 0:
        action()
    comm.barrier()
    if comm.rank_on_node != 0:
        action()
