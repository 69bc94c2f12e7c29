"""Every rule that a state from a file must keep, each broken once: what random damage hits only now and then."""

import copy
import math

import h5py
import numpy as np
import pytest
from fuzzing import filled, fresh, one_line, seal, write_state

from barchan.checkpoint import State, collect, read_state, restore, save
from barchan.errors import BarchanError, CheckpointError


@pytest.fixture(scope="module")
def sound():
    return collect(filled())


@pytest.fixture
def state(sound):
    """A state to break, its arrays in order of their names."""
    return copy.deepcopy(sound)


def about(*way, value=None):
    """Break a fact; None takes it away."""

    def edit(state):
        target = state.about
        for key in way[:-1]:
            target = target[key]
        if value is None:
            del target[way[-1]]
        else:
            target[way[-1]] = value

    return edit


def number(name, row, value):
    """Break one number of an array."""

    def edit(state):
        (state.fields.get(name) if name in state.fields else getattr(state.contacts, name))[row] = value

    return edit


def array(name, change):
    """Replace an array of the grains."""
    return lambda state: state.fields.update({name: change(state.fields[name])})


def contacts(**changes):
    """Replace arrays of the contacts."""
    return lambda state: state._replace(
        contacts=state.contacts._replace(**{n: f(getattr(state.contacts, n)) for n, f in changes.items()})
    )


def bonds(name, row, value):
    """Break one number of an array of the bonds."""

    def edit(state):
        getattr(state.bonds, name)[row] = value

    return edit


def keep_larger(state):
    """A contact is remembered by the larger id, too."""
    start, keys, values = state.contacts
    owners = np.repeat(np.arange(len(start) - 1), np.diff(start))
    row = int(np.flatnonzero(keys >= 0)[0])
    larger = int(np.searchsorted(state.fields["id"], keys[row]))
    start = start + (np.arange(len(start)) > larger)
    at = start[larger]
    while at < start[larger + 1] - 1 and keys[at] < owners[row]:
        at += 1
    keys, values = np.insert(keys, at, state.fields["id"][owners[row]]), np.insert(values, at, values[row], axis=0)
    return state._replace(contacts=state.contacts._replace(start=start, keys=keys, values=values))


def swap_contacts(state):
    """Two contacts of one grain in the wrong order."""
    first = int(state.contacts.start[np.flatnonzero(np.diff(state.contacts.start) > 1)[0]])
    state.contacts.keys[[first, first + 1]] = state.contacts.keys[[first + 1, first]]


def touch_itself(state):
    row = int(np.flatnonzero(np.diff(state.contacts.start))[0])
    state.contacts.keys[state.contacts.start[row]] = state.fields["id"][row]


