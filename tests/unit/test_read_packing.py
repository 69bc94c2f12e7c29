"""Packings from files: each form is read as it is meant, and what is wrong is told with file and line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import pile, simulation

import barchan as bc
from barchan.errors import BarchanError, PackingError
from barchan.packing import Packing, read_packing
from barchan.writers import LammpsDump
from barchan.writers.collect import grains_at_full_step

DATA = """three grains

3 atoms
2 atom types
-1 9 xlo xhi
0 8.5 ylo yhi
0 7 zlo zhi

Masses

1 1.0
2 2.0

Atoms # sphere

7 2 1.0 2650 1.5 2.5 3.5 0 -1 0
2 1 0.5 2650 4 5 6 0 0 0   # a remark
5 1 0.25 2650 7 8 0.125 0 0 0

Velocities

2 0.1 0.2 0.3 1 1 1
5 0 0 -1e-3 0 0 0
7 4 5 6 0 0 0
"""

FRAME = """ITEM: UNITS
si
ITEM: TIMESTEP
{step}
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS pp ff pp
-1 9
0 8.5
0 7
ITEM: ATOMS id element type diameter x yu z vx vy vz
7 Si 2 1.0 1.5 {y} 3.5 4 5 6
2 O 1 0.5 4 5 6 0.1 0.2 0.3
5 O 1 0.25 7 8 0.125 0 0 -1e-3
"""

DUMP = FRAME.format(step=0, y=99) + FRAME.format(step=100, y=2.5)

CSV = """x, y, z, diameter, colour, type, vx, vy, vz
4,5,6,0.5,red,1,0.1,0.2,0.3
7,8,0.125,0.25,blue,1,0,0,-1e-3

