"""Scenes: parameters with units, their TOML files, and messages that name parameter, value and what is allowed."""

import subprocess
import sys
from decimal import Decimal
from typing import Literal

import numpy as np
import pytest
from pydantic import Field, model_validator

from barchan.errors import SceneError
from barchan.experiments.avalanche.parameters import Avalanche
from barchan.rundir import RunDirectory
from barchan.scene import Scene, parse_assignment, quantity, read_scene_file, write_scene_file
from barchan.units import KINDS, parse, written


class Slope(Scene):
    """One parameter of every kind."""

    length: float = quantity(0.8, "m", "length of the block", gt=0.0, le=10.0)
    angle: float = quantity(31.2, "deg", "angle of the floor", gt=0.0, lt=90.0)
    damping: float = quantity(3401.0, "1/s", "normal damping", ge=0.0)
    density: float = quantity(1700.0, "kg/m^3", "density of the grains", gt=0.0)
    friction: float = quantity(1.0, "1", "friction coefficient", ge=0.0)
    grains: int = Field(5000, ge=20, le=10**7, description="grains that flow")
    lattice: Literal["bcc", "fcc"] = Field("bcc", description="lattice at the start")
    periodic: bool = Field(True, description="periodic across")

    @model_validator(mode="after")
    def _fits(self):
        if self.grains > 1e6 * self.length:
            raise ValueError(f"grains = {self.grains} do not fit into length = {self.length:g} m")
        return self


KNOWN = {"slope": Slope, "chute": Scene}

SOUND = """# a comment
experiment = "slope"
[parameters]
length = "740 mm"
damping = 12
angle = "0.5 rad"  # more comments
grains = 600
periodic = false
[ran_with]
barchan = "1.0"
cores = 2
"""


def refusal(call, *arguments):
    with pytest.raises(SceneError) as caught:
        call(*arguments)
    text = str(caught.value)
    assert text.isprintable() and len(text) < 1000, "one line"
    return text


# -- numbers with units ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("8 mm", "m", 0.008),
        ("1.12mm", "m", 1.12e-3),
        ("1.12 mm", "m", 1.12e-3),
        ("0.008 m", "m", 0.008),
        (" 3 µm ", "m", 3e-6),
        ("1 inch", "m", 0.0254),
        ("740", "m", 740.0),
        ("-2.5e-3 km", "m", -2.5),
        ("600 ms", "s", 0.6),
        ("31.2 deg", "deg", 31.2),
        ("31.2°", "deg", 31.2),
        ("0.25 turn", "deg", 90.0),
        ("1.7 g/cm^3", "kg/m^3", 1700.0),
        ("1.7 g cm**-3", "kg/m^3", 1700.0),
        ("7.849 N/mm", "N/m", 7849.0),
        ("3.401 kHz", "1/s", 3401.0),
        ("3401 / s", "1/s", 3401.0),
        ("981 cm/s^2", "m/s^2", 9.81),
        ("50 %", "1", 0.5),
        ("1 bar", "Pa", 1e5),
    ],
)
def test_a_text_is_a_number_in_the_unit_of_its_parameter(text, unit, value):
    assert parse(text, unit) == value, "to the last bit"


def test_a_radian_is_a_radian():
    assert parse("0.5 rad", "deg") == pytest.approx(np.degrees(0.5), rel=1e-15)


def test_decimal_prefixes_are_rounded_once():
    """Not 1.12 * 1e-3 = 0.0011200000000000001."""
    random = np.random.default_rng(2)
    for _ in range(2000):
        digits = repr(float(f"{10 ** random.uniform(-6, 6):.{random.integers(1, 17)}g}"))
        for prefix, power in (("k", 3), ("c", -2), ("m", -3), ("µ", -6), ("n", -9)):
            assert parse(f"{digits} {prefix}m", "m") == float(Decimal(digits).scaleb(power))


