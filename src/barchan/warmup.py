"""Compiles everything that a scene needs before its first step, so that the wait is announced and paid once."""

import warnings

import numpy as np

from barchan.domain import Box
from barchan.kernels.compiler import announced, cache_root, fingerprint
from barchan.kernels.generate import make_loops
from barchan.kernels.generate_bond import make_bond_loops
from barchan.laws import SHIPPED
from barchan.materials import Material
from barchan.measure import KineticEnergy
from barchan.parallel import Serial, virtual_ranks, world
from barchan.simulation import Simulation
from barchan.walls import Plane


def is_compiled(law, uniform):
    """True if the loops of ``law`` were compiled on this machine before."""
    return _marker(law, uniform).exists()


def compile_law(law, materials, announce=None, bonds=()):
    """Compile all kernels that a scene with ``law``, ``materials`` and kinds of ``bonds`` calls on so many ranks as there are,
    unless they are in the cache.

    Args:
        announce: function called with a line of text for each kernel that has to be compiled.
    """
    uniform = len(materials) == 1
    if is_compiled(law, uniform) and all(marker.exists() for marker in _bond_markers(bonds)):
        return
    title = f"first start on this machine, compiling for law '{law.name}'"
    with warnings.catch_warnings(), announced(title, announce or (lambda text: None), world().size > 1, bool(bonds)):
        warnings.simplefilter("ignore")
        _call_all(law, materials, bonds, Serial())
        if world().size > 1:
            virtual_ranks(2, _call_all, law, materials, bonds)
    for marker in (_marker(law, uniform), *_bond_markers(bonds)):
        marker.touch()


def _call_all(law, materials, bonds, comm=None):
    """Two grains that touch each other and a wall are moved by two steps and measured, then their list is put away and made anew:
    that calls all kernels. Of two ranks each owns one of them."""
    sim = Simulation(Box((0, 0, 0), (8, 8, 8)), law, materials, dt=1e-9, threads=1, comm=comm, bonds=bonds)
    sim.check_dt, sim.skin = False, 1e-14  # so thin that the second step must rebuild
    sim.add_wall(Plane((0, 0, 0), (0, 0, 1), material=0))
    sim.add_grains([(3, 4, 0.99), (4.99, 4, 0.99)], 1.0, material=0, mass=1.0, velocity=1e-3)
    sim.run(2)
    KineticEnergy().compute(sim)
    if bonds:  # only now: bonded grains are not moved many steps at a time
        sim.install_bonds()
        sim.run(1)
        sim.bonds.energies(sim.grains, np.arange(len(sim.bonds)))
    sim.begin_change()
    sim.run(1)


def _marker(law, uniform):
    return _marker_of(make_loops(law, uniform))


def _bond_markers(bonds):
    """That of the loops of bonds, if there are any."""
    return [_marker_of(make_bond_loops(bonds[0].law, len(bonds) == 1))] if bonds else []


def _marker_of(loops):
    ranks = "-ranks" if world().size > 1 else ""
    return cache_root() / fingerprint() / f"{loops.module.__name__}{ranks}.compiled"


def compile_shipped(announce=None):
    """Compile all laws that come with barchan, for scenes with one material."""
    values = {"youngs_modulus": 1.0, "poisson_ratio": 0.25, "friction": 0.5, "kn": 1.0, "kt": 1.0}
    for law in SHIPPED.values():
        compile_law(law, [Material("any", **{name: values[name] for name in law.properties if name in values})], announce)