1.5,2.5,3.5,1.0,red,2,4,5,6
"""

XYZR = "#format x_y_z_r_matId\n# a remark\n4\t5\t6\t0.25\t0\n7 8 0.125 0.125 0 # one more\n\n1.5\t2.5\t3.5\t0.5\t1\n"

FORMS = {"grains.data": DATA, "grains.dump": DUMP, "grains.csv": CSV, "grains.txt": XYZR}
BOXES = {"grains.data": (False, False, False), "grains.dump": (True, False, True)}


def put(folder, name, text):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("name", FORMS)
def test_the_same_grains_from_every_form(name, tmp_path):
    packing = read_packing(put(tmp_path, name, FORMS[name]))
    assert packing.position.tolist() == [[4, 5, 6], [7, 8, 0.125], [1.5, 2.5, 3.5]]
    assert packing.radius.tolist() == [0.25, 0.125, 0.5] and packing.material.tolist() == [0, 0, 1]
    moving = [[0.1, 0.2, 0.3], [0, 0, -1e-3], [4, 5, 6]]
    assert packing.velocity.tolist() == (np.zeros((3, 3)).tolist() if name == "grains.txt" else moving)
    if name in BOXES:
        assert packing.box.low.tolist() == [-1, 0, 0] and packing.box.high.tolist() == [9, 8.5, 7]
        assert packing.box.periodic == BOXES[name]
    else:
        assert packing.box is None


@pytest.mark.parametrize(
    ("text", "radius"),
    [("x_y_z_r\n1 2 3 4\n", 4), ("1 2 3 0.5\n", 0.5), ("#format x_y_z_r\r\n1 2 3 0.5\r\n", 0.5), ("\ufeff1 2 3 0.5", 0.5)],
)
def test_lines_of_spheres(text, radius, tmp_path):
    path = put(tmp_path, "a.txt", text)
    if radius == 4:
        with pytest.raises(PackingError, match=r"a\.txt, line 1: 1 values, where there must be 4"):
            read_packing(path)
    else:
        assert read_packing(path).radius.tolist() == [radius]


def test_a_periodic_sphere_pack(tmp_path):
    packing = read_packing(put(tmp_path, "a.txt", "##PERIODIC:: 2 3 4\n1 2 3 0.5\n"))
    assert packing.box.high.tolist() == [2, 3, 4] and packing.box.periodic == (True, True, True)


def test_files_without_grains(tmp_path):
    empty = DATA.replace("3 atoms", "0 atoms").partition("Atoms #")[0] + "Atoms\n"
    assert isinstance(read_packing(put(tmp_path, "a.data", empty)), Packing)
    assert len(read_packing(put(tmp_path, "a.csv", "x,y,z,radius\n")).radius) == 0


@pytest.mark.filterwarnings("ignore:step .* overlap by more than")
def test_what_a_dump_wrote_comes_back_to_the_bit(tmp_path):
    sim = pile()
    sim.run(30)
    LammpsDump(tmp_path, bc.Every(1)).write(sim)
    packing, fields = read_packing(tmp_path / "grains_000000000030.dump"), grains_at_full_step(sim)
    for name in ("position", "radius", "material", "velocity"):
        assert np.array_equal(getattr(packing, name), fields[name]), name
    assert np.array_equal(packing.box.high, sim.box.high) and packing.box.periodic == sim.box.periodic
    again = simulation(packing.box)
    again.add_grains(packing.position, packing.radius, packing.material, packing.velocity)
    assert np.array_equal(again.grains.sorted_by_id("mass"), fields["mass"])


#: File, what is replaced by what in it, and what is told.
WRONG = [
    ("grains.data", "4 5 6", "4 nan 6", "line 17: .* not finite"),
    ("grains.data", "4 5 6", "4 5x 6", "line 17: .* something else than numbers"),
    ("grains.data", "0.5 2650 4", "-0.5 2650 4", r"line 17: radius = -0.25 \[length\] must be above 0"),
    ("grains.data", "3 atoms", "4 atoms", "line 14: 3 rows follow, but the header announces 4 atoms"),
    ("grains.data", "3 atoms", "3.5 atoms", "line 3: atoms = 3.5 must be a whole number"),
    ("grains.data", "2 1 0.5 2650", "7 1 0.5 2650", "line 17: id 7 is that of the grain in line 16, too"),
    ("grains.data", "2 1 0.5 2650", "2 0 0.5 2650", "line 17: type = 0 must be a whole number >= 1"),
    ("grains.data", "2 1 0.5 2650", "2 1.5 0.5 2650", "line 17: type = 1.5"),
    ("grains.data", "2 1 0.5 2650 4", "2 1 0.5 4", "line 17: 9 values, where there must be 7 or 10"),
    ("grains.data", "# sphere", "# full", "line 14: atom_style full has no radii"),
    ("grains.data", "0 7 zlo zhi", "0 7 zlo zhi\n1 0 0 xy xz yz", "line 8: the box is tilted"),
    ("grains.data", "0 7 zlo zhi", "", "does not give the box"),
    ("grains.data", "0 8.5 ylo", "9 8.5 ylo", "the box from .* has no volume"),
    ("grains.data", "Atoms # sphere", "Bonds", "no section Atoms"),
    ("grains.data", "5 0 0 -1e-3 0 0 0\n", "", "line 20: 2 rows follow"),
    ("grains.data", "\n5 0 0 -1e-3", "\n6 0 0 -1e-3", "line 23: no atom has the id 6 of these"),
    ("grains.data", "\n5 0 0 -1e-3", "\n2 0 0 -1e-3", "line 23: id 2 is that of the grain in line 22, too"),
    ("grains.dump", "2 O 1 0.5 4 5 6 0.1 0.2 0.3\n", "", "line 24: 2 rows follow, but the frame announces 3"),
    ("grains.dump", "2 O 1 0.5 4 5 6", "2 O 1 0.5 4 5", "line 27: 9 values for 10 columns"),
    ("grains.dump", "2 O 1 0.5 4 5 6", "2 O 1 0.5 4 inf 6", "line 27: .* not finite"),
    ("grains.dump", "diameter", "size", r"line 25: no column radius \(or diameter\)"),
    ("grains.dump", " x yu z", " xs ys zs", "line 25: no column x, y, z"),
    ("grains.dump", "vx vy vz", "vx vy vy", "line 25: columns vy cannot be there twice"),
    ("grains.dump", "pp ff pp\n-1 9", "xy xz yz pp ff pp\n-1 9 0", "line 21: the box is tilted"),
    ("grains.dump", "BOX BOUNDS", "BOUNDS", "no 'ITEM: BOX BOUNDS'"),
    ("grains.dump", "ITEM: NUMBER OF ATOMS\n3", "ITEM: NUMBER OF ATOMS\nmany", "line 20: 'many' holds something else"),
    ("grains.csv", "4,5,6,0.5", "4,5,6,0", r"line 2: radius = 0 \[length\] must be above 0"),
    ("grains.csv", "4,5,6,0.5", "4,5,,0.5", "line 2: .* something else than numbers"),
    ("grains.csv", "1.5,2.5,3.5", "1.5,2.5", "line 5: 8 values for 9 columns"),
    ("grains.csv", "colour", "radius", "line 1: columns radius and diameter cannot be there together"),
    ("grains.csv", "colour", "material", "line 1: columns type and material cannot be there together"),
    ("grains.csv", "vy, ", "wy, ", "line 1: no column vy"),
    ("grains.csv", CSV, "", "is empty"),
    ("grains.txt", "7 8 0.125 0.125 0", "7 8 0.125 0.125", "line 4: 4 values, where there must be 5"),
    ("grains.txt", "x_y_z_r_matId", "id_x_y_z_r_matId", "line 1: format id_x_y_z_r_matId cannot be read"),
    ("grains.txt", "0.25\t0", "0.25\t-1", "line 3: material = -1 must be a whole number >= 0"),
    ("grains.txt", XYZR, "# nothing\n", "holds no grains"),
    ("grains.txt", XYZR, b"\xff\xfe\x00", "holds no text"),
]


@pytest.mark.parametrize(("name", "old", "new", "message"), WRONG, ids=lambda value: None)
def test_what_is_wrong_is_told_with_its_line(name, old, new, message, tmp_path):
    assert old in FORMS[name]
    text = new if isinstance(new, bytes) else FORMS[name].replace(old, new)
    with pytest.raises(PackingError, match=rf"packing \S*{name}.*{message}"):
        read_packing(put(tmp_path, name, text))


def test_the_frame_before_one_that_was_cut_is_not_taken_for_it(tmp_path):
    for cut in ("ITEM: TIMESTEP\n200\n", "ITEM: TIMESTEP\n200\nITEM: NUMBER OF ATOMS\n3\n"):
        with pytest.raises(PackingError, match="its last frame has no"):
            read_packing(put(tmp_path, "a.dump", DUMP + cut))


def test_a_missing_file(tmp_path):
    with pytest.raises(PackingError, match=r"none\.csv cannot be read: No such file"):
        read_packing(tmp_path / "none.csv")


@settings(max_examples=400)
@given(
    name=st.sampled_from(sorted(FORMS)),
    where=st.floats(0.0, 0.9999),
    length=st.integers(0, 30),
    new=st.sampled_from(
        [b"", b" ", b"\n", b"-", b"9", b"e", b"#", b"ITEM:", b"\nITEM: ", b",", b"\xff", b"nan", b"1e999", b"Atoms"]
    ),
)
def test_an_altered_file_is_read_as_sound_grains_or_refused(name, where, length, new, tmp_path_factory):
    data = FORMS[name].encode()
    begin = int(where * len(data))
    path = put(tmp_path_factory.getbasetemp(), name, data[:begin] + new + data[begin + length :])
    try:
        packing = read_packing(path)
    except BarchanError as error:
        assert isinstance(error, PackingError) and name in str(error)
        return
    count = len(packing.radius)
    assert packing.position.shape == packing.velocity.shape == (count, 3) and packing.material.shape == (count,)
    assert np.isfinite(packing.position).all() and np.isfinite(packing.velocity).all() and np.isfinite(packing.radius).all()
    assert (packing.radius > 0).all() and (packing.material >= 0).all()
