"""The commands of the experiments are made from their scenes."""

import re

import pytest
from typer.testing import CliRunner

from barchan.cli import app
from barchan.experiments import EXPERIMENTS

pytestmark = pytest.mark.nojit


def told(*words):
    found = CliRunner(env={"COLUMNS": "400", "NO_COLOR": "1", "TERM": "dumb"}).invoke(app, list(words))
    return found.exit_code, re.sub(r"[\s│]+", " ", found.output)


@pytest.mark.parametrize("name", sorted(EXPERIMENTS))
def test_help_tells_each_flag_with_its_default(name):
    """Also of those whose defaults look like mark-up: random."""
    code, text = told("run", name, "--help")
    experiment, scene = EXPERIMENTS[name], EXPERIMENTS[name].scene()
    assert code == 0 and experiment.title in text
    for flag in experiment.flags:
        assert re.search(rf"--{flag.replace('_', '-')} <str> {re.escape(scene.help(flag))}", text), flag


def test_all_experiments_are_listed():
    code, text = told("run", "--help")
    assert code == 0 and all(experiment.title in text for experiment in EXPERIMENTS.values())


def test_a_name_that_is_nearly_one_is_told():
    code, text = told("run", "slio")
    assert code == 2 and "Did you mean 'silo'?" in text
