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
from barchan.walls import Mesh, Plane


def is_compiled(law, uniform, meshes=False):
    """True if the loops of ``law`` were compiled on this machine before, for scenes with ``meshes`` or without."""
    return _marker(law, uniform, meshes).exists()


def compile_law(law, materials, announce=None, bonds=(), meshes=False):
    """Compile all kernels that a scene with ``law``, ``materials`` and kinds of ``bonds`` calls on so many ranks as there are,
    unless they are in the cache.

    Args:
        announce: function called with a line of text for each kernel that has to be compiled.
        meshes: True if there are walls of triangles, which others need not wait for.
    """
    markers = _marker(law, len(materials) == 1, meshes), *_bond_markers(bonds)
    if all(marker.exists() for marker in markers):
        return
    title = f"first start on this machine, compiling for law '{law.name}'"
    more = world().size > 1, bool(bonds), meshes
    with warnings.catch_warnings(), announced(title, announce or (lambda text: None), *more):
        warnings.simplefilter("ignore")
        _call_all(law, materials, bonds, meshes, Serial())
        if world().size > 1:
            virtual_ranks(2, _call_all, law, materials, bonds, meshes)
    for marker in markers:
        marker.touch()


def compile_scene(sim, announce=None):
    """``compile_law`` for what ``sim`` is made of."""
    meshes = any(isinstance(wall, Mesh) for wall in sim.walls)
    compile_law(sim.law, sim.materials.list, announce, sim.bonds.kinds, meshes)


def _call_all(law, materials, bonds, meshes, comm=None):
    """Two grains that touch each other and walls are moved by two steps and measured, then their list is put away and made anew:
    that calls all kernels. Of two ranks each owns one of them."""
    sim = Simulation(Box((0, 0, 0), (8, 8, 8)), law, materials, dt=1e-9, threads=1, comm=comm, bonds=bonds)
    sim.check_dt, sim.skin = False, 1e-14  # so thin that the second step must rebuild
    sim.add_wall(Plane((0, 0, 0), (0, 0, 1), material=0))
    if meshes:
        sim.add_wall(Mesh([(1, 1, 0), (7, 1, 0), (1, 7, 0), (7, 7, 0)], [(0, 1, 2), (1, 3, 2)], material=0))
    sim.add_grains([(3, 4, 0.99), (4.99, 4, 0.99)], 1.0, material=0, mass=1.0, velocity=1e-3)
    sim.run(2)
    KineticEnergy().compute(sim)
    if bonds:  # only now: bonded grains are not moved many steps at a time
        sim.install_bonds()
        sim.run(1)
        sim.bonds.energies(sim.grains, np.arange(len(sim.bonds)))
    sim.begin_change()
    sim.run(1)


def _marker(law, uniform, meshes):
    return _marker_of(make_loops(law, uniform), "-meshes" * meshes)


def _bond_markers(bonds):
    """That of the loops of bonds, if there are any."""
    return [_marker_of(make_bond_loops(bonds[0].law, len(bonds) == 1))] if bonds else []


def _marker_of(loops, kind=""):
    ranks = "-ranks" if world().size > 1 else ""
    return cache_root() / fingerprint() / f"{loops.module.__name__}{kind}{ranks}.compiled"


def compile_shipped(announce=None):
    """Compile all laws that come with barchan, for scenes with one material, with meshes and without."""
    values = {"youngs_modulus": 1.0, "poisson_ratio": 0.25, "friction": 0.5, "kn": 1.0, "kt": 1.0}
    for law in SHIPPED.values():
        material = Material("any", **{name: values[name] for name in law.properties if name in values})
        for meshes in (False, True):
            compile_law(law, [material], announce, meshes=meshes)
