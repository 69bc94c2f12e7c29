"""YADE, from Debian: it runs ``yade_engine.py`` in a Python of its own.

Hooke's law is that of the cases (``Law2_ScGeom_ViscElPhys_Basic``) but for four things: grains turn about their distance to the
contact, half an overlap less than the radius; a contact that slides has no tangential damping; Coulomb's limit leaves that
damping out; and no contact pulls. Instead of ``hertz`` it has Hertz and Mindlin (``Law2_ScGeom_MindlinPhys_Mindlin``): the same
springs, but the force of the tangential one is summed up step by step; and damping grows otherwise with overlap and mass.
"""

import shutil
from pathlib import Path

from barchan.bench.peers.peer import Peer, of_debian


def find(threads, ranks):
    """One row, on ``threads`` threads."""
    if shutil.which("yade") is None:
        return [of_debian("yade", "yade")]
    engine = Path(__file__).with_name("yade_engine.py")
    alone = {"PYTHONPATH": str(engine.parents[1])}  # all that its Python finds of barchan: the folder of ``barchan.bench``
    return [Peer("yade", ("yade", "-n", "-x", "-j", str(threads), str(engine)), alone, same_law=False)]
