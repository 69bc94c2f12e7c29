"""The declaration of a bond law, what is refused, and laws of a user's own, in a file, that run and survive a resume."""

import importlib.util

import numpy as np
import pytest

import barchan as bc
from barchan.bonds import cracks
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import LawError, MaterialError, SceneError
from barchan.kernels.generate_bond import make_bond_loops
from barchan.laws.bond import QUANTITIES, BondLaw
from barchan.measure import bond_table

ZERO = (0.0, 0.0, 0.0)

#: What a user saves as a file of their own.
VISCOUS = '''
"""A spring and a dashpot, and glue that softens, in a user's file."""
import barchan as bc
from barchan.laws.vector import scale, sub


def elongated(longest, pull):
    return max(longest, pull)


@bc.bond(
    properties={"stiffness": "force/length", "viscosity": "force time/length"},
    history={"pull": 1, "shear": 3},
    energy=lambda_energy,
)
def viscous(stretch, slip, dt, stiffness, viscosity, pull, shear):
    """Spring and dashpot."""
    pull = pull - stiffness * stretch
    shear = sub(shear, scale(stiffness, slip))
    rate = stretch / dt if dt > 0.0 else 0.0
    return pull - viscosity * rate, shear, (0.0, 0.0, 0.0), 0, pull, shear


@bc.bond(
    properties={"stiffness": "force/length", "peak": "length", "end": "length"},
    history={"length": 1, "longest": 1},
    modes=("torn apart",),
)
def softening(stretch, stiffness, peak, end, strength, length, longest):
    """Elastic up to ``peak``, then it gives way, and breaks at ``end``; unloaded towards the origin."""
    length = length + stretch
    longest = elongated(longest, length)
    kept = 1.0 if longest <= peak else peak / longest * (end - longest) / (end - peak)
    return -stiffness * kept * length, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1 if longest >= strength * end else 0, length, longest
'''

ENERGY = """
def lambda_energy(stiffness, pull):
    return 0.5 * pull * pull / stiffness


@bc.bond("""


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """The module that a user's file makes."""
    path = tmp_path_factory.mktemp("own") / "own_bonds.py"
    path.write_text(VISCOUS.replace("\n@bc.bond(", ENERGY, 1))
    spec = importlib.util.spec_from_file_location("own_bonds", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pair(kind, speed, dt=1e-2):
    """Two touching grains, bonded, of which the second is pulled away as told."""
    stone = bc.Material("stone", density=1.0, kn=1e-200, kt=1e-200, friction=0.0)
    sim = bc.Simulation(bc.Box((-4,) * 3, (4,) * 3), bc.laws.linear, stone, dt, bonds=kind, threads=1)
    sim.add_grains([(0, 0, 0), (1, 0, 0)], 0.5, mass=1e30, velocity=[(0, 0, 0), (speed, 0, 0)])
    assert sim.install_bonds(overlap=-1e-6) == 1
    return sim


def test_the_arguments_declare_what_a_bond_law_reads():
    law = bc.laws.parallel_bond
    assert isinstance(law, BondLaw) and law.name == "parallel_bond" and law.history_width == 8
    assert set(law.quantities) <= set(QUANTITIES) and law.modes == ("tension", "compression", "shear", "torsion")
    values = {name: 0.0 for name in law.properties} | {name: ZERO if w == 3 else 0.0 for name, w in law.history.items()}
    values |= {"kn": 2.0, "ks": 1.0, "tensile_strength": 1.0, "shear_strength": 1.0, "radius_factor": 1.0, "strength": 1.0}
    values |= {"stretch": 0.1, "slip": ZERO, "twist": 0.0, "bend": ZERO, "normal": (1.0, 0.0, 0.0)}
    force, *_, mode, kept, _, _, _ = law(radius_first=1.0, radius_second=2.0, **values)
    assert force == kept == pytest.approx(-0.2 * np.pi) and mode == 0, "called, it is the plain function"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"history": {"slip": 3}}, "bond law 'odd'"),
        ({"history": {"k": 2}}, r"history \{'k': 2\} must be 1 .* or 3"),
        ({}, r"argument\(s\) \['k'\] are no quantity .* Quantities: stretch, slip"),
        ({"properties": {"k": "force/lenght"}}, "lenght"),
        ({"properties": {"k": "1", "stretch": "length"}}, "stretch"),
        ({"properties": {"k": "1"}, "modes": "tension"}, r"modes = 'tension' must be names, such as \('tension', 'shear'\)"),
        ({"properties": {"k": "1"}, "modes": ()}, r"modes = \(\) must be names"),
        ({"properties": {"k": "1"}, "modes": ("a", "a")}, "must be names"),
        ({"properties": {"k": "1"}, "modes": ("a", 2)}, "must be names"),
        ({"properties": {"k": "1"}, "energy": lambda stretch: 0.0}, "stretch"),
        ({"properties": {"k": "1"}, "energy": 5}, "energy"),
    ],
)
def test_a_declaration_that_does_not_fit_is_refused_at_once(options, message):
    with pytest.raises(LawError, match=message):

        @bc.bond(**options)
        def odd(stretch, k):
            return k * stretch, ZERO, ZERO, 0


