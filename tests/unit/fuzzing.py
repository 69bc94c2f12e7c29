"""What the tests with damaged and forged files share."""

import json
import warnings

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import pile

import barchan as bc
from barchan.parallel import Serial, files


def cases(few, many=20000):
    """A number of cases for every run, and one for ``make validate``."""
    return pytest.mark.parametrize("count", [few, pytest.param(many, marks=pytest.mark.validate)])


def fuzz(count, **strategies):
    """Run what is decorated on ``count`` cases, now."""

    def run(check):
        quiet = settings(max_examples=count, suppress_health_check=list(HealthCheck))
        quiet(given(**strategies)(check))()

    return run


#: Damage of a file: where, what, how much, with which bytes.
EDITS = st.lists(
    st.tuples(
        st.floats(0, 1, exclude_max=True),
        st.sampled_from(["cut", "insert", "double", "flip"]),
        st.integers(1, 40),
        st.binary(max_size=8),
    ),
    min_size=1,
    max_size=4,
)


def mutated(data, edits):
    """Bytes with parts cut out, put in, doubled, flipped."""
    for where, what, size, more in edits:
        at = int(where * len(data))
        if what == "cut":
            data = data[:at] + data[at + size :]
        elif what == "insert":
            data = data[:at] + more + data[at:]
        elif what == "double":
            data = data[: at + size] + data[at:]
        elif at < len(data):
            data = data[:at] + bytes([data[at] ^ size]) + data[at + 1 :]
    return data


def one_line(error):
    text = str(error)
    assert text.isprintable() and 0 < len(text) < 3000, text
    return text


#: Breaks here and there in the pile below.
GLUE = bc.Bond(bc.laws.parallel_bond, "glue", kn=500.0, ks=500.0, tensile_strength=12.0, shear_strength=12.0)


def filled():
    """A pile with contacts between grains and with the floor, some bonds, some of them broken, and a field of its own."""
    sim = pile(30, bonds=GLUE)
    sim.add_field("heat", 3, np.float32, 1.5)
    sim.max_overlap = 0.5
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(400)
        sim.install_bonds(overlap=-0.4)
        sim.run(50)
    return sim


def fresh():
    """What a script builds before it restores."""
    sim = pile(0, bonds=GLUE)
    sim.max_overlap = 0.5
    return sim


def seal(path):
    """Give a file the checksum that it should have."""
    with open(path, "r+b") as file:
        file.write(files._head(files.checksum(Serial(), path)))


def write_state(state, path):
    """Write any state to a file, as ``checkpoint.save`` does with that of a simulation."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in state.fields.items():
            file[f"grains/{name}"] = values
        for group, rows in (("contacts", state.contacts), ("bonds", state.bonds)):
            for name, values in rows._asdict().items():
                file[f"{group}/{name}"] = values
        file["cracks/values"] = state.cracks
        file.attrs["about"] = json.dumps(state.about)
    seal(path)
