"""Measures read the state and change nothing."""

import math

import numpy as np
import pytest
from scenes import fingerprint, pile, simulation

import barchan as bc
from barchan.measure import KineticEnergy, contact_table
from barchan.parallel import virtual_ranks

pytestmark = [pytest.mark.nojit, pytest.mark.filterwarnings("ignore:step .* overlap by more than")]


def test_kinetic_energy_is_that_of_the_full_step_and_of_what_moves():
    sim = simulation(gravity=(0, 0, -2.0))
    sim.add_grains([[5, 5, 5], [9, 9, 9]], 0.5, velocity=(3.0, 0, 0), omega=(0, 2.0, 0), frozen=[False, True])
    sim.start_at_full_step()
    mass = math.pi / 6.0
    energy = KineticEnergy().compute(sim)
    assert energy.translation == pytest.approx(0.5 * mass * 9.0, rel=1e-14)
    assert energy.rotation == pytest.approx(0.5 * 0.1 * mass * 4.0, rel=1e-14)
    sim.run(50)
    fallen = 5.0 - sim.grains.position[sim.grains.row_of(0), 2]
    energy.compute(sim)
    assert energy.translation == pytest.approx(0.5 * mass * 9.0 + mass * 2.0 * fallen, rel=1e-12), "no error of half a step"
    assert energy.total == energy.translation + energy.rotation
    with pytest.raises(RuntimeError, match="call compute"):
        _ = KineticEnergy().total


def test_the_contact_table_names_places_and_forces_of_each_contact_once():
    sim = simulation(bc.Box((0, 0, 0), (8, 8, 8), (True, False, False)))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    sim.add_grains([[0.2, 4, 4], [7.3, 4, 4], [4, 4, 0.45], [4, 4, 1.4]], [0.6, 0.4, 0.5, 0.48])
    sim.prepare()
    table = contact_table(sim)
    assert list(zip(table["first"].tolist(), table["second"].tolist())) == [(0, 1), (2, -1), (2, 3)]
    assert table["overlap"] == pytest.approx([0.1, 0.05, 0.03])
    assert table["relative_overlap"] == pytest.approx([0.1 / 0.8, 0.05, 0.03 / 0.96])
    assert table["force"] == pytest.approx(np.array([[100, 0, 0], [0, 0, 50], [0, 0, -30.0]]))
    points = sim.box.wrap(table["point"])[0]
    assert points == pytest.approx(np.array([[7.65, 4, 4], [4, 4, 0.0], [4, 4, 0.935]]), abs=1e-12)
    assert sim.walls[0].force == pytest.approx([0, 0, -50.0])


def test_measures_have_the_same_bits_for_any_number_of_ranks_and_change_nothing():
    def program():
        sim = pile()
        sim.run(40)
        table = contact_table(sim)
        energy = KineticEnergy().compute(sim)
        return {name: column.tobytes() for name, column in table.items()}, energy.total, sim.walls[0].force.tobytes()

    alone = program()
    assert any(np.frombuffer(alone[0]["second"], dtype=np.int64) < 0)
    assert virtual_ranks(2, program) == [alone] * 2
    assert virtual_ranks(3, program) == [alone] * 3

    measured, plain = pile(), pile()
    for _ in range(4):
        measured.run(10)
        plain.run(10)
        contact_table(measured), KineticEnergy().compute(measured), measured.walls[0].force
    assert fingerprint(measured) == fingerprint(plain)
