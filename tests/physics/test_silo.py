"""A small silo: its own checks of balance hold, walls that slide up carry a part, and it flows nearly as Beverloo says."""

import pytest

from barchan.experiments.silo import Silo, build, instruments, results, stages
from barchan.experiments.silo.results import Tables, filled, flows_of
from barchan.experiments.stored import rows_at

#: Softer than the default, so that it takes seconds.
SMALL = {
    "grains": 900,
    "outlets": 1,
    "outlet_min": "30 mm",
    "outlet_max": "30 mm",
    "silo_diameter": "50 mm",
    "youngs_modulus": "3 MPa",
    "dt": "42 us",
    "restitution": 0.3,
    "equilibrate": "0.55 s",
    "slide": "0.06 s",
    "duration": "0.35 s",
}


@pytest.fixture(scope="module")
def silo(tmp_path_factory):
    """A small silo that has discharged: its scene and directory."""
    scene, out = Silo.make(SMALL), tmp_path_factory.mktemp("silo")
    sim = build(scene, threads=1)
    sim.writers = instruments(scene, out)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    return scene, out


def test_its_weight_is_carried_and_no_grain_is_lost(silo):
    scene, out = silo
    checks = {check.name: check for check in results(scene, out).checks}
    for name in ("weight is carried", "lost grains", "overlap", "at rest before the walls slide"):
        assert checks[name].passed, checks[name]


def test_walls_that_slide_up_take_weight_off_the_floor(silo):
    scene, out = silo
    silos = Tables.of(out).silos
    steps = silos["step"]
    before, after = (rows_at(silos, step) for step in (steps[steps <= scene.slide_step][-1], scene.open_step))
    assert after["wall force [N]"][0] > 0.15 * after["mass [kg]"][0] * scene.gravity
    assert after["floor force [N]"][0] < before["floor force [N]"][0]


def test_it_flows_nearly_as_beverloo_says(silo):
    """C = 0.58 and k = 1.4 of the literature: within 25 %, for a silo of 10 grains across that begins to run empty."""
    scene, out = silo
    tables = Tables.of(out)
    density = filled(scene, rows_at(tables.silos, scene.open_step))[1]
    said = 0.58 * density * scene.gravity**0.5 * (scene.outlet_max - 1.4 * scene.diameter) ** 2.5
    assert flows_of(scene, tables)[0].rate == pytest.approx(said, rel=0.25)
    assert 0.5 < density / scene.density < 0.62
