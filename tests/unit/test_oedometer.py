"""The oedometer: what its parameters mean, what is concluded from its tables, and a small one from beginning to end."""

import numpy as np
import pytest
from typer.testing import CliRunner

from barchan.cli import app
from barchan.errors import SceneError
from barchan.experiments.cell import WALLS, Cell
from barchan.experiments.oedometer import Oedometer, build, results, stages
from barchan.experiments.oedometer.modulus import WINDOWS, Moduli
from barchan.experiments.oedometer.results import branches, series
from barchan.scene import read_scene_file
from barchan.walls import Servo
from barchan.writers import Table

SMALL = ("grains=250", "width=14mm", "height=8mm", "gravity=60", "rain=40ms", "seat=25ms", "stress_rate=10MPa/s")
SMALL += ("max_stress=70kPa", "table_every=0.25ms")


def test_the_target_grows_is_held_and_taken_back():
    given = {"stress_rate": "1 MPa/s", "initial_stress": "10 kPa", "max_stress": "110 kPa", "end_stress": "30 kPa", "dt": "1 us"}
    scene = Oedometer.make(given)
    rained, seated, loaded, held, unloaded, rested = scene.ends
    assert np.diff(scene.ends).tolist() == [15_000, 100_000, 5_000, 80_000, 10_000]
    assert scene.target(rained) == scene.target(seated) == 10e3 and scene.target(seated + 50_000) == pytest.approx(60e3)
    assert scene.target(loaded) == scene.target(held) == 110e3 and scene.target(held + 20_000) == pytest.approx(90e3)
    assert scene.target(unloaded) == scene.target(rested + 5) == 30e3
    assert [(stage.name, stage.end) for stage in stages(scene)][3:] == [("hold", held), ("unload", unloaded), ("rest", rested)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"max_stress": "10 kPa"}, "max_stress = 10000 Pa must exceed initial_stress = 10000 Pa"),
        ({"end_stress": "200 kPa"}, "max_stress = 120000 Pa must exceed end_stress = 200000 Pa"),
        ({"height": "5 mm"}, "must be at least three of the largest diameters"),
        ({"stress_rate": "-1 Pa/s"}, "stress_rate"),
    ],
)
def test_parameters_that_do_not_fit_together_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        Oedometer.make(changes)


def test_only_the_top_is_controlled():
    cell = Cell.of(build(Oedometer(), with_grains=False))
    assert [type(wall.control) for wall in cell] == [type(None)] * 5 + [Servo]


def made_up(path, scene, noise=0.0, unbalanced=0.0, swelling=0.5, until=None, loose=0.8):
    """Tables of a test in which the top is off by ``noise`` when unloaded, walls are out of balance at the end, and a sample of
    void ratio ``loose`` that yields by 1 % up to the largest stress swells by a part of that."""

    class Sim:
        step_number, time, comm = 0, 0.0, build(scene, with_grains=False).comm

    rained, _, _, held, _, rested = scene.ends
    sim, writer = Sim(), Table(path / "tables" / "load.csv", lambda step: True, lambda sim: row(sim.step_number))

    def row(step):
        target = scene.target(step)
        top = target * (1.0 + (noise if step > held else 0.0))
        stresses = {f"stress {name} [Pa]": top if name in ("floor", "top") else 0.4 * target for name in WALLS}
        strain = np.interp(step, scene.ends[1:5], (0.0, 0.01, 0.01, 0.01 * (1.0 - swelling)))
        sizes = {"size x [m]": scene.width, "size y [m]": scene.width, "size z [m]": scene.height * np.exp(-strain)}
        others = ("deviatoric stress of grains [Pa]", "coordination", "mechanical coordination", "rattlers")
        others += ("anisotropy of fabric [1]", "sliding contacts [1]", "unbalanced force [1]", "inertial number [1]")
        rest = dict.fromkeys((*others, "largest overlap [1]"), 1e-4) | {"contacts": 10, "grains": 50}
        rest["void ratio [1]"] = loose
        rest["vertical force on all walls [N]"] = -unbalanced * top * scene.width**2 if step > held else 1.0
        means = {"mean stress [Pa]": 0.6 * target, "mean stress of grains [Pa]": 0.6 * target * (1.0 + unbalanced)}
        return {"target stress [Pa]": target} | stresses | sizes | means | rest

    for sim.step_number in np.linspace(rained + 1, until or rested, 400).astype(int).tolist():
        writer.write(sim)


def checks(scene, path):
    return {check.name: check.passed for check in results(scene, path).checks}


