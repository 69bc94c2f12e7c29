"""The house has an order: a module imports from its own storey and those below, never from above."""

import ast
from pathlib import Path

import pytest

import barchan

ROOT = Path(barchan.__file__).parent

#: The storeys from the ground up. Modules of one storey may import each other. ``barchan`` is the front door, ``__init__``.
STOREYS = (
    ("atomic", "errors", "fields", "domain", "triggers", "stopwatch", "version", "words", "memory", "chance", "shapes"),
    ("laws",),
    ("kernels",),
    ("grains", "materials"),
    ("parallel", "neighbors"),
    ("walls",),
    ("forces", "bonds"),
    ("measure",),
    ("actions", "writers", "checkpoint", "compare", "soundness", "report", "record"),
    ("preflight", "assembly", "stepping", "faults", "deformation"),
    ("simulation",),
    ("packing", "scene", "units", "rundir", "warmup", "view"),
    ("experiments",),
    ("bench", "run_commands", "cli", "testing", "selftest", "__main__"),
    ("barchan",),
)
HEIGHT = {name: height for height, storey in enumerate(STOREYS) for name in storey}

pytestmark = pytest.mark.nojit


def part_of(path):
    """The part of the house that a file belongs to: the first name below ``barchan``."""
    first = path.relative_to(ROOT).parts[0]
    return "barchan" if first == "__init__.py" else first.removesuffix(".py")


def modules_named(node, path):
    """Full names of what an import statement imports, wherever in the file it stands."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    package = ("barchan", *path.relative_to(ROOT).parts[:-1])
    base = ".".join([*package[: len(package) - node.level + 1], *filter(None, [node.module])]) if node.level else node.module
    if base == "barchan":  # from barchan import x: a module of its own, or something at the front door
        return [
            f"barchan.{a.name}" if (ROOT / a.name).is_dir() or (ROOT / f"{a.name}.py").exists() else "barchan" for a in node.names
        ]
    return [base]


def imports():
    """(file, line, full name) of every import in the library."""
    for path in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            for name in modules_named(node, path):
                yield path, node.lineno, name


def where(path, line):
    return f"{path.relative_to(ROOT)}:{line}"


def test_every_part_of_the_house_has_its_storey():
    parts = {part_of(path) for path in ROOT.rglob("*.py")}
    assert parts - set(HEIGHT) == set(), "give these a place in STOREYS (and in ARCHITECTURE.md)"


def test_no_arrow_points_upwards():
    arrows = []
    for path, line, name in imports():
        if name.split(".")[0] == "barchan":
            target = [*name.split("."), "barchan"][1]
            if HEIGHT[target] > HEIGHT[part_of(path)]:
                arrows.append(f"{where(path, line)} imports {name}")
    assert arrows == []


@pytest.mark.parametrize(("package", "home"), [("mpi4py", {"parallel"}), ("numba", {"kernels", "testing", "bench"})])
def test_only_their_home_imports(package, home):
    """All of MPI in one place; and Numba behind ``kernels/compiler.py``, which keeps its cache right."""
    outside = [where(path, line) for path, line, name in imports() if name.split(".")[0] == package and part_of(path) not in home]
    assert outside == []


def test_laws_know_no_arrays_and_no_compiler():
    """They are plain functions on numbers: the standard library and the storeys below."""
    allowed = {"barchan", "math", "inspect", "types", "typing"}
    foreign = [
        f"{where(path, line)} {name}"
        for path, line, name in imports()
        if part_of(path) == "laws" and name.split(".")[0] not in allowed
    ]
    assert foreign == []


def test_the_parser_sees_all_forms_of_import(tmp_path):
    """Otherwise the tests above pass by blindness."""
    path = ROOT / "kernels" / "made_up.py"
    text = (
        "import barchan.simulation\nfrom barchan import simulation, Box\nfrom ..walls import plane\nfrom . import cells\n"
        "def late():\n    from barchan.measure.energy import KineticEnergy\n"
    )
    names = [name for node in ast.walk(ast.parse(text)) for name in modules_named(node, path)]
    assert sorted(names) == [
        "barchan",
        "barchan.kernels",
        "barchan.measure.energy",
        "barchan.simulation",
        "barchan.simulation",
        "barchan.walls",
    ]
