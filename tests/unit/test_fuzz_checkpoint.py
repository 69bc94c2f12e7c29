"""A checkpoint from outside, damaged or made to harm: a clear error of one line, or a sound state. Never anything else.

Damaged bytes never reach HDF5. A forged file, well-formed and with a right checksum, does: what protects the loops from it is
``soundness``, so these tests also run with the loops checking their bounds.
"""

import contextlib
import json
import math
import warnings
from functools import partial

import h5py
import numpy as np
import pytest
from fuzzing import EDITS, cases, filled, fresh, fuzz, mutated, one_line, seal
from hypothesis import strategies as st

from barchan.checkpoint import all_checkpoints, collect, newest_sound, read_state, restore, save
from barchan.errors import BarchanError, CheckpointError


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """(path of a sound checkpoint, its state)."""
    path = tmp_path_factory.mktemp("fuzz") / "sound.h5"
    save(filled(), path)
    state = read_state(path)
    assert (state.contacts.keys < 0).any() and (state.contacts.keys >= 0).any(), "contacts with the floor and with grains"
    assert len(state.bonds.keys) > 5 and len(state.cracks) > 1, "bonds, and some that broke"
    return path, state


def as_floats(value):
    """JSON with every whole number as a float: a face of the box at 0 is one at 0.0 (a truth value is not a number)."""
    if isinstance(value, dict):
        return {name: as_floats(item) for name, item in value.items()}
    if isinstance(value, list):
        return [as_floats(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def same(a, b):
    """True if two states are the same to the bit."""
    arrays = [{k: v.tobytes() for k, v in state.fields.items()} for state in (a, b)]
    arrays = [[fields, *map(bytes, (*s.contacts, *s.bonds, s.cracks))] for fields, s in zip(arrays, (a, b))]
    facts = [json.dumps(as_floats(json.loads(json.dumps(state.about))), sort_keys=True) for state in (a, b)]
    return arrays[0] == arrays[1] and facts[0] == facts[1]


def go_on(path):
    """Restore and run a step: refused in one line, or a state that is that of the file and stays sound."""
    sim = fresh()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            restore(sim, path)
            loaded = collect(sim)
            assert same(loaded, read_state(path))
            sim.run(1)
        except BarchanError as error:
            one_line(error)
            return False
        after = collect(sim)
    assert after.about["step"] == loaded.about["step"] + 1 and np.array_equal(after.fields["id"], loaded.fields["id"])
    for values in (*after.fields.values(), after.contacts.values, after.bonds.values, after.cracks):
        assert np.isfinite(values).all() or values is after.fields["heat"]
    return True


@cases(1500, 50_000)
def test_a_damaged_checkpoint_is_refused(count, saved, tmp_path):
    """Every byte of the file is under the checksum: whatever was changed, nothing of the file reaches HDF5."""
    sound = saved[0].read_bytes()
    path = tmp_path / "damaged.h5"

    @fuzz(count, edits=EDITS)
    def _(edits):
        data = mutated(sound, edits)
        path.write_bytes(data)
        if data == sound:
            read_state(path)
            return
        with pytest.raises(CheckpointError, match=r"damaged\.h5") as caught:
            read_state(path)
        one_line(caught.value)


FIELDS = "id position velocity omega radius mass inertia material frozen image force torque heat".split()
ROWS = [f"{group}/{name}" for group in ("contacts", "bonds") for name in ("start", "keys", "values")]
ARRAYS = st.sampled_from([*(f"grains/{name}" for name in FIELDS), *ROWS, "cracks/values"])
NUMBERS = [0, -1, -2, 1, 7, 2**31, 2**62, 2**63 - 1, -(2**63), math.nan, math.inf, -math.inf, 1e300, 1e308, 1e-300, -1e5, 1e5]
EXTREMES, WHERE = st.sampled_from(NUMBERS), st.floats(0, 1, exclude_max=True)


def set_number(file, name, other, where, value):
    array = file[name][()]
    if array.size:
        with contextlib.suppress(OverflowError, ValueError), np.errstate(all="ignore"):  # what the type cannot hold
            array.ravel()[int(where * array.size)] = value
    file[name][...] = array


def exchange(file, name, other, where, value):
    file.move(name, "grains/aside")
    if other in file:
        file.move(other, name)
    file.move("grains/aside", other)


def replace(make):
    """An edit that puts something else in the place of an array."""

    def edit(file, name, other, where, value):
        array = file[name][()]
        del file[name]
        make(file, name, array, where)

    return edit


def put(change):
    return replace(lambda file, name, array, where: file.__setitem__(name, change(array, where)))


def make(**options):
    def create(file, name, array, where):
        file.create_dataset(name, **({"data": array} | options if "shape" not in options else options))

    return replace(create)


def link(to):
    return replace(lambda file, name, array, where: file.__setitem__(name, to))


def group(file, name, array, where):
    file.create_group(name)["inside"] = array


def shuffle(array, where):
    return np.random.default_rng(int(where * 100)).permutation(array)


ARRAY_EDITS = [
    set_number,
    exchange,
    put(lambda a, where: a[: int(where * len(a))]),
    put(lambda a, where: np.concatenate([a, a[:2]])),
    put(lambda a, where: a[::-1]),
    put(shuffle),
    put(lambda a, where: a.T),
    put(lambda a, where: a.ravel()),
    put(lambda a, where: a[..., None]),
    put(lambda a, where: a.astype(np.float32)),
    put(lambda a, where: a.astype(">i8")),
    put(lambda a, where: a.astype(complex)),
    put(lambda a, where: np.zeros_like(a)),
    put(lambda a, where: 3.0),
    put(lambda a, where: "text"),
    put(lambda a, where: np.array([b"a", b"bc"])),
    put(lambda a, where: h5py.Empty("f8")),
    put(lambda a, where: np.zeros(3, dtype=[("a", "f8"), ("b", "i4")])),
    make(shape=(10**12,), dtype="f8"),
    make(shape=(2**40, 3), dtype="f8", chunks=(1, 3)),
    make(chunks=True, compression="gzip"),
    make(shape=(3,), dtype=h5py.string_dtype()),
    link(h5py.SoftLink("/grains/mass")),
    link(h5py.SoftLink("/nowhere")),
    link(h5py.ExternalLink("/dev/zero", "/x")),
    replace(group),
    replace(lambda file, name, array, where: None),
    lambda file, name, other, where, value: file.__setitem__(f"{name}_2", file[name][()]),
    lambda file, name, other, where, value: file.move("grains", "grain"),
]

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | EXTREMES,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["hash", "value", "x", "name"]), inner, max_size=3)
    ),
)


