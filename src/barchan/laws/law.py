"""What a contact law is: one pure function of one contact, and what it declares about itself.

The function takes any of the quantities of ``QUANTITIES`` by name, the pair parameters that ``mix`` makes (or the law's
material properties, mixed by the one rule of ``mix_by_rule``), and its history by name. It returns
``(normal_force, tangential_force, *history)``: a number, positive when it pushes the grains apart, and the tangential
force on the first grain; a law with couples ``(normal_force, tangential_force, couple, *history)``. Vectors are tuples of
three numbers (``laws/vector.py``).
"""

import inspect
from math import isfinite, sqrt
from types import FunctionType, MappingProxyType
from typing import NamedTuple

from barchan.errors import LawError, MaterialError, SceneError
from barchan.words import check_dimension, shown

VECTOR, SCALAR = 3, 1

#: Largest effective radius, relative to the grain's, for which a law is asked how far it reaches. Two grains have at most 1/2, a
#: flat wall 1; a wall that curves around the grain may have more, and counts as this.
MOST_CURVED = 4.0

#: Effective radii, relative to the largest grain's, for which it is asked; the last counts.
_SIZES = (0.01, 0.1, 0.5, 1.0, MOST_CURVED)

#: Quantities of a contact that its energy may depend on.
STORED_IN = ("overlap", "radius_first", "radius_second", "radius_eff")

#: Quantities of one contact: name -> (width, dimension, meaning). "first" is the grain with the smaller id; at a wall it
#: is the grain. All velocities are at the half step n-1/2.
QUANTITIES = MappingProxyType(
    {
        "overlap": (
            SCALAR,
            "length",
            "R_first + R_second - distance, equation (1); > 0, with ``reach`` down to -reach",
        ),
        "distance": (SCALAR, "length", "between the centres; at a wall from the centre to the wall"),
        "normal": (VECTOR, "1", "unit vector from the second to the first, at step n"),
        "normal_half": (VECTOR, "1", "the same at the half step: direction of r - dt/2 v (Vyas et al. 2025)"),
        "normal_velocity": (SCALAR, "length/time", "v_ij . normal, positive when parting, equation (2)"),
        "tangential_velocity": (VECTOR, "length/time", "slip velocity of the surfaces in the plane of normal, equation (3)"),
        "slip_velocity_half": (VECTOR, "length/time", "slip velocity of the surfaces in the plane of normal_half"),
        "relative_omega": (VECTOR, "1/time", "omega_first - omega_second; at a wall that of the grain, also if the wall turns"),
        "radius_first": (SCALAR, "length", "radius"),
        "radius_second": (SCALAR, "length", "radius; at a flat wall that of the grain"),
        "radius_eff": (SCALAR, "length", "R_i R_j / (R_i + R_j); at a flat wall R_i"),
        "mass_eff": (SCALAR, "mass", "m_i m_j / (m_i + m_j); an immobile partner counts as infinitely heavy"),
        "dt": (SCALAR, "time", "time step; 0 when forces are evaluated without advancing"),
    }
)


class Property(NamedTuple):
    """A number that a material must have for a law; ``default`` None means that it must be given."""

    dimension: str
    minimum: float = 0.0
    above: bool = False
    maximum: float = float("inf")
    default: float | None = None

    def check(self, name, value, where):
        """Return ``value`` as a float, or raise MaterialError with what is allowed."""
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = float("nan")
        low_ok = number > self.minimum if self.above else number >= self.minimum
        if not (isfinite(number) and low_ok and number <= self.maximum):
            low = f"{'>' if self.above else '>='} {self.minimum:g}"
            high = "" if self.maximum == float("inf") else f" and <= {self.maximum:g}"
            raise MaterialError(f"{where}: {name} = {shown(value)} [{self.dimension}]; it must be a finite number {low}{high}")
        return number


