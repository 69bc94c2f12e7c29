"""The module that is written for a law: what it takes along from the user's file, its name, and what is refused."""

import importlib.util
import itertools
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import barchan as bc
from barchan.checkpoint import source_hash
from barchan.errors import LawError
from barchan.kernels.compiler import cache_root
from barchan.kernels.generate import make_loops, module_text

pytestmark = pytest.mark.nojit

_number = itertools.count()


def user_file(folder, text):
    """Import ``text`` as a user's module, from a file of its own."""
    path = folder / f"user_{next(_number)}.py"
    path.write_text("import barchan as bc\n" + text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def forces_in_a_simulation(law, materials, **properties):
    """Force along x on grain 0 of two grains of radius 0.5 that overlap by 0.02, centres on the x axis."""
    sim = bc.Simulation(
        bc.Box((0, 0, 0), (5, 5, 5)), law, [bc.Material(f"m{k}", density=1.0, **properties) for k in range(materials)], 1e-5
    )
    sim.check_dt = False
    sim.add_grains([[1.0, 1.0, 1.0], [1.98, 1.0, 1.0]], 0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.prepare()
    return sim.grains.sorted_by_id("force")[0, 0]


SPRING = """
from math import sqrt as root, pi
import math

BEND = 0.25
SERIES = (1.0, 0.5)
unused = object()


def stretched(overlap):
    return wavy(overlap) * SERIES[1]


def wavy(x):
    return root(x) * (1.0 + BEND * math.cos(pi * x))


@bc.law(properties={"stiffness": "force/length"})
def spring(overlap, stiffness):
    return max(stiffness * stretched(overlap), 0.0), (0.0, 0.0, 0.0)
"""


def test_a_users_law_takes_its_helpers_constants_and_math_along(tmp_path):
    spring = user_file(tmp_path, SPRING).spring
    expected, _ = spring(overlap=0.5 + 0.5 - (1.98 - 1.0), stiffness=7.0)
    assert forces_in_a_simulation(spring, 1, stiffness=7.0) == pytest.approx(-expected, rel=1e-14)
    text = module_text(spring, True)
    assert "BEND = 0.25" in text and "from math import sqrt as root" in text and "unused" not in text


def test_a_law_made_by_a_function_takes_the_value_it_closes_over(tmp_path):
    made = user_file(
        tmp_path,
        """
def make(power_of_two):
    @bc.law(properties={"stiffness": "force/length"})
    def spring(overlap, stiffness):
        return stiffness * overlap * power_of_two, (0.0, 0.0, 0.0)
    return spring
""",
    ).make
    assert "power_of_two = 4.0" in module_text(made(4.0), True)
    assert make_loops(made(4.0), True).module is not make_loops(made(8.0), True).module


#: Names of loop variables and arrays of the generated module, among them the most natural name of all for a stiffness.
@pytest.mark.parametrize(("name", "materials"), [("k", 1), ("k", 2), ("dx", 1), ("lx", 1), ("table", 2), ("material", 2)])
def test_a_parameter_may_have_any_name(tmp_path, name, materials):
    """A stiffness called k must not be taken for the loop's k."""
    spring = user_file(
        tmp_path,
        f"""
@bc.law(properties={{"{name}": "force/length"}})
def spring(overlap, {name}):
    return {name} * overlap, (0.0, 0.0, 0.0)
""",
    ).spring
    assert forces_in_a_simulation(spring, materials, **{name: 100.0}) == pytest.approx(-2.0, rel=1e-12)


@pytest.mark.parametrize("name", ["k", "nx"])
def test_a_memory_may_have_any_name(tmp_path, name):
    ageing = user_file(
        tmp_path,
        f"""
@bc.law(properties={{"stiffness": "force/length"}}, history={{"{name}": 1}})
def ageing(overlap, stiffness, {name}):
    return stiffness * overlap + {name}, (0.0, 0.0, 0.0), {name} + 0.5
""",
    ).ageing
    assert forces_in_a_simulation(ageing, 1, stiffness=100.0) == pytest.approx(-2.0, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "def {name}(x):\n    return 100.0 * x\n@bc.law()\ndef spring(overlap):\n    return {name}(overlap), (0.0, 0.0, 0.0)",
        "@bc.law()\ndef {name}(overlap):\n    return 100.0 * overlap, (0.0, 0.0, 0.0)\nspring = {name}",
    ],
)
@pytest.mark.parametrize("name", ["slip", "contact", "helper"])
def test_functions_named_like_those_of_the_template_work_or_are_refused_by_name(tmp_path, name, text):
    """What must not happen: another function is called, or the compiler fails on code that the user has never seen."""
    spring = user_file(tmp_path, text.format(name=name)).spring
    try:
        force = forces_in_a_simulation(spring, 1)
    except LawError as error:
        assert f"'{name}'" in str(error)
    else:
        assert force == pytest.approx(-2.0, rel=1e-12)


@pytest.mark.parametrize(
    ("line", "factor"),
    [
        ("from math import inf as LIMIT", 1.0),
        ("import numpy as np\nLIMIT = np.float64(1.0)", 0.5),
    ],
)
def test_constants_of_any_origin_keep_their_value(tmp_path, line, factor):
    """NumPy's numbers and infinity have no literal that Python reads back."""
    spring = user_file(
        tmp_path,
        f"""
{line}
@bc.law()
def spring(overlap):
    return min(100.0 * overlap, LIMIT), (0.0, 0.0, 0.0)
""",
    ).spring
    assert forces_in_a_simulation(spring, 1) == pytest.approx(-2.0 * factor, rel=1e-12)


ODD = "\n@bc.law()\ndef odd(overlap):\n    return {returned}, (0.0, 0.0, 0.0)"


@pytest.mark.parametrize(
    ("before", "returned", "message"),
    [
        ("TABLE = [1.0, 2.0]", "TABLE[0]", r"uses 'TABLE' = \[1.0, 2.0\]"),
        ("import numpy as np", "np.sqrt(overlap)", r"uses 'np' = <module 'numpy'"),
        ("class Thing:\n    x = 1.0", "Thing.x", r"uses 'Thing'"),
        ("", "misspelt * overlap", r"'misspelt' in 'odd' is not defined"),
        ("double = lambda x: 2 * x", "double(overlap)", r"'double' must be .* not a lambda"),
    ],
)
def test_what_cannot_be_compiled_along_is_refused_by_name(tmp_path, before, returned, message):
    with pytest.raises(LawError, match=message):
        make_loops(user_file(tmp_path, before + ODD.format(returned=returned)).odd, True)


def test_a_lambda_is_no_law(tmp_path):
    odd = user_file(tmp_path, "odd = bc.law()(lambda overlap: (overlap, (0.0, 0.0, 0.0)))").odd
    with pytest.raises(LawError, match=r"must be a plain function .* not a lambda"):
        make_loops(odd, True)


def test_a_law_without_source_is_refused():
    namespace = {}
    exec("def unseen(overlap):\n    return overlap, (0.0, 0.0, 0.0)", namespace)
    with pytest.raises(LawError, match=r"source of 'unseen' cannot be read .* define it in a file"):
        make_loops(bc.law()(namespace["unseen"]), True)


def test_two_helpers_of_one_name_from_two_files_are_refused(tmp_path):
    """Only one of them could be copied; silently taking either would be a wrong law."""
    first = user_file(tmp_path, "def factor():\n    return 2.0\ndef twice(x):\n    return factor() * x")
    second = user_file(
        tmp_path,
        f"""
from {first.__name__} import twice
def factor():
    return 3.0
@bc.law()
def odd(overlap):
    return twice(overlap) + factor(), (0.0, 0.0, 0.0)
""",
    )
    with pytest.raises(LawError, match="two different things are called 'factor'"):
        make_loops(second.odd, True)


SCALED = """
FACTOR = {factor}
def scaled(x):
    return {expression}
@bc.law()
def spring(overlap):
    return scaled(overlap), (0.0, 0.0, 0.0)
"""


def test_the_name_of_the_module_follows_the_text_and_nothing_else(tmp_path):
    def name(uniform=True, factor="2.0", expression="FACTOR * x"):
        law = user_file(tmp_path, SCALED.format(factor=factor, expression=expression)).spring
        return make_loops(law, uniform).module.__name__

    assert name() == name(), "another file with the same text"
    assert len({name(), name(uniform=False), name(factor="2.5"), name(expression="FACTOR * x * x")}) == 4


def test_another_process_finds_the_same_file_and_does_not_write_it_again(tmp_path):
    law = user_file(tmp_path, SCALED.format(factor="2.125", expression="FACTOR * x")).spring
    path = Path(make_loops(law, True).module.__file__)
    assert path.is_relative_to(cache_root())
    written = path.stat().st_mtime_ns
    assert [p for p in path.parent.iterdir() if p.suffix == ".tmp" and path.stem in p.name] == [], "written whole, then renamed"
    source = Path(sys.modules[law.function.__module__].__file__)
    program = (
        f"import sys; sys.path.insert(0, {str(source.parent)!r})\nfrom {source.stem} import spring\n"
        "from barchan.kernels.generate import make_loops\nprint(make_loops(spring, True).module.__file__)"
    )
    root = str(Path(bc.__file__).parents[1])
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": root}
    )
    assert found.stdout.strip() == str(path)
    assert path.stat().st_mtime_ns == written