@pytest.mark.parametrize(("noise", "unbalanced", "swelling"), [(0.008, 0.004, 0.5), (0.012, 0.006, 1.2), (-0.012, 0.02, 1.1)])
def test_checks_tell_a_sound_test_from_one_that_is_not(noise, unbalanced, swelling, tmp_path):
    made_up(tmp_path, scene := Oedometer(), noise, unbalanced, swelling)
    sound = abs(noise) < 0.01
    named = ("top follows the target", "stiffer when unloaded", "walls are in balance", "stress of the grains")
    assert checks(scene, tmp_path) == dict.fromkeys(named, sound) | dict.fromkeys(
        ("quasi-static", "container filled", "overlap", "lost grains"), True
    )


@pytest.mark.parametrize(("loose", "filled"), [(1.24, True), (1.26, False)])
def test_grains_that_had_not_settled_are_told(loose, filled, tmp_path):
    made_up(tmp_path, scene := Oedometer(), loose=loose)
    assert checks(scene, tmp_path)["container filled"] == filled


def test_with_friction_on_the_walls_the_stress_of_the_grains_is_another_than_that_on_the_walls(tmp_path):
    made_up(tmp_path, scene := Oedometer(wall_friction=0.2), unbalanced=0.02)
    assert "stress of the grains" not in checks(scene, tmp_path) and not checks(scene, tmp_path)["walls are in balance"]


def test_moduli_are_secants_of_both_branches_at_the_same_stress(tmp_path):
    made_up(tmp_path, scene := Oedometer(), swelling=0.5)
    load = series(scene, tmp_path)
    moduli = Moduli.of(scene, load)
    assert len(moduli.stress) == WINDOWS and moduli.stress[-1] == pytest.approx(scene.max_stress - 6.25e3)
    assert moduli.loading == pytest.approx(np.full(WINDOWS, 110e3 / 0.01), rel=1e-6)
    assert moduli.unloading == pytest.approx(np.full(WINDOWS, 100e3 / 0.005), rel=1e-6)
    assert load["K0 [1]"] == pytest.approx(np.full(400, 0.4))
    assert load["volumetric strain [1]"][-1] == pytest.approx(0.005, rel=1e-2)
    loading, unloading = branches(scene, load)
    assert load["step"][loading][-1] <= scene.ends[3] <= load["step"][unloading][0]


def test_half_a_test_has_half_its_moduli_and_no_word_on_the_rest(tmp_path):
    scene = Oedometer()
    made_up(tmp_path, scene, until=(scene.ends[1] + scene.ends[2]) // 2)
    moduli = Moduli.of(scene, series(scene, tmp_path))
    assert np.isfinite(moduli.loading[:3]).all() and np.isnan(moduli.loading[-3:]).all() and np.isnan(moduli.unloading).all()
    always = {"container filled", "overlap", "lost grains"}
    assert checks(scene, tmp_path).keys() == {"top follows the target", "quasi-static"} | always
    assert results(Oedometer(), tmp_path / "none").values[-1] == ("loading", "not begun yet")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    out = tmp_path_factory.mktemp("small") / "run"
    words = [word for text in SMALL for word in ("--set", text)]
    done = CliRunner().invoke(app, ["run", "oedometer", *words, "--wall-friction", "0.2", "--threads", "2", "--out", str(out)])
    assert done.exception is None, done.exception
    return read_scene_file(out / "scene.toml", {"oedometer": Oedometer})[1], out


def test_a_small_sample_yields_and_swells_between_rough_walls(small):
    """Few grains are at the top, so it may be off, and fast; the floor feels less than it, then more, as friction turns round."""
    scene, out = small
    load = series(scene, out)
    assert {name for name, passed in checks(scene, out).items() if not passed} <= {"top follows the target", "quasi-static"}
    peak = np.flatnonzero(branches(scene, load)[0])[-1]
    assert load["stress top [Pa]"][peak] == pytest.approx(70e3, rel=5e-3)
    assert load["stress top [Pa]"][-1] == pytest.approx(scene.end_stress, rel=0.05)
    top, floor = (load[f"stress {name} [Pa]"] for name in ("top", "floor"))
    assert 0.7 * top[peak] < floor[peak] < 0.98 * top[peak] and 1.02 * top[-1] < floor[-1] < 1.3 * top[-1]
    assert 0.3 < load["K0 [1]"][peak] < 0.7 < load["K0 [1]"][-1]
    assert 0.5 < load["void ratio [1]"][peak] < load["void ratio [1]"][-1] < 1.0
    assert {path.name for path in (out / "figures").iterdir()} == {"void_ratio.png", "strain.png", "k0.png", "sample.png"}
    summary = (out / "summary.txt").read_text()
    for words in ("carried by the sides", "constrained modulus", "walls are in balance", "stiffer when unloaded"):
        assert words in summary
