"""A scene from outside, damaged or made to harm: a clear error of one line, or a sound scene. Never anything else."""

import contextlib
import math
import tomllib

import numpy as np
import pint
import pytest
from fuzzing import EDITS, cases, fuzz, mutated, one_line
from hypothesis import strategies as st

from barchan.errors import SceneError
from barchan.experiments.avalanche.parameters import Avalanche
from barchan.scene import parse_assignment, read_scene_file, write_scene_file
from barchan.units import KINDS, parse

PINT = pint.UnitRegistry()
BOUNDS = {"gt": float.__gt__, "ge": float.__ge__, "lt": float.__lt__, "le": float.__le__}

NAMES = st.sampled_from([*Avalanche.model_fields, "lenght", "Length", "", "a b", "a\nb", "__class__", "make"])
NUMBERS = st.sampled_from(
    "0 1 8 -1 0.5 31.2 1.12 1e-3 1e400 -1e-400 nan inf 9**9**9 1_000 .5 5. ++1 0x10 ٣ 1e 10000000000".split()
)
UNITS = st.sampled_from(
    "mm m s deg rad ° % 1 1/s /s kg/m^3 g/cm^3 g/cm**3 N/m kN/mm Hz rpm degC dB USD m^2 m^-1 m^9 m^99 m^9^9 m**9**9 (m) µm μm in "
    "mmm nan pi m/s^2 km/h^2 //m m* m*1".split()
)
QUANTITIES = st.builds("{}{}{}".format, NUMBERS, st.sampled_from(["", " ", "  ", "\n"]), UNITS)
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    QUANTITIES,
    st.sampled_from([10**400, -(10**4000), 2**63]),
)
VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner, max_size=2)
)
TOKENS = st.sampled_from(
    [
        *Avalanche.model_fields,
        *"\n . # = [ ] { } , \" ' \x00 é ''' 1 -0.0 nan 1e999 '8mm' '31.2deg' true 1979-05-27".split(" "),
        *"experiment 'avalanche' [parameters] [ran_with] [[parameters]]".split(),
        " ",
        "9" * 5000,
    ]
)


def reading(text, unit):
    """What a text means, by another way: the longest beginning that is a number, and pint for the rest."""
    text = text.strip()
    for end in range(len(text), 0, -1):
        with contextlib.suppress(ValueError):
            number, rest = float(text[:end]), text[end:].strip()
            return number * PINT.Quantity(f"1 {rest}").m_as(unit) if rest else number
    raise AssertionError(f"{text!r} begins with no number")


def check_scene(scene, values):
    """A scene that was accepted: every value finite and in bounds, and what was given is what it holds."""
    assert set(values) <= set(Avalanche.model_fields), "an unknown parameter was accepted"
    for name, field in Avalanche.model_fields.items():
        value = getattr(scene, name)
        if not isinstance(value, str):
            assert type(value) in (int, float) and math.isfinite(value)
            for rule in field.metadata:
                for bound, holds in BOUNDS.items():
                    assert holds(float(value), float(getattr(rule, bound))) if hasattr(rule, bound) else True
        if name not in values:
            assert value == field.default
        elif isinstance(values[name], str) and not isinstance(value, str):
            assert value == pytest.approx(reading(values[name], field.json_schema_extra["unit"]), rel=1e-9)
        else:
            assert value == values[name] and not isinstance(values[name], bool)


def check_file(path):
    """A scene file: refused in one line that names it, or a sound scene that is written and read back to the same bits."""
    known = {"avalanche": Avalanche}
    try:
        name, scene = read_scene_file(path, known)
    except SceneError as error:
        assert str(path) in one_line(error)
        return False
    content = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    assert name == content["experiment"] == "avalanche" and set(content) <= {"experiment", "parameters", "ran_with"}
    check_scene(scene, content.get("parameters", {}))
    write_scene_file(path, name, scene, content.get("ran_with", {}))
    again = read_scene_file(path, known)[1]
    assert [repr(v) for v in again.model_dump().values()] == [repr(v) for v in scene.model_dump().values()]
    return True


@cases(400)
def test_arbitrary_bytes_are_no_scene(count, tmp_path):
    @fuzz(count, data=st.binary(max_size=200))
    def _(data):
        (tmp_path / "s.toml").write_bytes(data)
        check_file(tmp_path / "s.toml")


@cases(600)
def test_what_looks_like_toml(count, tmp_path):
    @fuzz(count, tokens=st.lists(TOKENS, max_size=30), begun=st.booleans())
    def _(tokens, begun):
        text = 'experiment = "avalanche"\n[parameters]\n' * begun + "".join(tokens)
        (tmp_path / "s.toml").write_bytes(text.encode())
        check_file(tmp_path / "s.toml")


@cases(600)
def test_a_sound_file_with_damage(count, tmp_path):
    write_scene_file(
        tmp_path / "sound.toml", "avalanche", Avalanche.make({"angle": "0.5 rad", "seed": 7}), {"barchan": "1", "cores": 2}
    )
    sound = (tmp_path / "sound.toml").read_bytes()
    accepted = []

    @fuzz(count, edits=EDITS)
    def _(edits):
        (tmp_path / "s.toml").write_bytes(mutated(sound, edits))
        accepted.append(check_file(tmp_path / "s.toml"))

    assert 0.05 < np.mean(accepted) < 0.8, "both ways are gone"


@cases(1500)
def test_arbitrary_values_of_parameters(count):
    @fuzz(count, values=st.dictionaries(NAMES, VALUES, max_size=3))
    def _(values):
        try:
            scene = Avalanche.make(values)
        except SceneError as error:
            one_line(error)
        else:
            check_scene(scene, values)


@cases(1500)
def test_assignments_of_a_command_line(count):
    @fuzz(
        count, text=st.builds("{}{}{}".format, NAMES, st.sampled_from(["=", " = ", "==", ""]), QUANTITIES | st.text(max_size=20))
    )
    def _(text):
        try:
            name, value = parse_assignment(text, Avalanche)
        except SceneError as error:
            one_line(error)
        else:
            assert name == text.partition("=")[0].strip() and name in Avalanche.model_fields
            assert type(value) is Avalanche.model_fields[name].annotation or value in ("bcc", "fcc", "sc")


@cases(3000, 100_000)
def test_texts_of_quantities(count):
    """Nothing hangs, nothing is evaluated; what is accepted is what pint itself reads."""
    signs = st.text("0123456789.eE+-*/^ ()mskgNPadr°%µ", max_size=30)

    @fuzz(count, text=QUANTITIES | signs | st.text(max_size=60), unit=st.sampled_from(list(KINDS)))
    def _(text, unit):
        try:
            value = parse(text, unit)
        except ValueError as error:
            one_line(error)
        else:
            assert math.isfinite(value) and value == pytest.approx(reading(text, unit), rel=1e-9)
