"""What walls tell, in a table."""

import numpy as np
import pytest
from clouds import cloud

import barchan as bc
from barchan.errors import OutputError
from barchan.parallel import virtual_ranks
from barchan.writers import Table, read_table, wall_columns

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


def written(path):
    """A table of a cylinder and its floor, and what the floor says itself."""
    sim, told = cloud("cylinder"), []
    side, floor, top = sim.walls
    top.velocity, side.radial_velocity, sim.gravity = (0.01, 0, -0.5), -0.1, (0.3, 0, -2.0)

    class Watch:
        due = bc.Every(50)

        def write(self, sim):
            told.append([*floor.point, *floor.velocity, *floor.force, *floor.torque, floor.pressing, floor.contacts])

    walls = wall_columns({"side": side, "floor": floor, "top": top})
    sim.writers = [Table(path, bc.Every(50), lambda sim: walls(sim) | {"grains": sim.n_grains}), Watch()]
    sim.run(500)
    return sim, np.array(told)


def test_a_table_has_what_walls_tell(tmp_path):
    sim, told = written(tmp_path / "walls.csv")
    table = read_table(tmp_path / "walls.csv")
    names = [f"{what}{axis}" for what in ("", "velocity ", "force ", "torque ") for axis in "xyz"]
    units = 3 * ["m"] + 3 * ["m/s"] + 3 * ["N"] + 3 * ["N m"]
    of_a_plane = [f"{name} [{unit}]" for name, unit in zip(names, units)] + ["pressing [N]", "contacts"]
    of_the_side = [f"side {name}" for name in (*of_a_plane, "radius [m]", "radial velocity [m/s]")]
    assert list(table)[2:] == [*of_the_side, *(f"{wall} {name}" for wall in ("floor", "top") for name in of_a_plane), "grains"]
    assert np.array_equal(np.column_stack([table[f"floor {name}"] for name in of_a_plane]), told)
    assert table["floor contacts"].max() > 3 and np.ptp(table["floor torque x [N m]"]) > 0.0
    assert table["side radius [m]"][-1] == sim.walls[0].radius and (table["side radial velocity [m/s]"] == -0.1).all()
    assert table["top z [m]"] == pytest.approx(5.2 - 0.5 * table["time [s]"]) and (table["top velocity x [m/s]"] == 0.01).all()


def test_the_same_file_on_any_number_of_ranks(tmp_path):
    written(tmp_path / "one.csv")
    virtual_ranks(2, lambda: written(tmp_path / "two.csv")[1])
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()


@pytest.mark.parametrize("walls", [{}, {"top": 3}, bc.Plane((0, 0, 0), (0, 0, 1))])
def test_what_is_no_wall_has_no_columns(walls):
    with pytest.raises(OutputError, match=r"wall_columns: walls = .* must be a dict of names and walls"):
        wall_columns(walls)
