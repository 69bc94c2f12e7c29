"""What a scene is: the parameters of an experiment with their units, checked before anything starts.

In a file it is TOML: the line ``experiment = "avalanche"``, then a table ``[parameters]`` with lines such as
``angle = "31.2 deg"``, then perhaps a table ``[ran_with]`` that says what a run was made with.
"""

import json
import re
import tomllib
from pathlib import Path
from typing import ClassVar, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from barchan import atomic, units
from barchan.errors import SceneError
from barchan.words import nearest, shown

#: A scene file has neither more bytes nor longer lines: reading a line of dotted keys takes the square of its length.
_LARGEST_FILE, _LONGEST_LINE = 1_000_000, 1000

_TABLES = ("experiment", "parameters", "ran_with")
_BOUNDS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


def quantity(default, unit, description, **bounds):
    """A parameter with a unit, for the body of a ``Scene``.

    A plain number given for it is in ``unit``; a text has a unit of its own: "8 mm", "31.2 deg", "1.7 g/cm^3".

    Args:
        default: number [unit].
        unit: one of ``barchan.units.KINDS``: SI units, degrees for angles, "1" for a plain number.
        description: a few words.
        bounds: ``gt``, ``ge``, ``lt``, ``le`` [unit].

    Raises:
        SceneError: the unit is none of those.
    """
    if unit not in units.KINDS:
        raise SceneError(f"quantity: unknown unit {shown(unit)}; {nearest(unit, units.KINDS)}")
    return Field(default, description=description, json_schema_extra={"unit": unit}, **bounds)


