"""Numbers with units: "8 mm" becomes 0.008 where metres are wanted, and 0.008 is written as "0.008 m".

Nothing is evaluated: a text is taken apart by regular expressions, and pint, the table of units, is asked for one name at a
time. It is imported only where the unit given is not the one wanted (measured: 0.4 s).
"""

import re
from fractions import Fraction
from functools import cache
from math import isfinite

#: Units in which parameters are declared, and what they measure. Angles are no plain numbers here.
KINDS = {
    "1": "a plain number",
    "m": "a length",
    "m^2": "an area",
    "m^3": "a volume",
    "s": "a time",
    "kg": "a mass",
    "deg": "an angle",
    "1/s": "a rate",
    "deg/s": "an angular velocity",
    "m/s": "a velocity",
    "m/s^2": "an acceleration",
    "kg/m^3": "a density",
    "N": "a force",
    "N/m": "a stiffness",
    "m/N/s": "a gain of force control",
    "Pa": "a pressure",
    "Pa/s": "a rate of pressure",
    "Pa/m": "a stiffness of an area",
    "J": "an energy",
    "W": "a power",
    "K": "a temperature",
}

_LONGEST_UNIT = 40
_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][+-]?[0-9]{1,3})?)\s*")
_FACTOR = re.compile(r"(^|\s*[*/]\s*|\s+)(1(?=\s*/)|[A-Za-zµμΩ]+|°|%)(?:\s*(?:\^|\*\*)\s*(-?[1-9])(?![0-9]))?")
_SIGNS = {"°": "degree", "%": "percent"}


def parse(text, unit):
    """The number that a text means, in ``unit``.

    Correctly rounded: "1.12 mm" is exactly the double 1.12e-3.

    Args:
        text: such as "8 mm", "31.2 deg" or "1.7 g/cm^3"; without a unit it is in ``unit``.
        unit: one of ``KINDS``.

    Raises:
        ValueError: the text is no finite number with a unit of the same kind; the message says what it is instead.

    >>> parse("1.12 mm", "m"), parse("1.7 g/cm^3", "kg/m^3"), parse("50 %", "1")
    (0.00112, 1700.0, 0.5)
    """
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError("no finite number")
    digits, given = match[1], text[match.end() :].strip()
    number = float(digits)
    if given and _normal(given) != unit:
        factor = _factor(given, unit)
        try:
            number = float(Fraction(digits) * factor)
        except OverflowError:
            number = float("inf")
    if not isfinite(number) or (number == 0.0 and Fraction(digits) != 0):
        raise ValueError(f"too {'small' if number == 0.0 else 'large'} for a double-precision number")
    return number


def written(value, unit):
    """A number with its unit, so that ``parse`` gives back the same bits.

    >>> written(0.008, "m")
    '0.008 m'
    """
    return repr(float(value)) if unit == "1" else f"{float(value)!r} {unit}"


def readable(value, unit):
    """A number with its unit for a person: four digits, lengths and times in thousandths and millionths where they are small,
    pressures in thousands, millions and billions where they are large.

    >>> readable(0.00448, "m"), readable(1e-5, "s"), readable(125584.0, "N/m"), readable(0.468, "1"), readable(1e5, "Pa")
    ('4.48 mm', '10 µs', '1.256e+05 N/m', '0.468', '100 kPa')
    """
    if unit in ("m", "s") and value:
        factor, prefix = next((f, p) for f, p in ((1.0, ""), (1e3, "m"), (1e6, "µ")) if abs(value) * f >= 1.0 or p == "µ")
        return f"{value * factor:.4g} {prefix}{unit}"
    if unit in ("Pa", "Pa/s"):
        factor, prefix = next((f, p) for f, p in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, "")) if abs(value) >= f or not p)
        return f"{value / factor:.4g} {prefix}{unit}"
    return f"{value:.4g}" + (f" {unit}" if unit != "1" else "")


def _normal(unit):
    return unit.replace(" ", "").replace("**", "^")


def _factor(given, unit):
    """What one ``given`` is in ``unit``, an exact fraction (with 50 digits of pi)."""
    size, kind = _size_and_kind(given)
    own_size, own_kind = _size_and_kind(unit)
    if kind != own_kind:
        known = {_size_and_kind(known)[1]: name for known, name in KINDS.items()}
        raise ValueError(known.get(kind, "of another dimension"))
    return size / own_size


@cache
def _size_and_kind(unit):
    """A unit in base units, and which ones: a fraction, and something to compare.

    Raises:
        ValueError: this is no unit, or none that a factor converts.
    """
    from pint.util import to_units_container

    product = _registry().dimensionless
    for name, power in _factors(unit):
        product = product * _one(name) ** power
    base = _registry().Quantity(Fraction(1), product).to_root_units()
    return Fraction(base.magnitude), to_units_container(base.units)


def _factors(unit):
    """Names of units and their powers; "kg/m^3" -> [("kg", 1), ("m", -3)]."""
    found, end, rest = [], 0, f"1{unit}" if unit.startswith("/") else unit
    while end < len(rest) <= _LONGEST_UNIT:
        match = _FACTOR.match(rest, end)
        if match is None:
            break
        power = int(match[3] or 1)
        found.append((match[2], -power if match[1].strip() == "/" else power))
        end = match.end()
    if end != len(rest) and unit != "1":
        raise ValueError(f"{unit[:_LONGEST_UNIT]!r} cannot be read as a unit; write it like kg/m^3")
    return [(_SIGNS.get(name, name), power) for name, power in found if name != "1"]


def _one(name):
    """A unit of pint by its name."""
    if not _registry().parse_unit_name(name):
        raise ValueError(f"there is no unit '{name}'")
    try:
        unit = _registry().Unit(name)
        zero = _registry().Quantity(Fraction(0), unit).to_root_units().magnitude
    except TypeError:  # a logarithmic unit, or a prefix before a unit with a zero of its own
        zero = None
    if zero != 0:
        raise ValueError(f"'{name}' has a zero or a scale of its own and is not converted; use another unit")
    return unit


@cache
def _registry():
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Fraction)