def places(data, way=()):
    """All places in plain data."""
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inner:
        yield (*way, key)
        yield from places(value, (*way, key))


def edit_about(about, where, how, value):
    """The facts beside the arrays, one of them changed, taken away or doubled."""
    about = json.loads(json.dumps(about))
    ways = list(places(about))
    *way, last = ways[where % len(ways)]
    target = about
    for key in way:
        target = target[key]
    if how == "set":
        target[last] = value
    elif how == "nudge" and isinstance(target[last], (bool, int, float, str)):
        target[last] = {bool: lambda v: not v, int: lambda v: v + 1, float: lambda v: 1.25 * v + 1e-4}.get(
            type(target[last]), lambda v: v + "x"
        )(target[last])
    elif how == "delete":
        del target[last]
    elif isinstance(target, list):
        target.append(target[last])
    else:
        target["more"] = value
    return about


def goes_on_forged(path, saved, edit):
    """Edit a sound file through HDF5. As it is, the checksum gives it away; with a right one, what is checked must."""
    sound = saved[0].read_bytes()
    path.write_bytes(sound)
    with h5py.File(path, "r+") as file:
        edit(file)
    if path.read_bytes() != sound:
        with pytest.raises(CheckpointError, match="checksum"):
            read_state(path)
    seal(path)
    return go_on(path)


@pytest.mark.bounds
@cases(150, 10_000)
def test_arrays_made_to_harm(count, saved, tmp_path):
    accepted = []

    @fuzz(count, edit=st.sampled_from(ARRAY_EDITS) | st.just(set_number), name=ARRAYS, other=ARRAYS, where=WHERE, value=EXTREMES)
    def _(edit, name, other, where, value):
        forge = partial(edit, name=name, other=other, where=where, value=value)
        accepted.append(goes_on_forged(tmp_path / "forged.h5", saved, forge))

    assert 0.05 < np.mean(accepted) < 0.5, "both ways are gone"


@pytest.mark.bounds
@cases(150, 10_000)
def test_facts_made_to_harm(count, saved, tmp_path):
    accepted = []

    @fuzz(count, where=st.integers(0, 10**6), how=st.sampled_from(["set", "nudge", "delete", "add"]), value=JSON)
    def _(where, how, value):
        def forge(file):
            file.attrs["about"] = json.dumps(edit_about(saved[1].about, where, how, value))

        accepted.append(goes_on_forged(tmp_path / "forged.h5", saved, forge))

    assert 0.01 < np.mean(accepted) < 0.9, "both ways are gone"


@pytest.mark.parametrize(
    "about",
    ["", "{", "[]", "null", "NaN", "1" * 5000, "[" * 100_000, b"\xff", 3, np.zeros(4), h5py.Empty("f8"), ["{}", "{}"]],
    ids=range(12),
)
def test_facts_that_are_none(about, saved, tmp_path):
    assert not goes_on_forged(tmp_path / "forged.h5", saved, lambda file: file.attrs.create("about", about))


def test_the_sound_one_goes_on(saved):
    """Otherwise the tests above pass since nothing does."""
    assert go_on(saved[0])


def test_a_damaged_newest_one_gives_way_to_the_one_before(saved, tmp_path):
    for number in (1, 2):
        (tmp_path / f"checkpoint_{number}.h5").write_bytes(saved[0].read_bytes())
    older, newest = all_checkpoints(tmp_path)
    with h5py.File(newest, "r+") as file:
        file["contacts/keys"][0] = 10**6
    seal(newest)
    found, complaints = newest_sound(tmp_path)
    assert found == older and "no other grain and no wall" in complaints[0]