def test_every_unit_is_written_and_read_back_to_the_same_bits():
    random = np.random.default_rng(3)
    for unit in KINDS:
        for value in [*random.uniform(-1e9, 1e9, 50), *10 ** random.uniform(-300, 300, 50), 0.1, 5e-324, 1.7976931348623157e308]:
            assert parse(written(value, unit), unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("8 s", "m", "a time"),
        ("8 m^2", "m", "an area"),
        ("8 m/s^3", "m", "of another dimension"),
        ("0.5 rad", "1", "an angle"),
        ("50 %", "deg", "a plain number"),
        ("30 rpm", "1/s", "an angular velocity"),
        ("20 degC", "K", "'degC' has a zero or a scale of its own"),
        ("20 mdegC", "K", "of its own"),
        ("3 dB", "1", "of its own"),
        ("5 USD", "m", "no unit 'USD'"),
        ("5 nan", "m", "no unit 'nan'"),
        ("8 m2", "m^2", "cannot be read as a unit"),
        ("8 (m)", "m", "cannot be read as a unit"),
        ("9**9**9", "m", "cannot be read as a unit"),
        ("9 m^9^9", "m", "cannot be read as a unit"),
        ("9 m^99", "m", "cannot be read as a unit"),
        ("9 " + "m " * 30, "m", "cannot be read as a unit"),
        ("nan", "m", "no finite number"),
        ("inf m", "m", "no finite number"),
        ("mm", "m", "no finite number"),
        ("", "m", "no finite number"),
        ("٣ m", "m", "no finite number"),
        ("__import__('os')", "m", "no finite number"),
        ("1e400", "m", "too large"),
        ("1e999 km", "m", "too large"),
        ("1e307 Mm", "m", "too large"),
        ("1e-400 m", "m", "too small"),
        ("1e99999999 m", "m", "cannot be read as a unit"),
    ],
)
def test_what_is_no_number_with_that_unit_is_refused(text, unit, reason):
    with pytest.raises(ValueError, match=r"^[^\n]*$") as caught:
        parse(text, unit)
    assert reason in str(caught.value)


def test_pint_is_imported_only_when_it_is_needed():
    """It takes longer to import than the rest of a scene."""
    program = (
        "import sys; from barchan.experiments.avalanche.parameters import Avalanche\n"
        "Avalanche.make({'length': '0.7 m', 'angle': 30}); assert 'pint' not in sys.modules\n"
        "Avalanche.make({'length': '700 mm'}); assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


# -- parameters --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"length": "8 s"}, "length = '8 s' (length of the block): a time; a length > 0 and <= 10 m is needed, for instance '0."),
        ({"angle": "95 deg"}, "angle = '95 deg' (angle of the floor): an angle > 0 and < 90 deg is needed, for instance '31.2 "),
        ({"angle": 0}, "angle = 0 (angle of the floor): an angle > 0"),
        ({"length": "11 m"}, "length = '11 m' (length of the block): a length > 0 and <= 10 m is needed"),
        ({"length": float("nan")}, "length = nan (length of the block): not finite; a length > 0"),
        ({"damping": float("inf")}, "damping = inf (normal damping): not finite; a rate >= 0 1/s is needed, for instance '3401"),
        ({"friction": -1e-9}, "friction = -1e-09 (friction coefficient): a plain number >= 0 is needed, for instance 1.0"),
        ({"friction": True}, "friction = True (friction coefficient): a plain number"),
        ({"friction": None}, "friction = None (friction coefficient): a plain number"),
        ({"friction": [1]}, "friction = a list (friction coefficient): a plain number"),
        ({"friction": {"a": {}}}, "friction = a table (friction coefficient): a plain number"),
        ({"grains": 19}, "grains = 19 (grains that flow): a whole number >= 20 and <= 10000000 is needed, for instance 5000"),
        ({"grains": 20.0}, "grains = 20.0 (grains that flow): a whole number"),
        ({"grains": "20"}, "grains = '20' (grains that flow): a whole number"),
        ({"grains": True}, "grains = True (grains that flow): a whole number"),
        ({"lattice": "sc"}, "lattice = 'sc' (lattice at the start): one of 'bcc', 'fcc' is needed, for instance 'bcc'"),
        ({"periodic": 1}, "periodic = 1 (periodic across): true or false is needed, for instance True"),
        ({"lenght": 1}, "unknown parameter 'lenght'; did you mean 'length'?"),
        ({"zzz": 1}, "unknown parameter 'zzz'; known are: length, angle,"),
        ({"length": 0.001}, "grains = 5000 do not fit into length = 0.001 m"),
        ({"grains": 1, "angle": -1, "zzz": 1, "friction": -1}, "; and 1 more"),
        ({"friction": 10**5000}, "(friction coefficient): a plain number"),
        ({"friction": "x" * 10**6}, "(friction coefficient): no finite number"),
        ([], "a scene is a mapping from names of parameters to values, not a list"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_named(values, message):
    assert message in refusal(Slope.make, values)


def test_a_unit_that_nobody_knows_cannot_be_declared():
    assert "unknown unit 'kg/m3'; did you mean 'kg/m^3'?" in refusal(quantity, 1.0, "kg/m3", "density")


def test_plain_numbers_are_in_the_declared_unit():
    scene = Slope.make({"length": 2, "angle": 30.0, "friction": "0.5"})
    assert (scene.length, scene.angle, scene.friction, scene.grains) == (2.0, 30.0, 0.5, 5000)
    assert (scene.text("length"), scene.text("friction"), scene.text("lattice")) == ("2.0 m", "0.5", "bcc")


@pytest.mark.parametrize(
    ("text", "assignment"),
    [
        ("length=1.12mm", ("length", 1.12e-3)),
        (" angle = 0.25 rad ", ("angle", 14.32394487827058)),
        ("grains=300", ("grains", 300)),
        ("lattice=fcc", ("lattice", "fcc")),
        ("periodic=False", ("periodic", False)),
        ("friction=50%", ("friction", 0.5)),
        ("length=0.0001", ("length", 0.0001)),
    ],
)
def test_an_assignment(text, assignment):
    """Whether it fits to the other parameters is seen when all are known, as for the last one."""
    name, value = parse_assignment(text, Slope)
    assert (name, value) == assignment and type(value) is type(assignment[1])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("length", "'length' sets no parameter; write NAME=VALUE, for instance length='0.8 m'"),
        ("=3", "sets no parameter"),
        ("lenght=3", "unknown parameter 'lenght'; did you mean 'length'?"),
        ("length=8 s", "length = '8 s' (length of the block): a time;"),
        ("length=11", "length = '11' (length of the block): a length > 0 and <= 10 m"),
        ("length==3", "length = '=3' (length of the block): no finite number"),
        ("grains=1e3", "grains = '1e3' (grains that flow): a whole number"),
        ("grains=" + "9" * 10_000, "(grains that flow): a whole number"),
        ("periodic=maybe", "periodic = 'maybe' (periodic across): true or false"),
    ],
)
def test_an_assignment_that_cannot_be(text, message):
    assert message in refusal(parse_assignment, text, Slope)