def test_a_decorator_without_brackets_is_told_so():
    with pytest.raises(LawError, match="the decorator needs brackets"):

        @bc.bond
        def odd(stretch):
            return stretch, ZERO, ZERO, 0


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"kn": None}, MaterialError, "bond 'bond': .*kn"),
        ({"kn": -1.0}, MaterialError, "kn"),
        ({"tensile_strength": 0.0}, MaterialError, "tensile_strength"),
        ({"shear_strength": float("nan")}, MaterialError, "shear_strength"),
        ({"radius": 2.0}, MaterialError, "law 'parallel_bond' knows no property 'radius'; .*radius_factor"),
    ],
)
def test_a_kind_of_bond_with_wrong_properties_is_refused(changes, error, message):
    given = {"kn": 1.0, "ks": 1.0, "tensile_strength": 1.0, "shear_strength": 1.0} | changes
    with pytest.raises(error, match=message):
        bc.Bond(bc.laws.parallel_bond, **{name: value for name, value in given.items() if value is not None})


def test_what_is_no_bond_law_or_no_kind_is_refused():
    with pytest.raises(LawError, match=r"must be a bond law, such as barchan.laws.parallel_bond"):
        bc.Bond(bc.laws.linear, kn=1.0)
    with pytest.raises(SceneError):
        pair("glue", 0.0)


def test_a_bond_law_is_no_contact_law():
    stone = bc.Material("stone", density=1.0, kn=1.0, kt=1.0, friction=0.0)
    with pytest.raises(SceneError, match=r"law 'parallel_bond' is a bond law; .* bonds=barchan.Bond"):
        bc.Simulation(bc.Box((0,) * 3, (4,) * 3), bc.laws.parallel_bond, stone, 1e-3)


def test_a_dashpot_of_ones_own(own):
    """k s along the bond, and the viscosity times the speed; evaluated without advancing, only the spring."""
    speed, steps = 0.01, 50
    sim = pair(bc.Bond(own.viscous, stiffness=3.0, viscosity=7.0), speed)
    sim.run(steps)
    table = bond_table(sim)
    assert table["pull"][0] == pytest.approx(-3.0 * speed * steps * 1e-2, rel=1e-12)
    assert table["force"][0] == pytest.approx([3.0 * speed * steps * 1e-2 + 7.0 * speed, 0.0, 0.0], rel=1e-12)
    assert table["energy"][0] == pytest.approx(0.5 * table["pull"][0] ** 2 / 3.0, rel=1e-12)
    sim.grains.velocity[...] = 0.0
    sim.run(1)
    assert bond_table(sim)["force"][0, 0] == pytest.approx(3.0 * speed * steps * 1e-2, rel=1e-12)


def test_glue_of_ones_own_that_softens_and_tears(own):
    """The force falls on a straight line from its peak to the break, which bears the user's own name."""
    speed, dt = 0.01, 1e-2
    sim = pair(bc.Bond(own.softening, stiffness=3.0, peak=0.01, end=0.02005), speed, dt)
    forces = []
    for _ in range(210):
        sim.run(1)
        forces.append(float(sim.grains.force[sim.grains.row_of([0])[0], 0]))
    length = speed * dt * np.arange(1, 211)
    expected = np.where(length <= 0.01, 3.0 * length, 3.0 * 0.01 * (0.02005 - length) / 0.01005) * (length < 0.02005)
    assert forces == pytest.approx(expected, abs=1e-12)
    found = cracks.table(sim)
    assert own.softening.modes[int(found["mode"][0]) - 1] == "torn apart" and found["step"].tolist() == [201]


def test_laws_of_ones_own_are_compiled(own):
    given = {own.viscous: {"stiffness": 3.0, "viscosity": 7.0}, own.softening: {"stiffness": 3.0, "peak": 0.01, "end": 0.02}}
    for law, properties in given.items():
        pair(bc.Bond(law, **properties), 0.01).run(1)
        loops = make_bond_loops(law, True)
        assert len(loops.bond_forces.signatures) == 1 and loops.module.__name__.startswith(f"barchan_bond_{law.name}")
        assert (loops.energies is not None) == (law is own.viscous)


@pytest.mark.parametrize("name", ["viscous", "softening"])
def test_laws_of_ones_own_survive_a_resume_with_the_same_bits(name, own, tmp_path):
    given = {"viscous": {"stiffness": 3.0, "viscosity": 7.0}, "softening": {"stiffness": 3.0, "peak": 0.01, "end": 0.02005}}[name]
    kind = bc.Bond(getattr(own, name), **given)
    whole, first, again = pair(kind, 0.01), pair(kind, 0.01), pair(kind, 0.01)
    whole.run(230)
    first.run(150)
    save(first, tmp_path / "state.h5")
    restore(again, tmp_path / "state.h5")
    again.run(80)
    assert differences(collect(whole), collect(again)) == []
    assert len(bond_table(again)["first"]) == (1 if name == "viscous" else 0)


def test_a_checkpoint_of_another_bond_law_is_refused(own, tmp_path):
    first = pair(bc.Bond(own.viscous, stiffness=3.0, viscosity=7.0), 0.01)
    first.run(5)
    save(first, tmp_path / "state.h5")
    with pytest.raises(SceneError, match="bond"):
        restore(pair(bc.Bond(own.viscous, stiffness=4.0, viscosity=7.0), 0.01), tmp_path / "state.h5")
    with pytest.raises(SceneError, match="bond"):
        restore(pair(bc.Bond(own.softening, stiffness=3.0, peak=0.01, end=0.02), 0.01), tmp_path / "state.h5")
