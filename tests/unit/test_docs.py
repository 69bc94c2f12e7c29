"""Every command and every snippet in README and docs runs."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def snippets():
    for page in PAGES:
        for number, text in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)):
            yield pytest.param(text, id=f"{page.relative_to(ROOT)}-{number}")


def pages_with_commands():
    for page in PAGES:
        commands = re.findall(r"^    (barchan .*?)(?:  #.*)?$", page.read_text(), re.MULTILINE)
        if commands:
            yield pytest.param(commands, id=str(page.relative_to(ROOT)))


@pytest.mark.parametrize("text", list(snippets()))
def test_snippet_runs(text, tmp_path):
    (tmp_path / "snippet.py").write_text(text)
    done = subprocess.run([sys.executable, "snippet.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("commands", list(pages_with_commands()))
def test_commands_run(commands, tmp_path):
    for command in commands:
        words = shlex.split(command)
        done = subprocess.run([sys.executable, "-m", "barchan.cli", *words[1:]], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}: {done.stderr}"


def test_links_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.relative_to(ROOT)} links to {target}"


def test_the_two_commands_of_the_readme_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    for name in re.findall(r"^    make (\w+)", (ROOT / "README.md").read_text(), re.MULTILINE):
        assert re.search(rf"^{name}:", makefile, re.MULTILINE)
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