# -- files -------------------------------------------------------------------------------------------------------------


def test_a_scene_file(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(SOUND)
    name, scene = read_scene_file(path, KNOWN)
    assert name == "slope"
    assert scene == Slope.make({"length": 0.74, "damping": 12.0, "angle": np.degrees(0.5), "grains": 600, "periodic": False})
    path.write_text('\ufeffexperiment = "slope"')
    assert read_scene_file(path, KNOWN) == ("slope", Slope())


@pytest.mark.parametrize(
    "scene", [Slope(), Slope.make({"angle": "0.1 rad", "friction": 0.1 + 0.2, "periodic": False}), Avalanche()]
)
def test_what_is_written_is_read_back_to_the_same_bits(scene, tmp_path):
    path = tmp_path / "s.toml"
    write_scene_file(path, "slope", scene, {"barchan": "1.0", 'od"d\x7f\n é': 'é"\\\x7f', "cores": 2})
    name, again = read_scene_file(path, {"slope": type(scene)})
    assert name == "slope" and repr(again) == repr(scene)
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_a_written_file_is_for_people(tmp_path):
    write_scene_file(tmp_path / "s.toml", "slope", Slope(), {"barchan": "1.0"})
    text = (tmp_path / "s.toml").read_text()
    for line in (
        'experiment = "slope"',
        "[parameters]",
        'length = "0.8 m"  # length of the block',
        'damping = "3401.0 1/s"  # normal damping',
        "friction = 1.0  # friction coefficient",
        "grains = 5000  # grains that flow",
        "periodic = true  # periodic across",
        "[ran_with]",
        'barchan = "1.0"',
    ):
        assert line in text.splitlines()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SOUND.replace("740 mm", "740 s"), "length = '740 s' (length of the block): a time;"),
        (SOUND.replace("length", "lenght"), "unknown parameter 'lenght'; did you mean 'length'?"),
        (SOUND.replace('"slope"', '"slop"'), "unknown experiment 'slop'; did you mean 'slope'?"),
        (SOUND.replace('"slope"', "3"), "unknown experiment 3; known are: slope, chute"),
        (SOUND.replace("experiment", "experimet"), "unknown key 'experimet'; did you mean 'experiment'?"),
        (SOUND.replace("[parameters]", ""), "unknown key 'length'; known are: experiment, parameters, ran_with; parameters stan"),
        (SOUND.replace("[parameters]", "[[parameters]]"), "'parameters' must be a table, begun by the line [parameters], not a "),
        (SOUND.replace("[ran_with]", "[ran]"), "unknown key 'ran'"),
        (SOUND.replace('"1.0"', "[1]"), "'barchan' in [ran_with] must be text or a number, not a list"),
        (SOUND.replace("600", "600 grains"), "no valid TOML:"),
        (SOUND + "x", "(at end of document)"),
        (SOUND.replace("cores = 2", "cores = 2\ncores = 3"), "(at line 12, column 10)"),
        (SOUND.replace("600", "nan"), "grains = nan"),
        (SOUND.replace("600", "1979-05-27"), "grains = datetime.date(1979, 5, 27) (grains that flow): a whole number >= 20"),
        (SOUND.replace("600", "9" * 5000), "line 7 has 5,009 characters; at most 1,000 are allowed"),
        (SOUND.replace("600", "9" * 990), "a whole number"),
        (SOUND.replace("600", "[" * 900), "lie in each other too deep"),
        (".".join("a" * 100_000) + " = 1", "line 1 has 200,003 characters"),
        ("", 'it does not say which experiment; write, before [parameters]: experiment = "slope"'),
        ("x" * 1_000_001, "larger than 1,000,000 bytes"),
        (b"\n\n\xff", "line 3 is no UTF-8 text (byte 0xff)"),
        (bytes(range(128)), "no valid TOML"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_scene(text, message, tmp_path):
    path = tmp_path / "s.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    said = refusal(read_scene_file, path, KNOWN)
    assert said.startswith(f"scene {path}: ") and message in said


def test_a_file_that_is_not_there(tmp_path):
    assert "there is no such file" in refusal(read_scene_file, tmp_path / "nothing.toml", KNOWN)
    assert "it is a directory" in refusal(read_scene_file, tmp_path, KNOWN)
    assert "no such file" in refusal(read_scene_file, "/dev/zero", KNOWN), "which never ends"
    assert "cannot be read" in refusal(read_scene_file, tmp_path / ("x" * 300), KNOWN)


# -- a run's directory -------------------------------------------------------------------------------------------------


def test_a_directory_keeps_its_scene(tmp_path):
    directory = RunDirectory(tmp_path / "run")
    directory.claim("slope", Slope(), {"barchan": "1.0"})
    directory.claim("slope", Slope(), {"barchan": "2.0"})
    assert 'barchan = "1.0"' in directory.scene_file.read_text()
    said = refusal(directory.claim, "slope", Slope.make({"angle": 30, "grains": 70}), {})
    assert "holds another scene: angle = 31.2 deg, not 30.0 deg; grains = 5000, not 70. Use --resume" in said
    assert "unknown experiment 'slope'" in refusal(directory.claim, "chute", Slope(), {})
    directory.rewrite("slope", Slope.make({"angle": 30}), {})
    assert read_scene_file(directory.scene_file, KNOWN)[1].angle == 30.0
    directory.release()


def test_a_directory_in_use_is_refused(tmp_path):
    first = RunDirectory(tmp_path)
    assert "in use by another run" in refusal(RunDirectory, tmp_path)
    first.release()
    RunDirectory(tmp_path).release()


def test_a_directory_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    (tmp_path / "file").write_text("in the way")
    assert "cannot be written" in refusal(RunDirectory, tmp_path / "file" / "run")
    directory = RunDirectory(tmp_path / "run")
    monkeypatch.setattr("os.fsync", full)
    assert "No space left" in refusal(directory.claim, "slope", Slope(), {})
    assert not directory.scene_file.exists(), "nothing half written"
    directory.release()
