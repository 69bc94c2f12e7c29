"""Materials: what the user gave (frozen), and the table of pairs that is derived from it. Never the same object."""

from itertools import combinations_with_replacement
from types import MappingProxyType

import numpy as np

from barchan.errors import MaterialError
from barchan.laws.law import Property
from barchan.words import nearest, shown

_DENSITY = Property("mass/length^3", above=True)
_SHEAR_MODULUS = Property("force/length^2", above=True)
_POISSON_RATIO = Property("1", minimum=-1.0, above=True, maximum=0.5)


class Material:
    """What a grain or a wall is made of.

    Args:
        name: how scenes and messages call it.
        density: [mass/length^3]; a wall needs none.
        properties: what the law asks for, by name (``law.properties`` lists it). Instead of ``youngs_modulus`` the
            ``shear_modulus`` may be given together with ``poisson_ratio``: E = 2 G (1 + nu).

    Raises:
        MaterialError: a value is not a number, or out of range.

    >>> Material("glass", density=2500, shear_modulus=2.0, poisson_ratio=0.25).properties["youngs_modulus"]
    5.0
    """

    def __init__(self, name, density=None, **properties):
        self.name = str(name)
        self.density = None if density is None else _DENSITY.check("density", density, f"material '{self.name}'")
        self.given = MappingProxyType(dict(properties))

    @property
    def properties(self):
        """The properties by the names that laws use."""
        derived = dict(self.given)
        if "shear_modulus" in derived and "youngs_modulus" not in derived:
            where = f"material '{self.name}'"
            shear = _SHEAR_MODULUS.check("shear_modulus", derived.pop("shear_modulus"), where)
            if "poisson_ratio" not in derived:
                raise MaterialError(f"{where}: shear_modulus needs poisson_ratio beside it")
            ratio = _POISSON_RATIO.check("poisson_ratio", derived["poisson_ratio"], where)
            derived["youngs_modulus"] = 2.0 * shear * (1.0 + ratio)
        return derived

    def __repr__(self):
        return f"Material({self.name!r}, density={self.density!r}, {', '.join(f'{k}={v!r}' for k, v in self.given.items())})"


def _plain(properties):
    """Properties as Python's own numbers, whatever library they came from."""
    return {name: float(value) for name, value in properties.items()}


class Materials:
    """The materials of a scene and the values of their pairs.

    A pair's value is the geometric mean of both materials' values; elastic moduli are combined by contact mechanics
    (``laws/hertz_mindlin.py``); ``set_pair`` gives a pair its own. Walls go the same way as grains.
    """

    def __init__(self, materials):
        given = materials if isinstance(materials, (list, tuple)) else [materials]
        if not all(isinstance(material, Material) for material in given):
            raise MaterialError(f"materials = {shown(materials)} must be a barchan.Material or a list of them")
        self.list = list(given)
        self.pairs = {}
        names = [material.name for material in self.list]
        if not names or len(set(names)) != len(names):
            raise MaterialError(f"materials: at least one, each with a name of its own; got {names}")

    def __len__(self):
        return len(self.list)

    def index(self, name):
        """Number of a material, given by name, number or the object itself.

        Raises:
            MaterialError: there is no such material.
        """
        names = [material.name for material in self.list]
        name = getattr(name, "name", name)
        if isinstance(name, str) and name in names:
            return names.index(name)
        if isinstance(name, (int, np.integer)) and not isinstance(name, bool) and 0 <= name < len(names):
            return int(name)
        raise MaterialError(f"no material {shown(name)} in this scene; there are: {', '.join(names)}")

    def set_pair(self, first, second, **properties):
        """Values that hold for this pair only, in place of the mixed ones.

        Raises:
            MaterialError: a material of that name is missing.
        """
        key = tuple(sorted((self.index(first), self.index(second))))
        self.pairs.setdefault(key, {}).update(properties)

    def replace_pairs(self, pairs):
        """Forget what ``set_pair`` gave, and take these instead.

        Args:
            pairs: as ``describe()["pairs"]`` told them at another time: a list of dicts with ``first``, ``second`` and values.

        Raises:
            MaterialError: a material of that name is missing.
        """
        self.pairs = {}
        for pair in pairs:
            values = {name: value for name, value in pair.items() if name not in ("first", "second")}
            self.set_pair(pair["first"], pair["second"], **values)

    def check_names(self, law):
        """Refuse a property that the law does not know: most likely a typo.

        Raises:
            MaterialError: naming the property and those that the law knows.
        """
        for material in self.list:
            self._check(law, material.properties, f"material '{material.name}'")
        for (a, b), own in self.pairs.items():
            self._check(law, own, f"pair '{self.list[a].name}' - '{self.list[b].name}'")

    @staticmethod
    def _check(law, given, where):
        for name in given:
            if name not in law.properties:
                raise MaterialError(f"{where}: law '{law.name}' knows no property '{name}'; {nearest(name, law.properties)}")

    def table(self, law):
        """Pair parameters of a law, shape (parameters, materials^2); column a * materials + b is the pair (a, b).

        Raises:
            MaterialError: a property is missing, unknown to the law, or out of range.
        """
        self.check_names(law)
        size = len(self.list)
        table = np.zeros((max(len(law.parameters), 1), size * size))
        for a, b in combinations_with_replacement(range(size), 2):
            own = self.pairs.get((a, b), {})
            first, second = (dict(self.list[m].properties, **own) for m in (a, b))
            names = self.list[a].name, self.list[b].name
            where = f"material '{names[0]}'" if a == b else f"materials '{names[0]}' and '{names[1]}'"
            values = law.pair_parameters(first, second, where)
            table[: len(values), a * size + b] = table[: len(values), b * size + a] = values
        return table

    def describe(self):
        """Everything that was given, as plain data for a checkpoint or a summary."""
        return {
            "materials": [{"name": m.name, "density": m.density, **_plain(m.given)} for m in self.list],
            "pairs": [
                {"first": self.list[a].name, "second": self.list[b].name, **_plain(own)} for (a, b), own in self.pairs.items()
            ],
        }