class Scene(BaseModel):
    """Parameters of an experiment. Subclasses declare them, each with bounds and a description.

    >>> class Slope(Scene):
    ...     angle: float = quantity(30.0, "deg", "angle of the floor", gt=0.0, lt=90.0)
    >>> Slope.make({"angle": "0.5 rad"}).text("angle")
    '28.64788975654116 deg'
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    #: Parameters that may grow when a run is resumed: they only say how far it goes.
    extendable: ClassVar[tuple] = ()

    @field_validator("*", mode="before")
    @classmethod
    def _without_unit(cls, value, info):
        unit = _unit(cls.model_fields[info.field_name])
        return units.parse(value, unit) if unit is not None and isinstance(value, str) else value

    @classmethod
    def make(cls, values):
        """A scene from a mapping of parameters; what is not given has its default.

        Raises:
            SceneError: an unknown parameter (with the nearest known name), or a value that cannot be: wrong type, wrong
                dimension, out of bounds.
        """
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            problems = [_problem(cls, entry, values) for entry in error.errors()]
            more = [f"and {len(problems) - 3} more"] if len(problems) > 3 else []
            raise SceneError("; ".join(problems[:3] + more)) from None

    def text(self, name):
        """The value of a parameter as a person writes it: "31.2 deg"."""
        value, unit = getattr(self, name), _unit(type(self).model_fields[name])
        return str(value) if unit is None else units.written(value, unit)

    def help(self, name):
        """What a parameter is, for the command line: its choices, if it has some, and its value, which is the default."""
        field = type(self).model_fields[name]
        choices = [_allowed(field)] if get_origin(field.annotation) is Literal else []
        return "; ".join([field.description, *choices, f"default {self.readable(name)}"])

    def readable(self, name):
        """The value of a parameter with a prefix that suits it, "25 mm", if that is all of it.

        >>> class Slope(Scene):
        ...     length: float = quantity(0.2, "m", "length of the floor", gt=0.0)
        >>> Slope().readable("length"), Slope.make({"length": 0.123456}).readable("length"), Slope().help("length")
        ('200 mm', '0.123456 m', 'length of the floor; default 200 mm')
        """
        value, unit = getattr(self, name), _unit(type(self).model_fields[name])
        if unit in (None, "1"):
            return str(value)
        short = units.readable(value, unit)
        return short if units.parse(short, unit) == value else self.text(name)

    def rounded(self, name, value):
        """A value of the parameter ``name`` for a table.

        >>> class Slope(Scene):
        ...     length: float = quantity(1.0, "m", "length of the floor", gt=0.0)
        >>> Slope().rounded("length", 0.123456)
        '123.5 mm'
        """
        return units.readable(value, _unit(type(self).model_fields[name]))

    def fixed_part(self):
        """The parameters that a run cannot change once it has begun, as plain values."""
        return {name: value for name, value in self.model_dump().items() if name not in self.extendable}

    def differences(self, other):
        """Lines on the parameters in which another scene of the same experiment differs from this one."""
        names = [name for name in type(self).model_fields if getattr(self, name) != getattr(other, name)]
        return [f"{name} = {self.text(name)}, not {other.text(name)}" for name in names]


def parse_assignment(text, scene_class):
    """Name and value of a parameter from a text such as "radius_max=1.12mm".

    Raises:
        SceneError: there is no "=", no such parameter, or the value cannot be.

    >>> class Slope(Scene):
    ...     angle: float = quantity(30.0, "deg", "angle of the floor", gt=0.0, lt=90.0)
    >>> parse_assignment("angle=31.2deg", Slope)
    ('angle', 31.2)
    """
    name, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not name:
        example = next(iter(scene_class.model_fields.items()))
        raise SceneError(f"{_given(text)} sets no parameter; write NAME=VALUE, for instance {example[0]}={_example(example[1])}")
    if name not in scene_class.model_fields:
        raise SceneError(_unknown("parameter", name, scene_class.model_fields))
    value = _typed(given, scene_class.model_fields[name].annotation)
    try:
        scene_class.model_validate({name: value})
    except ValidationError as error:  # whether it fits to the others is seen when all are known
        problems = [_problem(scene_class, entry, {name: given}) for entry in error.errors() if entry["loc"][:1] == (name,)]
        if problems:
            raise SceneError(problems[0]) from None
    unit = _unit(scene_class.model_fields[name])
    return name, value if unit is None else units.parse(value, unit)


def read_scene_file(path, known):
    """Read a scene from a TOML file.

    Args:
        path: of the file.
        known: name of an experiment -> its ``Scene`` class.

    Returns:
        (name of the experiment, its scene).

    Raises:
        SceneError: the file cannot be read, is no TOML, or holds no sound scene.
    """
    try:
        content = _toml_tables(path)
        unknown = [name for name in content if name not in _TABLES]
        if unknown:
            raise SceneError(_unknown("key", unknown[0], _TABLES) + "; parameters stand below the line [parameters]")
        if "experiment" not in content:
            raise SceneError(f'it does not say which experiment; write, before [parameters]: experiment = "{next(iter(known))}"')
        name = content["experiment"]
        if not isinstance(name, str) or name not in known:
            raise SceneError(_unknown("experiment", name, known))
        for table in _TABLES[1:]:
            if not isinstance(content.get(table, {}), dict):
                raise SceneError(f"'{table}' must be a table, begun by the line [{table}], not {_given(content[table])}")
        for key, value in content.get("ran_with", {}).items():
            if not isinstance(value, (str, int, float)):
                raise SceneError(f"{_given(key)} in [ran_with] must be text or a number, not {_given(value)}")
        return name, known[name].make(content.get("parameters", {}))
    except SceneError as error:
        raise SceneError(f"scene {path}: {error}") from None


def write_scene_file(path, experiment, scene, ran_with):
    """Write a scene as a TOML file that ``read_scene_file`` reads back to the same bits; atomically.

    Args:
        path: of the file.
        experiment: its name.
        scene: its ``Scene``.
        ran_with: what it ran with, such as versions: name -> text or number.

    Raises:
        OSError: the file cannot be written.
    """
    lines = [f"experiment = {_toml(experiment)}", "", "[parameters]"]
    for name, field in type(scene).model_fields.items():
        value = scene.text(name) if _unit(field) not in (None, "1") else getattr(scene, name)
        comment = f"  # {field.description}" if field.description else ""
        lines.append(f"{_key(name)} = {_toml(value)}{comment}")
    lines += ["", "[ran_with]", *(f"{_key(name)} = {_toml(value)}" for name, value in ran_with.items())]
    with atomic.writing(path) as partial:
        partial.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _toml_tables(path):
    """What a TOML file holds, as plain dictionaries."""
    try:
        if not Path(path).is_file():
            raise SceneError("it is a directory; give a file" if Path(path).is_dir() else "there is no such file")
        with open(path, "rb") as file:
            data = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise SceneError(f"it cannot be read: {error.strerror}") from None
    if len(data) > _LARGEST_FILE:
        raise SceneError(f"it is larger than {_LARGEST_FILE:,} bytes; this is no scene")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise SceneError(f"line {line} is no UTF-8 text (byte {data[error.start]:#04x}); this is no TOML file") from None
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > _LONGEST_LINE:
            raise SceneError(f"line {number} has {len(line):,} characters; at most {_LONGEST_LINE:,} are allowed")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError("lists or tables lie in each other too deep") from None
    except ValueError as error:
        raise SceneError(f"no valid TOML: {' '.join(str(error).split())}") from None


def _key(name):
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else _toml(name)


def _toml(value):
    """A value as TOML writes it."""
    if isinstance(value, str):  # as in JSON, but for one control character that TOML wants escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _typed(text, annotation):
    """A text from a command line as the type of its parameter; left alone where it is none, so that the check says so."""
    if annotation is int and re.fullmatch("[+-]?[0-9]{1,30}", text):
        return int(text)
    if annotation is bool:
        return {"true": True, "false": False}.get(text.lower(), text)
    return text


def _unit(field):
    return (field.json_schema_extra or {}).get("unit")


def _unknown(what, name, known):
    return f"unknown {what} {shown(name, 60)}; {nearest(name, known)}"


def _problem(scene_class, entry, values):
    """One line on one entry of pydantic's list of problems: parameter, value, what is allowed."""
    if not entry["loc"]:
        if entry["type"] == "value_error":  # parameters that do not fit together
            return str(entry["ctx"]["error"])
        return f"a scene is a mapping from names of parameters to values, not {_given(values)}"
    name = entry["loc"][0]
    if name not in scene_class.model_fields:
        return _unknown("parameter", name, scene_class.model_fields)
    field = scene_class.model_fields[name]
    given = f" = {_given(values[name])}" if entry["type"] != "missing" else ""
    reason = {"missing": "missing; ", "finite_number": "not finite; "}.get(entry["type"], "")
    if entry["type"] == "value_error":
        reason = f"{entry['ctx']['error']}; "
    meaning = f" ({field.description})" if field.description else ""
    example = "" if field.is_required() else f", for instance {_example(field)}"
    return f"{name}{given}{meaning}: {reason}{_allowed(field)} is needed{example}"


def _allowed(field):
    """What a parameter may be: "an angle > 0 and < 90 deg"."""
    if get_origin(field.annotation) is Literal:
        return f"one of {', '.join(repr(choice) for choice in get_args(field.annotation))}"
    unit = _unit(field)
    kinds = {int: "a whole number", bool: "true or false", str: "a text", float: "a number"}
    kind = units.KINDS[unit] if unit is not None else kinds.get(field.annotation, "another value")
    bounds = [(sign, getattr(rule, name)) for rule in field.metadata for name, sign in _BOUNDS.items() if hasattr(rule, name)]
    limits = " and ".join(f"{sign} {bound:g}" if isinstance(bound, float) else f"{sign} {bound}" for sign, bound in bounds)
    return " ".join(filter(None, (kind, limits, unit if limits and unit != "1" else "")))


def _example(field):
    unit = _unit(field)
    return repr(field.default) if unit in (None, "1") else repr(units.written(field.default, unit))


def _given(value):
    return "a table" if isinstance(value, dict) else "a list" if isinstance(value, (list, tuple)) else shown(value, 60)
