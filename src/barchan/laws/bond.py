"""What a bond law is: one pure function of one bond between two grains, under the same contract as a contact law (``law.py``).

A bond is there until it breaks, whether its grains touch or not, beside the contact law. The function takes any of the quantities
of ``QUANTITIES`` by name, the properties of the bond's kind, and what the bond remembers. It returns
``(normal_force, tangential_force, couple, mode, *history)``: a number, positive when it pushes the grains apart; the force on the
first grain in the plane of the bond, and the couple on it, vectors; 0 while the bond holds, or the number of the mode in which it
breaks in this step, counted from 1. A bond that breaks carries nothing, from that step on. What is remembered has been turned
with the bond before the function sees it, so that a rigid motion of both grains changes nothing.
"""

from types import MappingProxyType

from barchan.errors import LawError, MaterialError, SceneError
from barchan.laws.law import SCALAR, VECTOR, Law
from barchan.words import nearest, shown

#: Quantities of one bond: name -> (width, dimension, meaning). "first" is the grain with the smaller id. What changes in a step
#: is that from n-1 to n, of the first grain relative to the second.
QUANTITIES = MappingProxyType(
    {
        "stretch": (SCALAR, "length", "by how much the distance of the centres grew in this step"),
        "slip": (VECTOR, "length", "how far its ends were moved along each other in this step, in the plane of the bond"),
        "twist": (SCALAR, "1", "by what angle the first grain was turned about the normal in this step"),
        "bend": (VECTOR, "1", "by what angle it was turned about axes in the plane of the bond, in this step"),
        "normal": (VECTOR, "1", "unit vector from the second to the first, at step n"),
        "distance": (SCALAR, "length", "between the centres"),
        "radius_first": (SCALAR, "length", "radius"),
        "radius_second": (SCALAR, "length", "radius"),
        "mass_eff": (SCALAR, "mass", "m_i m_j / (m_i + m_j); an immobile partner counts as infinitely heavy"),
        "strength": (SCALAR, "1", "how much stronger than its kind this bond is; 1 unless a distribution was given"),
        "dt": (SCALAR, "time", "time step; 0 when forces are evaluated without advancing"),
    }
)

#: Quantities of a bond that its energy may depend on.
STORED_IN = ("radius_first", "radius_second")

#: What is told of any bond, so that nothing it remembers can have these names.
TOLD = ("first", "second", "kind", "point", "force", "torque_first", "torque_second", "energy")

#: Names of what a bond law returns before its history.
RETURNED = {"normal_force": SCALAR, "tangential_force": VECTOR, "couple": VECTOR, "mode": SCALAR}


class BondLaw(Law):
    """A bond law; made by the decorator ``bond``. Beside what a ``Law`` has: ``modes``, names of the ways in which it breaks."""

    kind, known, stored_in = "bond law", QUANTITIES, STORED_IN

    def __init__(self, function, properties, history, modes, energy):
        taken = [name for name in TOLD if isinstance(history, dict) and name in history]
        if taken:
            raise LawError(
                f"bond law '{function.__name__}': history '{taken[0]}' is what every table of bonds tells by that name; take "
                f"another one"
            )
        super().__init__(function, properties, history, "radius", None, couple=True, energy=energy)
        words = isinstance(modes, (tuple, list)) and len(modes) > 0 and all(isinstance(mode, str) and mode for mode in modes)
        if not words or len(set(modes)) != len(modes) or len(modes) > 200:
            raise LawError(f"bond law '{self.name}': modes = {shown(modes)} must be names, such as ('tension', 'shear')")
        self.modes = tuple(modes)

    @property
    def returns(self):
        """Width of all that it returns by name, in order."""
        return RETURNED | self.history


def bond(properties=None, history=None, modes=("broken",), energy=None):
    """Declare a bond law. See ``docs/how-to/bonds.md``.

    Args:
        properties: property of a kind of bond -> Property, or its dimension as text (then it must be given and >= 0).
        history: what a bond remembers: name -> 1 (a number) or 3 (a vector). It starts at 0.
        modes: names of the ways in which it breaks.
        energy: function of radii, properties and history, by name, that tells what a bond stores [force length].

    Raises:
        LawError: the declaration is of the wrong kind, has an unknown dimension, or does not fit to the function's arguments.

    >>> @bond(properties={"stiffness": "force/length"}, history={"pull": 1})
    ... def string(stretch, stiffness, pull):
    ...     pull = pull - stiffness * stretch
    ...     return pull, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, pull
    >>> string(stretch=0.5, stiffness=2.0, pull=0.0)[0]
    -1.0
    """
    if callable(properties):
        raise LawError(f"bond law {shown(properties)}: the decorator needs brackets: @barchan.bond(properties={{...}})")
    return lambda function: BondLaw(function, properties, history, modes, energy)


class Bond:
    """A kind of bond: what grains are glued together with.

    Args:
        law: a bond law, such as ``barchan.laws.parallel_bond``.
        name: how scenes and messages call it.
        properties: what the law asks for, by name (``law.properties`` lists it).

    Attributes:
        values: (properties,) in the order of ``law.parameters``.

    Raises:
        LawError: the law is no bond law.
        MaterialError: a property is missing, unknown to the law, or out of range.
    """

    def __init__(self, law, name="bond", **properties):
        if not isinstance(law, BondLaw):
            raise LawError(f"Bond: law = {shown(law)} must be a bond law, such as barchan.laws.parallel_bond")
        self.law, self.name, where = law, str(name), f"bond '{name}'"
        for given in properties:
            if given not in law.properties:
                raise MaterialError(f"{where}: law '{law.name}' knows no property '{given}'; {nearest(given, law.properties)}")
        self.given = MappingProxyType({name: float(law.check(name, properties, where)) for name in law.properties})
        self.values = tuple(self.given[name] for name in law.parameters)

    def __repr__(self):
        return f"Bond({self.law.name}, {self.name!r}, {', '.join(f'{k}={v!r}' for k, v in self.given.items())})"


def kinds_of(bonds):
    """Kinds of bond as a list.

    Args:
        bonds: a ``Bond`` or a list of them.

    Raises:
        SceneError: one is no ``Bond``, two have one name, or they are of several laws.
    """
    kinds = list(bonds) if isinstance(bonds, (list, tuple)) else [bonds]
    if not all(isinstance(kind, Bond) for kind in kinds):
        raise SceneError(f"bonds = {shown(bonds)} must be a barchan.Bond or a list of them")
    names = [kind.name for kind in kinds]
    if len({id(kind.law) for kind in kinds}) > 1 or len(set(names)) != len(names):
        raise SceneError(f"bonds: all of one law, each with a name of its own; got {shown(kinds)}")
    return kinds