def test_source_hash_sees_a_change_in_the_law_a_helper_or_a_constant(tmp_path):
    def digest(factor="2.0", expression="FACTOR * x"):
        return source_hash(user_file(tmp_path, SCALED.format(factor=factor, expression=expression)).spring)

    assert digest() == digest()
    assert len({digest(), digest(factor="2.5"), digest(expression="FACTOR * x * x")}) == 3


REACHING = """
import barchan as bc

FAR = {far}


def far(radius_eff):
    return FAR * radius_eff


@bc.law(properties={{"kn": "force/length"}}, history={{"count": 1}}, reach=far)
def spring(overlap, kn, count):
    return kn * overlap, (0.0, 0.0, 0.0), count
"""


def test_loops_and_source_hash_see_how_far_a_law_reaches(tmp_path):
    """Its function may be the same: two of them in one process do not meet, and a checkpoint of one is refused by the other."""
    near, far = (user_file(tmp_path, REACHING.format(far=size)).spring for size in ("0.1", "0.2"))
    assert source_hash(near) != source_hash(far)
    assert make_loops(near, True).module is not make_loops(far, True).module


def test_source_hash_of_a_function_of_time(tmp_path):
    def digest(rate, inner):
        return source_hash(
            user_file(
                tmp_path,
                f"RATE = {rate}\ndef angle(t):\n    return RATE * t{inner}\ndef gravity(t):\n    return (angle(t), 0.0, -1.0)\n",
            ).gravity
        )

    assert digest(1.0, "") == digest(1.0, "")
    assert len({digest(1.0, ""), digest(2.0, ""), digest(1.0, " * t")}) == 3
