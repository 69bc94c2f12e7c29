"""The codes that are compared: one file each, with one signature.

A file has ``find(threads, ranks)``, which returns a list of ``Peer``; one that cannot run says why. If the code is driven by
``barchan.bench.drivers``, it also has a class ``Engine(threads, home)`` with what ``barchan.bench.serving`` asks for, where
``home`` is the folder of the case, for input files; another program may do the same with ``serving`` and ``case`` alone, which
need only NumPy. To add a code, add its file here and to ``PEERS``.
"""

from barchan.bench.peers import barchan, esysparticle, lammps, liggghts, yade

#: In the order of the rows.
PEERS = (barchan, lammps, liggghts, yade, esysparticle)


def find(threads, ranks, wide=None):
    """Every code at the numbers of threads and of MPI ranks asked for; the first is the one that others are compared with.

    Args:
        wide: if sizes differ widely, the radii: barchan as it chooses and as it is told, and those other codes that can be told.

    Returns:
        List of ``Peer``.
    """
    found = [peer for module in PEERS for peer in module.find(threads, ranks)]
    if wide is None:
        return found
    return [*barchan.find(threads, ranks), *barchan.told(wide), *(peer for peer in found if peer.told)]