BROKEN = {
    "no step": (about("step"), "'step' is wrong"),
    "step below 0": (about("step", value=-1), "'step' is wrong"),
    "step beyond all": (about("step", value=2**62), "'step' is wrong"),
    "time not finite": (about("time", value=math.nan), "'time' is wrong"),
    "dt zero": (about("dt", value=0.0), "'dt' is wrong"),
    "next id below those used": (about("next_id", value=10), "ids do not ascend from 0 to below next_id = 10"),
    "text for a flag": (about("forces_are_current", value="no"), "'forces_are_current' is wrong"),
    "unknown fact": (about("more", value=1), "'more' is wrong"),
    "no notes": (about("notes", value=[]), "'notes' is wrong"),
    "format": (about("format", value=1), "another format than 9"),
    "stretched corner": (about("stretched", "low", value=[0.0, 0.0]), "'stretched.low' is wrong"),
    "two servos": (about("stretched", "servos", value=[None, None]), "'stretched.servos' is wrong"),
    "memory of a servo": (about("stretched", "servos", value=6 * [{"steady": 0.0}]), "'stretched.servos.0.rate' is wrong"),
    "rate of a box": (about("stretched", "rate", value=[0.0, math.nan, *4 * [0.0]]), "the box is stretched to what is none"),
    "box inside out": (about("stretched", "high", value=[-1.0, -1.0, -1.0]), "the box is stretched to what is none"),
    "box stretched across a wall": (about("stretched", "low", value=[-1.0, -1.0, -1.0]), "along an axis that is not periodic"),
    "box that moves across a wall": (about("stretched", "rate", value=[0.1] * 3 + [0] * 3), "an axis that is not periodic"),
    "tilt of a box": (about("stretched", "tilt", value=[math.inf, 0.0, 0.0]), "the box is stretched to what is none"),
    "tilt of two numbers": (about("stretched", "tilt", value=[0.0, 0.0]), "'stretched.tilt' is wrong"),
    "tilt across a wall": (about("stretched", "tilt", value=[0.0, 0.1, 0.0]), "the box is sheared in more ways than one, along"),
    "tilt by more than half": (about("stretched", "tilt", value=[3.1, 0.0, 0.0]), "or by more than half a period"),
    "two tilts": (about("stretched", "tilt", value=[0.1, 0.0, 0.1]), "the box is sheared in more ways than one, along"),
    "shear across a wall": (about("stretched", "rate", value=[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), "the box is sheared in more ways"),
    "box without a middle": (about("stretched", "middle", value=[0.0, 0.0, 0.0]), "not periodic, or to nothing"),
    "history of a law": (about("law", "history", value={"slip": 2}), "'law.history.slip' is wrong"),
    "corner of the box": (about("box", "low", value=[0.0, 0.0]), "'box.low' is wrong"),
    "field that grains have": (about("user_fields", 0, "name", value="radius"), "every grain has that field anyway"),
    "type of a field": (about("user_fields", 0, "dtype", value="object"), "'user_fields.0.dtype' is wrong"),
    "width of a field": (about("user_fields", 0, "width", value=2), "heat has type float32 and shape (30, 3), not float32 and "),
    "default of a field": (about("user_fields", 0, "default", value=1e300), "default = 1e+300"),
    "gravity": (about("gravity", value={"value": [0.0, math.nan, 0.0]}), "gravity is neither"),
    "no gravity": (about("gravity", value={}), "gravity is neither"),
    "damping": (about("damping", "local", value=1.0), "'damping.local' is wrong: Input should be less than 1"),
    "loads of old forces": (about("forces_are_current", value=False), "it has loads of walls, and forces that are not those"),
    "point of a wall": (about("walls", 0, "point", value=[0.0, 0.0, math.inf]), "wall 0 is not described as a plane is"),
    "normal of a wall": (about("walls", 0, "normal", value=[0.0, 0.0, 2.0]), "wall 0 is not described as a plane is"),
    "normal across a period": (about("walls", 0, "normal", value=[1.0, 0.0, 0.0]), "leans along x, where the box is periodic"),
    "key of a wall": (about("walls", 0, "key", value=-2), "wall 0 is not described as a plane is"),
    "missing field": (lambda state: state.fields.pop("mass"), "fields are missing, or do not belong to it: mass"),
    "field too many": (lambda state: state.fields.update(more=state.fields["mass"]), "do not belong to it: more"),
    "type of an array": (array("mass", np.float32), "mass has type float32 and shape (30,), not float64 and (30,)"),
    "length of an array": (array("mass", lambda a: a[:-1]), "mass has type float64 and shape (29,), not float64 and (30,)"),
    "width of an array": (array("velocity", lambda a: a[:, :2]), "velocity has type float64 and shape (30, 2)"),
    "no ids": (array("id", lambda a: a[0]), "shape (30, 3), not float64 and (0, 3)"),
    "ids not ascending": (number("id", 3, 1), "ids do not ascend"),
    "id below 0": (number("id", 0, -5), "ids do not ascend"),
    "grain outside": (number("position", (4, 0), 6.1), "grain 4 at [6.1,"),
    "grain nowhere": (number("position", (4, 2), math.nan), "is not inside the box"),
    "type of keys": (contacts(keys=np.float64), "contacts have types int64, float64, float64"),
    "contacts of fewer grains": (contacts(start=lambda a: a[:-1]), "they do not fit 30 grains"),
    "width of memory": (contacts(values=lambda a: a[:, :2]), "they do not fit 30 grains"),
    "more keys than memory": (contacts(keys=lambda a: np.append(a, 29)), "do not follow each other from 0 to"),
    "contacts begin late": (number("start", 0, 1), "do not follow each other from 0"),
    "contacts go on beyond": (number("start", -1, 10**6), "do not follow each other from 0"),
    "contacts go back": (number("start", 15, -(10**6)), "do not follow each other from 0"),
    "contact with nobody": (number("keys", 0, 10**6), "which is no other grain and no wall"),
    "contact with no wall": (number("keys", 0, -2), "has a contact with -2, which is no other grain and no wall"),
    "contact with itself": (touch_itself, "which is no other grain and no wall"),
    "order of contacts": (swap_contacts, "not in ascending order"),
    "memory of the larger id": (keep_larger, "whose is the smaller id"),
    "memory not finite": (number("values", (slice(None), 0), math.inf), "a contact remembers a value that is not finite"),
    "no bonds": (about("bonds"), "'bonds' is wrong"),
    "bonds of fewer grains": (lambda s: s._replace(bonds=s.bonds._replace(start=s.bonds.start[:-1])), "bonds have shapes"),
    "bonds go back": (bonds("start", 15, -(10**6)), "do not follow each other from 0"),
    "bond with nobody": (bonds("keys", -1, 10**6), "a bond with what is no grain of larger id"),
    "bond with the smaller id": (bonds("keys", 0, -1), "a bond with what is no grain of larger id"),
    "kind of a bond": (bonds("values", (0, 0), 1.0), "a bond is of none of its 1 kinds, or has no strength"),
    "half a kind": (bonds("values", (0, 0), 0.5), "a bond is of none of its 1 kinds, or has no strength"),
    "strength of a bond": (bonds("values", (0, 1), 0.0), "a bond is of none of its 1 kinds, or has no strength"),
    "bonds never installed": (about("bonds", "active", value=False), "a bond is of none of its 1 kinds, or has no strength"),
    "memory of a bond": (bonds("values", (0, 3), math.nan), "a bond remembers, or a crack was, a value that is not finite"),
    "order of cracks": (lambda s: s._replace(cracks=s.cracks[::-1].copy()), "in the order of these"),
    "crack of nobody": (lambda s: s.cracks.__setitem__((-1, 3), 1e6), "cracks are not between two of the grains"),
    "crack to come": (lambda s: s.cracks.__setitem__((-1, 0), 1e6), "up to its step"),
    "width of a crack": (lambda s: s._replace(cracks=s.cracks[:, :3]), "cracks have type float64 and shape"),
}  # fmt: skip


def refused(path):
    """What ``restore`` says."""
    with pytest.raises(BarchanError) as caught:
        restore(fresh(), path)
    return one_line(caught.value)


@pytest.mark.parametrize("rule", BROKEN)
def test_a_broken_rule_is_named(rule, state, tmp_path):
    edit, message = BROKEN[rule]
    edited = edit(state)
    write_state(edited if isinstance(edited, State) else state, tmp_path / "c.h5")
    assert message in refused(tmp_path / "c.h5")


def test_the_sound_state_keeps_them_all(state, tmp_path):
    write_state(state, tmp_path / "c.h5")
    sim = fresh()
    restore(sim, tmp_path / "c.h5")
    assert (state.contacts.keys < 0).any() and (np.diff(state.contacts.start) > 1).any()
    assert sim.grains.n == 30
    assert len(state.cracks) > 1 and len(sim.bonds) == len(state.bonds.keys) > 5, "some bonds broke, some hold"


def test_a_bond_with_a_grain_that_is_not_there_is_refused(state, tmp_path):
    """Of several ranks none knows all ids: the one that is asked for it does."""
    ids = state.fields["id"]
    keep = ids != state.bonds.keys[-1]
    fields = {name: values[keep] for name, values in state.fields.items()}
    rows = state.contacts.empty(keep.sum(), state.contacts.values.shape[1])
    write_state(state._replace(fields=fields, contacts=rows, bonds=state.bonds.take(np.flatnonzero(keep))), tmp_path / "c.h5")
    assert f"a bond with grain {state.bonds.keys[-1]}, which is not in it" in refused(tmp_path / "c.h5")


def test_contacts_of_removed_grains_may_stay(tmp_path):
    """Taking a grain out leaves the memory of its partners until the next rebuild."""
    sim = filled()
    contacts = collect(sim).contacts
    sim.remove([contacts.keys.max()])
    save(sim, tmp_path / "c.h5")
    assert contacts.keys.max() in read_state(tmp_path / "c.h5").contacts.keys
    restore(fresh(), tmp_path / "c.h5")


def test_the_state_of_a_failed_run_can_be_looked_at(state, tmp_path):
    """It is saved for that; going on from it is refused."""
    state.fields["position"][3] = math.nan
    state.contacts.values[...] = math.nan
    state.about["walls"][0]["force"] = [math.nan] * 3
    write_state(state, tmp_path / "c.h5")
    assert np.isnan(read_state(tmp_path / "c.h5").fields["position"][3]).all()
    assert "grain 3 at [nan, nan, nan] is not inside the box" in refused(tmp_path / "c.h5")


STORED = {
    "beyond the file": lambda file: file.create_dataset("grains/mass", shape=(10**12,), dtype="f8"),
    "in chunks": lambda file: file.create_dataset("grains/mass", data=np.ones(30), chunks=(5,)),
    "compressed": lambda file: file.create_dataset("grains/mass", data=np.ones(30), compression="gzip"),
    "as texts": lambda file: file.create_dataset("grains/mass", data=["a"] * 30),
    "empty": lambda file: file.create_dataset("grains/mass", data=h5py.Empty("f8")),
    "in another file's bytes": lambda file: file.create_dataset(
        "grains/mass", shape=(30,), dtype="f8", external=[("/dev/zero", 0, 240)]
    ),
    "as a link": lambda file: file.__setitem__("grains/mass", h5py.SoftLink("/grains/inertia")),
    "elsewhere": lambda file: file.__setitem__("grains/mass", h5py.ExternalLink("other.h5", "/mass")),
    "as a group": lambda file: file.create_group("grains/mass"),
}


@pytest.mark.parametrize("way", STORED)
def test_arrays_that_are_stored_otherwise_are_refused(way, state, tmp_path):
    """Reading them would fill the memory, run foreign code, or read other files."""
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["mass"] = state.fields["mass"]
    path = tmp_path / "c.h5"
    write_state(state, path)
    with h5py.File(path, "r+") as file:
        del file["grains/mass"]
        STORED[way](file)
    seal(path)
    assert "'grains/mass' is not stored as barchan stores it" in refused(path) or "'mass' is missing or of" in refused(path)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (about("law", "name", value="hertz"), "belongs to another scene: its law is 'hertz', here it is 'linear'"),
        (about("law", "hash", value="0" * 64), "belongs to another scene: law 'linear' has changed since"),
        (about("materials", "materials", 0, "friction", value=0.5), "scene: materials a friction is 0.5 there and 0.4 here"),
        (about("materials", "materials", 0, "kt"), "materials a kt is 'not given' there and 300.0 here"),
        (about("materials", "pairs", value=[{"first": "a"}]), "pairs is [{'first': 'a'}] there and [] here"),
        (about("box", "high", value=[7.0, 6.0, 6.0]), "box high is [7.0, 6.0, 6.0] there and [6.0, 6.0, 6.0] here"),
        (
            about("stretched", "servos", 0, value={"rate": 0.0, "steady": 0.0}),
            "what a StressServo finds is ['x'] there and [] here",
        ),
        (about("walls", 0), "it has 0 walls, here there are 1; add the same walls in the same order"),
        (about("walls", 0, "kind", value="sphere"), "wall 0 is ('sphere', 0) there and ('plane', 0) here"),
        (about("bonds", "law", "name", value="cement"), "bonds: name is 'cement' there and 'parallel_bond' here"),
        (about("bonds", "kinds", 0, "kn", value=1.0), "bonds: glue kn is 1.0 there and 500.0 here"),
        (about("bonds", "kinds", value=[]), "bonds: is [] there and [{'"),
        (about("gravity", value={"hash": "0" * 64}), "its gravity is a function of time, here it is not"),
    ],
)  # fmt: skip
def test_another_scene_is_named_by_its_first_difference(edit, message, state, tmp_path):
    write_state(state._replace(contacts=state.contacts.empty(30, 3), bonds=state.bonds.empty(30, 10)), tmp_path / "c.h5")
    restore(fresh(), tmp_path / "c.h5")
    edit(state)
    write_state(state._replace(contacts=state.contacts.empty(30, 3), bonds=state.bonds.empty(30, 10)), tmp_path / "c.h5")
    said = refused(tmp_path / "c.h5")
    assert message in said and "0000" not in said


def test_a_field_of_another_width_and_a_changed_function_are_named(state, tmp_path):
    write_state(state, tmp_path / "c.h5")
    sim = fresh()
    sim.add_field("heat", 2, np.float32)
    with pytest.raises(CheckpointError, match="width of field 'heat' is 3 there and 2 here"):
        restore(sim, tmp_path / "c.h5")
    sim = fresh()
    sim.gravity = lambda time: (0.0, 0.0, -time)
    with pytest.raises(CheckpointError, match="its gravity is constant, here it is not"):
        restore(sim, tmp_path / "c.h5")
    state.about["gravity"] = {"hash": "0" * 64}
    write_state(state, tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="its gravity is a function of time that has changed since"):
        restore(sim, tmp_path / "c.h5")
