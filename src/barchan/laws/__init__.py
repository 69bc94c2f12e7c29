"""The physics of a contact: pure functions on the numbers of one contact. No arrays, no compiler, no MPI."""

from barchan.laws.bond import Bond, BondLaw, bond
from barchan.laws.dmt import dmt
from barchan.laws.hertz_mindlin import hertz_mindlin, hertz_mindlin_standard
from barchan.laws.hertz_mindlin_rolling import hertz_mindlin_constant_rolling, hertz_mindlin_rolling
from barchan.laws.jkr import jkr
from barchan.laws.law import Law, Property, law
from barchan.laws.parallel_bond import parallel_bond
from barchan.laws.shm import shm
from barchan.laws.viscoelastic import hertz, hertz_standard, linear, linear_standard, silbert, silbert_standard

#: Every law that comes with barchan, by name.
SHIPPED = {
    entry.name: entry
    for entry in (
        silbert,
        linear,
        hertz,
        hertz_mindlin,
        shm,
        hertz_mindlin_rolling,
        hertz_mindlin_constant_rolling,
        dmt,
        jkr,
        silbert_standard,
        linear_standard,
        hertz_standard,
        hertz_mindlin_standard,
    )
}

__all__ = [
    "SHIPPED",
    "Bond",
    "BondLaw",
    "Law",
    "Property",
    "bond",
    "dmt",
    "hertz",
    "hertz_mindlin",
    "hertz_mindlin_constant_rolling",
    "hertz_mindlin_rolling",
    "hertz_mindlin_standard",
    "hertz_standard",
    "jkr",
    "law",
    "linear",
    "linear_standard",
    "parallel_bond",
    "shm",
    "silbert",
    "silbert_standard",
]
