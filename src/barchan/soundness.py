"""Is a state from a file one that a simulation can go on from? A file is data from outside: it is believed only after this.

The loops trust their arrays blindly, so shapes, types, ids and contacts are checked here, before they meet one. What a number
means (a radius above zero, a known material) is checked by ``preflight``, as it is for grains that a script adds.
"""

from math import isfinite
from reprlib import Repr
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from barchan.bonds.cracks import COLUMNS
from barchan.domain import SHEARS
from barchan.fields import TABLE
from barchan.kernels.loads import SUMS

#: How values are shown: one short line, however long or deep they are.
_REPR = Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 60

_Count = Annotated[int, Field(ge=0, lt=2**62)]
_Three = Annotated[list[float], Field(min_length=3, max_length=3)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid")


def _is_new(name):
    if name in {field.name for field in TABLE}:
        raise ValueError("every grain has that field anyway")
    return name


class _UserField(_Part):
    """The grains check the rest when the field is added."""

    name: Annotated[str, AfterValidator(_is_new)]
    width: Annotated[int, Field(ge=1, le=1000)]
    dtype: Literal[
        "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float16", "float32", "float64"
    ]
    default: float
    dimension: str


class _Damping(_Part):
    local: Annotated[float, Field(ge=0.0, lt=1.0, allow_inf_nan=False)]
    viscous: Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Law(_Part):
    name: str
    hash: str
    history: dict[str, Literal[1, 3]]


class _Bonds(_Part):
    law: _Law | None
    kinds: list[dict[str, Any]]
    active: bool


class _Box(_Part):
    dimension: Literal[2, 3]
    low: _Three
    high: _Three
    periodic: Annotated[list[bool], Field(min_length=3, max_length=3)]


class _Servo(_Part):
    rate: Annotated[float, Field(allow_inf_nan=False)]
    steady: Annotated[float, Field(allow_inf_nan=False)]


class _Stretched(_Part):
    low: _Three
    high: _Three
    middle: _Three
    tilt: _Three
    rate: Annotated[list[float], Field(min_length=6, max_length=6)]
    servos: Annotated[list[_Servo | None], Field(min_length=6, max_length=6)]


class _About(_Part):
    """The facts beside the arrays, see ``checkpoint.State``."""

    format: int
    step: _Count
    time: Annotated[float, Field(allow_inf_nan=False)]
    dt: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
    next_id: _Count
    forces_are_current: bool
    large_overlaps: _Count
    notes: dict[str, Any]
    gravity: dict[Literal["hash", "value"], Any]
    damping: _Damping
    law: _Law
    bonds: _Bonds
    materials: dict[str, Any]
    walls: list[dict[str, Any]]
    loads: list[list[float]]
    shape: Literal["sphere", "disc"]
    box: _Box
    stretched: _Stretched
    user_fields: list[_UserField]


def structure_fault(state):
    """What is wrong with the structure of a ``checkpoint.State``, or None. Values may be anything: a run that failed is saved,
    too.

    Returns:
        A text such as "radius has shape (3,), not (4,)".
    """
    about, fields, contacts, bonds, cracks = state
    try:
        _About.model_validate(about)
    except ValidationError as error:
        first = error.errors()[0]
        return f"'{'.'.join(str(part) for part in first['loc'])[:100]}' is wrong: {' '.join(first['msg'].split())[:200]}"
    return (
        _field_fault(about, fields)
        or _contact_fault(about, fields["id"], contacts)
        or _bond_fault(about, fields["id"], bonds)
        or _crack_fault(about, cracks)
    )


def _field_fault(about, fields):
    expected = {field.name: (field.dtype, field.width) for field in TABLE if field.saved}
    expected |= {field["name"]: (field["dtype"], field["width"]) for field in about["user_fields"]}
    if fields.keys() != expected.keys():
        return f"fields are missing, or do not belong to it: {', '.join(sorted(fields.keys() ^ expected.keys()))[:200]}"
    count = len(fields["id"]) if fields["id"].ndim else 0
    for name, (dtype, width) in expected.items():
        shape = (count, width) if width > 1 else (count,)
        if fields[name].dtype != dtype or fields[name].shape != shape:
            found = fields[name]
            return f"{name} has type {found.dtype} and shape {found.shape}, not {np.dtype(dtype).name} and {shape}"
    ids = fields["id"]
    if len(ids) and not (ids[0] >= 0 and (np.diff(ids) > 0).all() and ids[-1] < about["next_id"]):
        return f"ids do not ascend from 0 to below next_id = {about['next_id']}"
    return None


def _contact_fault(about, ids, contacts):
    fault = _rows_fault("contacts", ids, contacts, sum(about["law"]["history"].values()))
    if fault:
        return fault
    keys, owners = contacts.keys, np.repeat(np.arange(len(ids)), np.diff(contacts.start))
    unknown = (keys < -_keys_of(about["walls"])) | (keys >= about["next_id"]) | (keys == ids[owners])
    if unknown.any():
        row = int(np.argmax(unknown))
        return f"grain {ids[owners[row]]} has a contact with {keys[row]}, which is no other grain and no wall"
    twice = (keys >= 0) & (keys < ids[owners])
    if twice.any():
        row = int(np.argmax(twice))
        return f"grain {ids[owners[row]]} remembers its contact with grain {keys[row]}, whose is the smaller id"
    return None


def _keys_of(walls):
    """How many keys walls have."""
    counts = [wall.get("patches", 1) for wall in walls]
    return sum(count for count in counts if type(count) is int and count > 0)


def _rows_fault(what, ids, rows, width):
    """What is wrong with the form of rows of grains, or None."""
    start, keys, values = rows
    if not (start.dtype == keys.dtype == np.int64 and values.dtype == np.float64):
        return f"{what} have types {start.dtype}, {keys.dtype}, {values.dtype}, not int64, int64, float64"
    fault = order_fault(start, len(keys))
    if fault:
        return fault
    if start.shape != (len(ids) + 1,) or keys.ndim != 1 or values.shape != (len(keys), width):
        return f"{what} have shapes {start.shape}, {keys.shape}, {values.shape}; they do not fit {len(ids)} grains"
    owners = np.repeat(np.arange(len(ids)), np.diff(start))
    if ((owners[1:] == owners[:-1]) & (keys[1:] <= keys[:-1])).any():
        return f"{what} of a grain are not in ascending order"
    return None


def _bond_fault(about, ids, bonds):
    law, kinds = about["bonds"]["law"], len(about["bonds"]["kinds"])
    fault = _rows_fault("bonds", ids, bonds, 2 + (sum(law["history"].values()) if law else 0))
    if fault:
        return fault
    owners = np.repeat(ids, np.diff(bonds.start))
    if ((bonds.keys <= owners) | (bonds.keys >= about["next_id"])).any():
        return "a grain has a bond with what is no grain of larger id"
    known = np.isin(bonds.values[:, 0], np.arange(kinds)) & (bonds.values[:, 1] > 0.0)
    if not known.all() or (len(bonds.keys) and not about["bonds"]["active"]):
        return f"a bond is of none of its {kinds} kinds, or has no strength"
    return None


def _crack_fault(about, cracks):
    if cracks.dtype != np.float64 or cracks.shape[1:] != (len(COLUMNS),):
        return f"cracks have type {cracks.dtype} and shape {cracks.shape}"
    step, first, second = (cracks[:, list(COLUMNS).index(name)] for name in ("step", "first", "second"))
    known = (first >= 0) & (second > first) & (second < about["next_id"]) & (step >= 0) & (step <= about["step"])
    if not known.all() or not np.array_equal(np.lexsort((step, second, first)), np.arange(len(cracks))):
        return "cracks are not between two of the grains, up to its step, in the order of these"
    return None


def order_fault(start, count):
    """What is wrong with where the contacts of each grain begin, if there are ``count`` in all, or None."""
    if start.dtype != np.int64 or start.ndim != 1 or len(start) == 0:
        return f"where contacts begin has type {start.dtype} and shape {start.shape}"
    if start[0] != 0 or start[-1] != count or (start[1:] < start[:-1]).any():
        return f"contacts of the grains do not follow each other from 0 to {count}"
    return None


def value_fault(state, walls):
    """Why a sound structure cannot be gone on from, or None.

    Args:
        state: a ``checkpoint.State``.
        walls: states of the walls of the simulation that would go on, as ``Wall.state`` gives them.
    """
    fault = _stretch_fault(state.about["box"], state.about["stretched"])
    if fault:
        return fault
    low, high = (np.array(state.about["stretched"][side]) for side in ("low", "high"))
    position = state.fields["position"]
    outside = np.flatnonzero(~((position >= low) & (position <= high)).all(axis=1))
    if len(outside):
        row = outside[0]
        return f"grain {state.fields['id'][row]} at {position[row].tolist()} is not inside the box"
    if not np.isfinite(state.contacts.values).all():
        return "a contact remembers a value that is not finite"
    if not (np.isfinite(state.bonds.values).all() and np.isfinite(state.cracks).all()):
        return "a bond remembers, or a crack was, a value that is not finite"
    gravity = state.about["gravity"]
    if not (_alike(gravity, {"hash": ""}) or _alike(gravity, {"value": [0.0, 0.0, 0.0]})):
        return "gravity is neither three finite numbers nor a function"
    for number, (there, here) in enumerate(zip(state.about["walls"], walls)):
        units = (
            [there[name] for name in ("normal", "half", "axis", "axis_x", "axis_y") if name in there]
            if _alike(there, here)
            else [[0.0]]
        )
        if any(abs(sum(n**2 for n in unit) - 1.0) > 1e-9 for unit in units) or _keys(there) != _keys(here):
            return f"wall {number} is not described as a {here['kind']} is"
        small = [name for name in ("radius", "radius_low", "radius_high", "length") if there.get(name, 1.0) < 0.0]
        if small or there.get("radius", 1.0) == 0.0:
            return (
                f"wall {number}, a {here['kind']}, has {small[0] if small else 'radius'} = {there[small[0]] if small else 0.0:g}"
            )
    loads = state.about["loads"]
    if len(loads) not in (0, len(walls)) or any(len(row) != SUMS + 2 or not np.isfinite(row).all() for row in loads):
        return f"loads of walls are not {SUMS + 2} finite numbers for each of {len(walls)} walls"
    if loads and not state.about["forces_are_current"]:
        return "it has loads of walls, and forces that are not those of its state"
    return None


def _stretch_fault(box, stretched):
    """Why a box cannot have become what it is said to be, or None."""
    low, high, middle, tilt = (np.array(stretched[name]) for name in ("low", "high", "middle", "tilt"))
    rate, shear_rate = np.split(np.array(stretched["rate"]), [3])
    if not (np.isfinite([low, high, middle, tilt, rate, shear_rate]).all() and (high >= low).all()):
        return "the box is stretched to what is none"
    still = ~np.array(box["periodic"])
    flow, along = np.array(SHEARS).T
    sheared, far = (tilt != 0.0) | (shear_rate != 0.0), 2.0 * np.abs(tilt) > (high - low)[flow] * (1.0 + 1e-9)
    if sheared.sum() > 1 or (sheared & (still[flow] | still[along])).any() or far.any():
        return "the box is sheared in more ways than one, along an axis that is not periodic, or by more than half a period"
    moved = (low != box["low"]) | (high != box["high"]) | (rate != 0.0) | (middle != high - low)
    flat = (high == low) | (middle <= 0.0)
    if (moved & still).any() or (flat & ~still).any():
        return "the box is stretched along an axis that is not periodic, or to nothing"
    return None


def _keys(wall):
    return wall["key"], wall.get("patches", 1)


def _alike(there, here):
    """True if plain data has the form of other data: keys, lengths, types; numbers must be finite."""
    if isinstance(here, dict):
        return isinstance(there, dict) and there.keys() == here.keys() and all(_alike(there[k], here[k]) for k in here)
    if isinstance(here, list):
        return isinstance(there, list) and len(there) == len(here) and all(map(_alike, there, here))
    if isinstance(here, float):
        return isinstance(there, float) and isfinite(there)
    return type(there) is type(here)


def _named(wall):
    """What a script says of a wall that no run changes."""
    control = wall.get("control") if isinstance(wall.get("control"), dict) else {}
    shape = [wall["mesh"]] if "mesh" in wall else []
    return wall.get("kind"), wall.get("material"), *shape, *([control.get("kind"), control.get("given")] if control else [])


def foreign(there, here):
    """How a checkpoint belongs to another scene, or None.

    Args:
        there, here: what ``checkpoint`` keeps of the scene beside the arrays: of the file, of the simulation.

    Returns:
        The first difference, such as "materials glass friction is 0.5 there and 0.4 here".
    """
    law, own = there["law"], here["law"]
    if law["name"] != own["name"]:
        return f"its law is {_short(law['name'])}, here it is {_short(own['name'])}"
    if law != own:
        return f"law {_short(own['name'])} has changed since"
    difference = _difference(there["bonds"]["law"], here["bonds"]["law"])
    difference = difference or _difference(there["bonds"]["kinds"], here["bonds"]["kinds"])
    if difference:
        return f"bonds: {difference}"
    spaces = ({name: about[name] for name in ("box", "shape")} for about in (there, here))
    difference = _difference(there["materials"], here["materials"]) or _difference(*spaces)
    if difference:
        return difference
    rates = ("x", "y", "z", "xy", "xz", "yz")
    servos = ([rate for rate, one in zip(rates, about["stretched"]["servos"]) if one is not None] for about in (there, here))
    difference = _difference(*({"what a StressServo finds": found} for found in servos))
    if difference:
        return difference
    walls, own_walls = ([_named(wall) for wall in about["walls"]] for about in (there, here))
    if len(walls) != len(own_walls):
        return f"it has {len(walls)} walls, here there are {len(own_walls)}; add the same walls in the same order"
    for number, (wall, own_wall) in enumerate(zip(walls, own_walls)):
        if wall != own_wall:
            return f"walls: (kind, material and control) of wall {number} is {_short(wall)} there and {_short(own_wall)} here"
    return _gravity_difference(there["gravity"], here["gravity"]) or _user_field_difference(there, here)


def _gravity_difference(there, here):
    if "hash" not in there and "hash" not in here:
        return None  # a constant is taken from the file
    if "hash" in there and "hash" in here:
        return None if there == here else "its gravity is a function of time that has changed since"
    return f"its gravity is {'a function of time' if 'hash' in there else 'constant'}, here it is not"


def _user_field_difference(there, here):
    known = {field["name"]: field for field in here["user_fields"]}
    for field in there["user_fields"]:
        own = known.get(field["name"], field)
        for what in ("width", "dtype"):
            if own[what] != field[what]:
                return f"{what} of field '{field['name']}' is {field[what]} there and {own[what]} here"
    return None


def _difference(there, here):
    """The first difference of two pieces of plain data: where, and both values.

    >>> _difference({"density": True}, {"density": 1.0})
    'density is True there and 1.0 here'
    """
    if isinstance(there, dict) and isinstance(here, dict):
        parts = [(name, there.get(name, "not given"), here.get(name, "not given")) for name in here | there]
    elif _are_tables(there) and _are_tables(here) and len(there) == len(here):
        parts = [(own.get("name", number), table, own) for number, (table, own) in enumerate(zip(there, here))]
    else:
        same = there == here and isinstance(there, bool) == isinstance(here, bool)
        return None if same else f"is {_short(there)} there and {_short(here)} here"
    found = ((name, _difference(t, h)) for name, t, h in parts)
    return next((f"{str(name)[:60]} {text}" for name, text in found if text), None)


def _are_tables(value):
    return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)


def _short(value):
    return " ".join(_REPR.repr(value).split())
