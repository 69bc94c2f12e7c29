"""Everything that knows of more than one rank."""

from barchan.parallel.comm import Serial, virtual_ranks, world

__all__ = ["Serial", "virtual_ranks", "world"]