def mix_by_rule(first, second):
    """The default mixing rule: the geometric mean of both materials' values (equal values stay exactly as they are).

    >>> mix_by_rule({"friction": 0.2}, {"friction": 0.8})
    {'friction': 0.4}
    """
    return {name: first[name] if first[name] == second[name] else sqrt(first[name] * second[name]) for name in first}


class Law:
    """A contact law; made by the decorator ``law``.

    Attributes: ``name``, ``function``, ``properties`` (name -> Property), ``parameters`` (names of the pair parameters),
    ``history`` (name -> width), ``lever`` ("radius": torque arm R_i, equation (10); "lens": arm to the plane in which
    the two spheres cut each other), ``couple`` (whether it returns one), ``adhesive``
    (whether grains that just touch pull each other), ``reach`` (None, or a function that tells how far apart a contact
    ends), ``energy`` (None, or a function that tells what a contact stores), ``quantities`` (the names it reads).
    """

    #: What messages call it, and the quantities that it, and its energy, may ask for.
    kind, known, stored_in = "law", QUANTITIES, STORED_IN

    def __init__(self, function, properties, history, lever, mix, couple=False, adhesive=False, reach=None, energy=None):
        if not isinstance(function, FunctionType):
            raise LawError(f"{self.kind}: {shown(function)} must be a plain function (def)")
        self.function, self.name = function, function.__name__
        self.properties = self._mapping("properties", properties, "{'kn': 'force/length'}")
        self.properties = {name: self._property(name, given) for name, given in self.properties.items()}
        self.history = self._mapping("history", history, "{'slip': 3}")
        self.lever, self.mix, self.couple = lever, mix or mix_by_rule, couple
        self.adhesive, self.reach, self.energy = adhesive, reach, energy
        self.__doc__ = function.__doc__
        arguments = inspect.signature(function).parameters
        unusual = [str(a) for a in arguments.values() if a.kind is not a.POSITIONAL_OR_KEYWORD or a.default is not a.empty]
        if unusual:
            where = f"{self.kind} '{self.name}'"
            raise LawError(f"{where}: argument(s) {unusual} must be plain names, without * and without defaults")
        self.quantities = tuple(a for a in arguments if a in self.known)
        self.parameters = tuple(a for a in arguments if a not in self.known and a not in self.history)
        self._check_declaration(list(arguments))

    def _mapping(self, what, given, example):
        given = {} if given is None else given
        if not hasattr(given, "items") or not all(isinstance(name, str) for name in given):
            raise LawError(f"{self.kind} '{self.name}': {what} = {shown(given)} must map names, such as {example}")
        return dict(given)

    def _property(self, name, given):
        declared = given if isinstance(given, Property) else Property(given)
        try:
            check_dimension(f"{self.kind} '{self.name}', property {name}", declared.dimension)
        except SceneError as error:
            raise LawError(f"{error}") from None
        return declared

    def _check_declaration(self, arguments):
        where = f"{self.kind} '{self.name}'"
        missing = [name for name in self.history if name not in arguments]
        if missing:
            raise LawError(f"{where}: history {missing} is declared but is no argument of the function")
        double = [n for n in (*self.properties, *self.history) if n in self.known]
        double += [n for n in self.history if n in self.properties]
        if double:
            raise LawError(
                f"{where}: {sorted(set(double))} would mean two things; quantities of a contact, properties and "
                f"history need names of their own. Quantities: {', '.join(self.known)}"
            )
        bad_width = {n: width for n, width in self.history.items() if type(width) is not int or width not in (SCALAR, VECTOR)}
        if bad_width:
            raise LawError(f"{where}: history {bad_width} must be 1 (a number) or 3 (a vector) wide")
        if self.lever not in ("radius", "lens"):
            raise LawError(f"{where}: lever = {self.lever!r}; it must be 'radius' or 'lens'")
        for name in ("couple", "adhesive"):
            if not isinstance(getattr(self, name), bool):
                raise LawError(f"{where}: {name} = {shown(getattr(self, name))} must be True or False")
        self._check_companion(where, "reach", ("radius_eff", *self.parameters))
        self._check_companion(where, "energy", (*self.stored_in, *self.parameters, *self.history))
        if self.reach is not None and not self.history:
            raise LawError(f"{where}: it has a reach, so it must remember its contacts; declare a history")
        if not callable(self.mix):
            raise LawError(f"{where}: mix = {shown(self.mix)} must be a function of the properties of two materials")
        if self.mix is mix_by_rule:
            unknown = [name for name in self.parameters if name not in self.properties]
            if unknown:
                raise LawError(
                    f"{where}: argument(s) {unknown} are no quantity of a contact, no history and no declared "
                    f"material property. Quantities: {', '.join(self.known)}"
                )

    def _check_companion(self, where, what, known):
        function = getattr(self, what)
        if function is None:
            return
        if not isinstance(function, FunctionType):
            raise LawError(f"{where}: {what} = {shown(function)} must be a plain function (def)")
        arguments = inspect.signature(function).parameters
        unusual = [str(a) for a in arguments.values() if a.kind is not a.POSITIONAL_OR_KEYWORD or a.default is not a.empty]
        if unusual:
            raise LawError(f"{where}: argument(s) {unusual} of its {what}() must be plain names, without * and without defaults")
        unknown = [name for name in arguments if name not in known]
        if unknown:
            raise LawError(f"{where}: its {what}() asks for {unknown}; it may ask for {', '.join(known)}")

    def __call__(self, *args, **kwargs):
        """The law itself, as plain Python on plain numbers."""
        return self.function(*args, **kwargs)

    def __repr__(self):
        return f"<{self.kind} {self.name}>"

    @property
    def history_width(self):
        """Numbers remembered per contact."""
        return sum(self.history.values())

    @property
    def returns(self):
        """Width of all that the law returns by name, in order: forces, couple, history."""
        return {"normal_force": SCALAR, "tangential_force": VECTOR} | ({"couple": VECTOR} if self.couple else {}) | self.history

    @property
    def reads_spin(self):
        """True if the law needs angular velocities."""
        return bool({"tangential_velocity", "slip_velocity_half", "relative_omega"} & set(self.quantities))

    @property
    def reads(self):
        """Fields of a ghost that the law needs fresh in every step."""
        velocity = self.reads_spin or bool({"normal_velocity", "normal_half"} & set(self.quantities))
        return ("position",) + (("velocity",) if velocity else ()) + (("omega",) if self.reads_spin else ())

    @property
    def reach_arguments(self):
        """Names of what ``reach`` asks for; none if there is no such function."""
        return () if self.reach is None else tuple(inspect.signature(self.reach).parameters)

    def largest_reach(self, table, radius):
        """How far apart any contact of grains up to ``radius`` may last [length]; 0 where there are none, and the radius is 0.

        Args:
            table: (parameters, pairs of materials) of this law.

        Raises:
            LawError: the law's ``reach`` returns what is no length.
        """
        if self.reach is None or radius == 0.0:
            return 0.0
        return max(self._reach_of(column, radius) for column in table.T.tolist())

    def _reach_of(self, parameters, radius):
        """That of one pair of materials, once it is sure that smaller grains do not reach further."""
        before = 0.0
        for share in _SIZES:
            known = dict(zip(self.parameters, parameters)) | {"radius_eff": share * radius}
            try:
                length = self.reach(**{name: known[name] for name in self.reach_arguments})
            except Exception as error:  # whatever a user's function stumbles over
                raise LawError(
                    f"law '{self.name}': its reach() fails with {type(error).__name__}: {error}, for {known}"
                ) from error
            number = isinstance(length, (int, float)) and not isinstance(length, bool)
            if not (number and isfinite(length) and length >= 0.0):
                raise LawError(f"law '{self.name}': its reach() is {shown(length)} for {known}; it must be a finite number >= 0")
            if length < before * (1.0 - 1e-9):
                raise LawError(
                    f"law '{self.name}': its reach() falls from {before:g} to {length:g} [length] as radius_eff grows to "
                    f"{known['radius_eff']:g}, for {known}; it must not, or contacts of small grains would be lost"
                )
            before = float(length)
        return before

    def pair_parameters(self, first, second, where):
        """Parameters of a pair of materials, in the order of ``parameters``.

        Args:
            first, second: property name -> value of each material.
            where: who asks, for the error message.

        Raises:
            MaterialError: a property is missing, out of range, or mixes to something that is not finite.
            LawError: the law's ``mix`` fails, or returns too little.
        """
        complete = self._complete(first, where), self._complete(second, where)
        try:
            mixed = {name: float(value) for name, value in self.mix(*complete).items()}
        except Exception as error:  # whatever a user's function stumbles over
            raise LawError(f"law '{self.name}': its mix() fails with {type(error).__name__}: {error}, for {where}") from error
        absent = [name for name in self.parameters if name not in mixed]
        if absent:
            raise LawError(f"law '{self.name}': its mix() returns no {absent}")
        for name in self.parameters:
            if not isfinite(mixed[name]):
                raise MaterialError(f"{where}: parameter {name} of law '{self.name}' comes out as {mixed[name]!r}")
        return [mixed[name] for name in self.parameters]

    def _complete(self, given, where):
        return {name: self.check(name, given, where) for name in self.properties}

    def check(self, name, given, where):
        """The value of a property, or its default.

        Args:
            given: property name -> value.
            where: who asks, for the error message.

        Raises:
            MaterialError: it is missing or out of range.
        """
        prop = self.properties[name]
        value = given.get(name, prop.default)
        if value is None:
            raise MaterialError(f"{where}: law '{self.name}' needs {name} [{prop.dimension}], which is not given")
        return prop.check(name, value, where)


