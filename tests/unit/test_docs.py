"""What README and docs tell a reader to do works, page by page and in order; and the site builds without a warning.

On a page, indented lines that begin with ``barchan``, ``python`` or ``mpiexec`` are commands; blocks marked ``python`` are
scripts, ``toml`` complete scenes. A first line such as ``# balls.py`` or ``# my-avalanche.toml`` is the name under which the
reader saves a block.
"""

import inspect
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import barchan
from barchan import actions, laws, measure, packing, testing, writers

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
COMMAND = r"^    ((?:mpiexec -n \d )?(?:barchan|python) .*?)(?:  #.*)?$"
DEED = re.compile(rf"^```(python|toml)\n(.*?)^```$|{COMMAND}", re.DOTALL | re.MULTILINE)


def run(arguments, directory, launcher=()):
    """Run Python in ``directory`` as a reader would, on a machine without a screen."""
    command = [*launcher, sys.executable, *map(str, arguments)]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "Agg"})
    assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"


def run_command(words, directory):
    """Run a command that begins with ``barchan`` or ``python``, perhaps by ``mpiexec``."""
    launcher = []
    if words[0] == "mpiexec":
        launcher, words = [str(Path(sys.executable).with_name("mpiexec")), *words[1:3]], words[3:]
    program = ["-m", "barchan"] if words[0] == "barchan" else []
    run([*program, *words[1:]], directory, launcher)


#: Pages whose deeds take longest: they are done at full size.
SLOW = ("run-on-your-machine.md", "write-a-law.md", "oedometer.md", "repose.md", "rock.md", "silo.md", "column.md", "drum.md")
SLOW += ("shear.md", "make-a-sample.md", "many-machines.md")


def deeds():
    """What there is to do on each page: (kind of block, its text, command), in order."""
    for page in PAGES:
        found = DEED.findall(page.read_text())
        if found:
            yield pytest.param(found, id=str(page.relative_to(ROOT)), marks=[pytest.mark.validate] if page.name in SLOW else [])


def save(text, kind, directory):
    """Save a block under the name that it gives itself; returns the name."""
    named = re.match(r"# ([\w-]+\.\w+)\n", text)
    name = named[1] if named else {"python": "snippet.py", "toml": "scene.toml"}[kind]
    (directory / name).write_text(text)
    return name


@pytest.mark.parametrize("found", list(deeds()))
def test_what_a_page_tells_to_do_works(found, tmp_path):
    for kind, text, command in found:
        if kind == "python":
            run([save(text, kind, tmp_path)], tmp_path)
        elif kind == "toml":
            run(["-m", "barchan", "check", save(text, kind, tmp_path)], tmp_path)
        else:
            run_command(shlex.split(command), tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_block_is_of_a_kind_that_these_tests_know(page):
    """Blocks of text are shown only; those with braces are directives of the site."""
    fences = re.findall(r"^ *```(.*)$", page.read_text(), re.MULTILINE)
    assert set(fences[1::2]) <= {""}, "a block is not closed"
    assert all(kind in ("python", "toml", "text") or kind.startswith("{") for kind in fences[::2]), fences[::2]


def test_links_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.relative_to(ROOT)} links to {target}"


def test_the_two_commands_of_the_readme_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for name in re.findall(r"^    make (\w+)", (ROOT / "README.md").read_text(), re.MULTILINE):
        assert re.search(rf"^{name}:", makefile, re.MULTILINE)
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def test_the_site_builds_without_a_warning_and_tells_of_everything_public(tmp_path):
    site = tmp_path / "site"
    run(["-m", "sphinx", "-W", "--keep-going", "-q", "-d", tmp_path / "doctrees", ROOT / "docs", site], tmp_path)
    for page in PAGES[1:]:
        assert (site / page.relative_to(ROOT / "docs")).with_suffix(".html").is_file()
    interface = "".join(path.read_text() for path in (site / "reference" / "python").glob("*.html"))
    for module in (barchan, laws, actions, measure, packing, writers):
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isclass(thing) or inspect.isfunction(thing):
                assert re.search(rf'id="barchan[\w.]*\.{name}"', interface), f"{module.__name__}.{name} has no entry"
    assert f'id="{testing.__name__}.check_law"' in interface
    for noise in ("Alias for field number", 'Type<span class="colon">'):
        assert noise not in interface
    for page, words in {
        "python/laws": laws.SHIPPED,
        "command-line": ("barchan diff", "barchan run FILE.toml", "--checkpoint-every"),
        "avalanche-parameters": ("void_fraction", "31.2 deg", "5e-06 s"),
    }.items():
        text = re.sub("<[^>]*>", "", (site / "reference" / f"{page}.html").read_text())
        assert not [word for word in words if word not in text], f"reference/{page} was not filled from the code"
