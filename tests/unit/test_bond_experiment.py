"""The test of bonds: what its closed forms say, what is concluded from its tables, and a short one, stopped and resumed."""

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.cli import app
from barchan.errors import SceneError
from barchan.experiments.bond import BondTest, results
from barchan.experiments.bond.closed_form import breaks, curves
from barchan.experiments.bond.results import COLUMNS, crack_table, series_of
from barchan.experiments.bond.setup import TESTS
from barchan.scene import read_scene_file

#: Bonds that break in steps 150, 500 and 500.
SHORT = {"tensile_strength": "1.495 MPa", "shear_strength": "1.998 MPa", "steps": "600"}


def command(out, how, **changes):
    words = [word for name, value in (SHORT | changes).items() for word in ("--set", f"{name}={value}")]
    done = CliRunner().invoke(app, ["run", "bond", *(words if how == "--out" else words[-2:]), "--threads", "1", how, str(out)])
    assert done.exception is None, done.exception


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("bond") / "run"
    command(out, "--out")
    return read_scene_file(out / "scene.toml", {"bond": BondTest})[1], out


def checks(scene, out):
    return {check.name: check.passed for check in results(scene, out).checks}


def test_the_defaults_break_where_the_paper_has_it():
    assert [breaks(BondTest(), test) for test in TESTS] == [(3000, "tension"), (10_000, "shear"), (10_000, "torsion")]


def test_each_strength_is_half_an_increment_below_the_stress_of_the_break():
    scene = BondTest()
    for test, step in zip(TESTS, (3000, 10_000, 10_000)):
        found = curves(scene, test, [step - 1, step])
        stress, strength = (
            (found.tension, scene.tensile_strength) if test == "pull" else (found.shear_stress, scene.shear_strength)
        )
        assert 0.3 < (stress[1] - strength) / np.diff(stress)[0] < 0.7


def test_what_is_sheared_far_breaks_in_tension():
    scene = BondTest(shear_strength=1e12)
    step, mode = breaks(scene, "shear")
    before, after = curves(scene, "shear", [step - 1, step]).tension
    assert mode == "tension" and before < scene.tensile_strength <= after


def test_a_short_one_passes_all_checks_and_shows_its_breaks(run):
    scene, out = run
    kinds = ("break", "curves", "after the break")
    assert checks(scene, out) == {f"{test}: {kind}": True for test in TESTS for kind in kinds}
    assert crack_table(out)["crack step"].tolist() == [150, 500, 500] and crack_table(out)["mode"].tolist() == [1, 3, 4]
    assert {path.name for path in (out / "figures").iterdir()} == {"pull.png", "shear.png", "spin.png"}
    assert "broke in torsion at step 500" in (out / "summary.txt").read_text()


def test_what_a_break_frees_is_half_the_product_of_load_and_way(run):
    """Of the bond as it broke, a step after the last load that held."""
    scene, out = run
    pull, shear, spin = crack_table(out)["energy [J]"]
    carried = {test: curves(scene, test, [step]) for test, step in zip(TESTS, (150, 500, 500))}
    assert pull == pytest.approx(0.5 * carried["pull"].pull[0] * 150e-6, rel=1e-12)
    assert spin == pytest.approx(0.5 * carried["spin"].twisting[0] * 500e-6 / scene.bond_radius, rel=1e-12)
    assert shear == pytest.approx(0.5 * carried["shear"].shear[0] * 500e-6, rel=1e-6)


def test_a_run_that_was_ended_and_resumed_leaves_the_same_tables(run, tmp_path):
    _, whole = run
    out = tmp_path / "parts"
    command(out, "--out", steps="200")
    assert set(checks(BondTest.make(SHORT | {"steps": 200}), out)) > {"pull: break", "shear: curves"}
    command(out, "--resume", steps="600")
    for table in ("bonds.csv", "cracks.csv"):
        assert (out / "tables" / table).read_bytes() == (whole / "tables" / table).read_bytes()


@pytest.mark.parametrize("column", COLUMNS)
def test_a_curve_that_is_off_by_a_little_is_told(column, run, tmp_path):
    """By 2e-9 of its largest value, or where it shall be 0, of what the load could be."""
    scene, out = run
    stress = float(series_of(out, 0)["edge tension [Pa]"].max())
    unit = column[column.index("[") :]
    largest = stress * {"[Pa]": 1.0, "[N]": scene.area, "[N m]": scene.area * scene.radius}[unit]
    head, *rows = (out / "tables" / "bonds.csv").read_text().splitlines()
    place, cells = head.split(",").index(column), rows[3 * 9].split(",")  # of the first test, at step 100
    cells[place] = repr(float(cells[place]) + 2e-9 * largest)
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "bonds.csv").write_text("\n".join([head, *rows[:27], ",".join(cells), *rows[28:], ""]))
    assert not checks(scene, tmp_path)["pull: curves"]


def test_a_break_at_another_step_and_what_is_left_after_it_are_told(run, tmp_path):
    scene, out = run
    bonds, cracks = ((out / "tables" / name).read_text() for name in ("bonds.csv", "cracks.csv"))
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "bonds.csv").write_text(bonds.rstrip("\n").rpartition(",")[0] + ",1.0\n")
    (tmp_path / "tables" / "cracks.csv").write_text(cracks.replace(",150,", ",149,"))
    found = checks(scene, tmp_path)
    assert {name for name, passed in found.items() if not passed} == {"pull: break", "spin: after the break"}


def test_before_the_first_row_there_are_no_results(tmp_path):
    assert results(BondTest(), tmp_path).values == [("results", "none: the run is shorter than table_steps")]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"increment": "1 mm"}, "increment = 0.001 m makes 12 m in 12000 steps; at most 5 radii"),
        ({"steps": 12_005}, "steps = 12005 must be a multiple of table_steps = 10"),
        ({"bond_normal_stiffness": "1 N/m"}, "a stiffness of an area"),
        ({"tensile_strength": 0.0}, "tensile_strength"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        BondTest.make(changes)
