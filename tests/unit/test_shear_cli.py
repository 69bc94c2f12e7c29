"""Simple shear from the command line: it leaves tables, figures and a summary, resumes, and refuses what cannot be."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.checkpoint import all_checkpoints
from barchan.cli import app
from barchan.compare import differences, last_state
from barchan.errors import SceneError
from barchan.experiments.shear import Shear, results
from barchan.experiments.shear.results import read, steady_stages
from barchan.experiments.shear.rheology import GLASS_BEADS, filling_of, friction_of
from barchan.scene import read_scene_file

SMALL = ("--grains", "200", "--rates", "2", "--strain", "1", "--restitution", "0.5", "--threads", "1")


def barchan(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    if done.exception is not None:
        raise done.exception
    return done.output


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    out = tmp_path_factory.mktemp("small") / "run"
    barchan("run", "shear", *SMALL, "--out", out, "--checkpoint-every", "3001")
    return read_scene_file(out / "scene.toml", {"shear": Shear})[1], out


def test_it_leaves_tables_figures_and_a_summary(small):
    _, out = small
    assert {path.name for path in (out / "figures").iterdir()} == {"rheology.png", "profiles.png", "strain.png", "sample.png"}
    summary = (out / "summary.txt").read_text()
    for words in ("I = 0.", "without rattlers", "velocity is linear", "work of the box", "work is dissipated", "lost grains"):
        assert words in summary


def test_few_grains_carry_what_grains_carry(small):
    """Wide of what so few tell: friction of dense flows of rough spheres, a straight velocity, and energy to 2 %."""
    scene, out = small
    fast, slow = steady_stages(scene, out)
    assert fast.inertial == pytest.approx(0.3, rel=0.05) and slow.inertial == pytest.approx(0.15, rel=0.05)
    assert fast.mu == pytest.approx(GLASS_BEADS.at(0.3), rel=0.12) and slow.mu == pytest.approx(GLASS_BEADS.at(0.15), rel=0.12)
    assert 0.53 < fast.solid < slow.solid < 0.59
    assert max(fast.bend, slow.bend) < 0.08 and fast.velocity[-1] > 0.3
    checks = {check.name: check.passed for check in results(scene, out).checks}
    for name in ("stress power is work of the box", "work is dissipated", "faster is rougher and looser", "lost grains"):
        assert checks[name], name


def test_it_resumes_in_the_middle_and_goes_on_to_more_rates(small, tmp_path):
    scene, out = small
    again = tmp_path / "again"
    shutil.copytree(out, again)
    all_checkpoints(again / "checkpoints")[-1].unlink()
    barchan("run", "shear", "--resume", again)
    assert differences(last_state(out), last_state(again)) == []
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (again / "tables" / path.name).read_bytes()
    before = (again / "tables" / "time.csv").read_bytes()
    barchan("run", "shear", "--resume", again, "--rates", "3")
    longer = Shear.make(scene.model_dump() | {"rates": 3})
    assert longer.ends[:2] == scene.ends and len(steady_stages(longer, again)) == 3
    assert (again / "tables" / "time.csv").read_bytes().startswith(before)


def test_stages_are_what_the_parameters_say():
    scene = Shear.make({"rates": 3, "inertial_number": 0.2, "pressure": 1e3, "density": 2500.0, "dt": "1 us", "start": 2.0})
    assert scene.inertial_numbers.tolist() == [0.2, 0.1, 0.05]
    assert scene.shear_rates[0] == pytest.approx(0.2 / 1e-3 * np.sqrt(0.4))
    strains = np.diff([scene.steps(2.0, 0), *scene.ends]) * scene.dt * scene.shear_rates
    assert strains == pytest.approx(scene.settle + scene.strain, rel=0.02)
    assert [scene.stage(step) for step in (0, scene.ends[0] - 1, scene.ends[0], scene.ends[2])] == [0, 0, 1, 2]


def test_laws_go_through_points_of_their_own():
    inertial = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.4])
    exact, straight = friction_of(inertial, GLASS_BEADS.at(inertial)), friction_of(inertial, 0.35 + 0.5 * inertial)
    assert exact[:3] == pytest.approx(GLASS_BEADS[:3], rel=1e-4) and exact.determined
    assert (exact.mu_2, exact.i_0) == pytest.approx((0.644, 0.279), rel=1e-4)
    assert straight[:3] == pytest.approx((0.35, 0.5, 0.0), abs=1e-4)
    filling = filling_of(inertial, 0.6 - 0.2 * inertial)
    assert filling == pytest.approx((0.6, 0.2, 0.0), abs=1e-12)
    assert friction_of(inertial, GLASS_BEADS.at(inertial) + 0.01 * (-1.0) ** np.arange(6)).miss == pytest.approx(0.01, rel=0.2)


def test_laws_know_their_errors():
    """Of a hundred sets of measured values, the error is how far the fits scatter; where all are slow, mu_2 is unknown."""
    inertial, random = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6]), np.random.default_rng(1)
    found = [friction_of(inertial, GLASS_BEADS.at(inertial) + 0.003 * random.standard_normal(8)) for _ in range(100)]
    for one in range(3):
        said = np.sqrt(np.mean([law.errors[one] ** 2 for law in found]))
        assert said == pytest.approx(np.std([law[one] for law in found]), rel=0.3)
    assert all(law.determined for law in found)
    slow = inertial[:4]
    assert not friction_of(slow, GLASS_BEADS.at(slow) + 0.003 * random.standard_normal(4)).determined


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"radius_max": 0.4e-3}, r"radius_max = 0\.0004 m is below radius_min = 0\.00045 m"),
        ({"strain": 0.01}, "strain = 0.01 at inertial_number = 0.3 takes .* steps"),
        ({"inertial_number": -0.1}, "inertial_number = -0.1"),
        ({"restitution": 0.0}, "restitution = 0.0"),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(SceneError, match=words):
        Shear.make(given)


def test_half_a_run_says_so(tmp_path):
    scene = Shear()
    assert results(scene, tmp_path).values[-1] == ("shear", "no stage is complete yet") and read(tmp_path, "time") is None