def law(properties=None, history=None, lever="radius", mix=None, couple=False, adhesive=False, reach=None, energy=None):
    """Declare a contact law. See ``docs/how-to/write-a-law.md``.

    Args:
        properties: material property -> Property, or its dimension as text (then it must be given and >= 0).
        history: what a contact remembers: name -> 1 (a number) or 3 (a vector). It starts at 0 with the contact, is kept
            while the grains touch and forgotten when they part.
        lever: torque arm, "radius" or "lens".
        mix: function (properties of one material, of the other) -> pair parameters; default ``mix_by_rule``.
        couple: True if the function returns a couple after the tangential force: a torque on the first grain beside that of
            the tangential force, a vector [force length]; the second feels the opposite.
        adhesive: True if grains that just touch may pull each other; ``check_law`` then asks for no more than that.
        reach: function of ``radius_eff`` and pair parameters, by name, that tells how far apart [length] two surfaces may be in
            a contact that has begun; it must not fall as ``radius_eff`` grows. Default: a contact ends where it began, at
            overlap 0. Such a law needs a history.
        energy: function of ``overlap``, radii, pair parameters and history, by name, that tells what a contact stores: in its
            normal force, from overlap 0 on, and in its tangential springs [force length]. Default: the normal force of grains
            at rest is integrated, and springs count as dissipation.

    Raises:
        LawError: the declaration is of the wrong kind, has an unknown dimension, or does not fit to the function's arguments.

    >>> @law(properties={"stiffness": "force/length"})
    ... def spring(overlap, stiffness):
    ...     return stiffness * overlap, (0.0, 0.0, 0.0)
    >>> spring(overlap=0.5, stiffness=2.0)
    (1.0, (0.0, 0.0, 0.0))
    """
    if callable(properties):
        raise LawError(
            f"law {shown(properties)}: the decorator needs brackets: @barchan.law(properties={{'kn': 'force/length'}})"
        )

    def decorate(function):
        return Law(function, properties, history, lever, mix, couple, adhesive, reach, energy)

    return decorate
