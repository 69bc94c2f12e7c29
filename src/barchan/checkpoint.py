"""The whole state, written and read: all that the next step reads, so that a resumed run has the bits of one that never
stopped.

A checkpoint is one HDF5 file, written under another name and renamed when it is complete, with a checksum over everything in
it. It holds data only: laws and functions of time stay in the user's script, and a hash tells if they have changed.
"""

import json
import os
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from barchan import atomic, soundness
from barchan.errors import CheckpointError, SceneError
from barchan.kernels.provenance import source_hash
from barchan.neighbors.rows import ContactRows
from barchan.writers.output import write_on_first_rank

FORMAT = 2


class State(NamedTuple):
    """A state as plain data, grains in ascending order of id.

    ``about``: JSON-able facts (step, time, walls, ...). ``fields``: name -> array. ``contacts``: each grain's contacts by
    ascending key, with the memory as seen from the smaller id.
    """

    about: dict
    fields: dict
    contacts: ContactRows


def collect(sim):
    """The state of all ranks, on every rank. Reads, and changes nothing."""
    grains = sim.grains
    rows = sim.contacts.detach(grains.n, on_both=True) if sim.is_listed else sim.put_away_rows
    part = ({f.name: grains.view(f.name).copy() for f in grains.saved_fields()}, rows)
    parts = sim.comm.all_gather(part)
    fields = {name: np.concatenate([fields[name] for fields, _ in parts]) for name in part[0]}
    order = np.argsort(fields["id"], kind="stable")
    contacts = ContactRows.join([rows for _, rows in parts]).take(order)
    return State(_about(sim), {name: values[order] for name, values in fields.items()}, contacts)


def _about(sim):
    gravity = {"hash": source_hash(sim.gravity)} if callable(sim.gravity) else {"value": [float(g) for g in sim.gravity]}
    user = [f for f in sim.grains.saved_fields() if f.block.startswith("user_")]
    return {
        "format": FORMAT,
        "step": sim.step_number,
        "time": sim.time,
        "dt": sim.dt,
        "next_id": sim.next_id,
        "forces_are_current": sim.is_primed,
        "large_overlaps": int(sim.comm.sum([sim.large_overlaps])[0]),
        "notes": sim.notes,
        "gravity": gravity,
        "law": {"name": sim.law.name, "hash": source_hash(sim.law), "history": sim.law.history},
        "materials": sim.materials.describe(),
        "walls": [wall.state() for wall in sim.walls],
        "box": {"low": sim.box.low.tolist(), "high": sim.box.high.tolist(), "periodic": list(sim.box.periodic)},
        "user_fields": [
            {
                "name": f.name,
                "width": f.width,
                "dtype": np.dtype(f.dtype).name,
                "default": float(f.default),
                "dimension": f.dimension,
            }
            for f in user
        ],
    }


def save(sim, path):
    """Write the state of ``sim`` to the file ``path``; an older file of that name stays whole until the new one is.

    Raises:
        OutputError: the file cannot be written (full disk, no permission).
        SceneError: ``Simulation.notes`` holds something else than numbers and text.
    """
    sim.take_up_changes()
    state = collect(sim)
    try:
        json.dumps(state.about)
    except TypeError as error:
        raise SceneError(f"checkpoint {path}: Simulation.notes and material properties hold numbers and text: {error}") from None
    write_on_first_rank(sim, path, lambda: write_state(state, path))


def write_state(state, path):
    """Write a state to a file, atomically."""
    with atomic.writing_hdf5(path) as file:
        for name, values in state.fields.items():
            file[f"grains/{name}"] = values
        for name, values in state.contacts._asdict().items():
            file[f"contacts/{name}"] = values
        file.attrs["about"] = json.dumps(state.about)


def read_state(path):
    """Read a state from a file. Its structure is sound; its values may be those of a run that failed.

    Raises:
        CheckpointError: the file is missing, cut, altered, or no checkpoint of barchan.
    """
    path = Path(path)
    if not path.is_file():
        raise CheckpointError(f"checkpoint {path}: there is no such file")
    try:
        return _read(path)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError) as error:
        raise CheckpointError(_broken(path, " ".join(str(error).split())[:300])) from None


def _broken(path, reason):
    return f"checkpoint {path}: {reason}; it is cut, altered or no checkpoint of barchan. Use the one before it"


def _read(path):
    with atomic.reading_hdf5(path) as file:
        about = json.loads(file.attrs["about"])
        fields = _arrays(file, "grains", path.stat().st_size)
        rows = _arrays(file, "contacts", path.stat().st_size)
    contacts = ContactRows(*(rows[name] for name in ContactRows._fields))
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise ValueError(f"it has another format than {FORMAT}, which this version of barchan reads")
    fault = soundness.structure_fault(about, fields, contacts)
    if fault:
        raise ValueError(fault)
    return State(about, fields, contacts)


def _arrays(file, name, most):
    """The arrays of a group, if they lie in the file as they were written: plain numbers, whole, and no more than it holds."""
    group = _inside(file, name, h5py.Group)
    datasets = {key: _inside(group, key, h5py.Dataset) for key in group}
    for key, dataset in datasets.items():
        elsewhere = dataset.shape is None or dataset.chunks or dataset.is_virtual or dataset.external
        if elsewhere or dataset.dtype.kind not in "biufc" or dataset.nbytes > most:
            raise ValueError(f"'{name}/{key}' is not stored as barchan stores it")
    return {key: dataset[()] for key, dataset in datasets.items()}


def _inside(group, name, kind):
    """A member of a group that is no link to elsewhere."""
    if not isinstance(group.get(name, getlink=True), h5py.HardLink) or not isinstance(group[name], kind):
        raise ValueError(f"'{name}' is missing or of another kind")
    return group[name]


def restore(sim, path):
    """Put a state into a simulation that was built by the same script, without its grains.

    Law, materials, walls and box must be those of the script; positions of walls, gravity and all grains come from the file.

    Raises:
        CheckpointError: the file is damaged, or belongs to another scene (the message names the first difference).
    """
    state = read_state(path)
    about, now = state.about, json.loads(json.dumps(_about(sim)))
    difference = soundness.foreign(about, now)
    if difference:
        raise CheckpointError(f"checkpoint {path} belongs to another scene: {difference}")
    fault = soundness.value_fault(state, now["walls"])
    if fault:
        raise CheckpointError(_broken(path, fault))
    if not callable(sim.gravity):
        sim.gravity = tuple(about["gravity"]["value"])
    for number, (wall, wall_state) in enumerate(zip(sim.walls, about["walls"])):
        wall.restore(wall_state)
        wall.check(sim.box, f"checkpoint {path}: wall {number}")
    known = {field.name for field in sim.grains.table}
    for field in about["user_fields"]:
        if field["name"] not in known:
            sim.add_field(field["name"], field["width"], field["dtype"], field["default"], field["dimension"])
    sim.load(state)


class Checkpoints:
    """A writer: saves a checkpoint into a directory when it is due, and keeps the last ones.

    Args:
        directory: where; files are called ``checkpoint_<step>.h5``.
        due: trigger, a function of the step.
        keep: how many to keep; at least two, so that a damaged one leaves the one before it.
    """

    def __init__(self, directory, due, keep=2):
        self.directory, self.due, self.keep, self._first = Path(directory), due, max(2, keep), True

    def write(self, sim):
        """Save the state now."""
        if self._first:
            self._make_room(sim)
        self._first = False
        save(sim, self.directory / f"checkpoint_{sim.step_number:012d}.h5")
        if sim.comm.rank == 0:
            for old in all_checkpoints(self.directory)[: -self.keep]:
                old.unlink(missing_ok=True)

    def _make_room(self, sim):
        """Refuse a directory that holds later steps of another run; put damaged ones aside."""
        failure = None
        if sim.comm.rank == 0:
            for path in all_checkpoints(self.directory):
                if int(path.stem.split("_")[1]) > sim.step_number:
                    try:
                        read_state(path)
                        failure = (
                            f"{self.directory} holds checkpoints of another run, up to {path.name}, and this one is at step "
                            f"{sim.step_number}. Restore them, or choose another directory"
                        )
                    except CheckpointError:
                        os.replace(path, path.with_suffix(".damaged"))
        failure = sim.comm.all_gather(failure)[0]
        if failure:
            raise CheckpointError(failure)


def all_checkpoints(directory):
    """Checkpoints in a directory, oldest first."""
    return sorted(path for path in Path(directory).glob("checkpoint_*.h5") if path.stem[11:].isdigit() and path.is_file())


def newest_sound(directory):
    """The newest checkpoint that can be read, and complaints about newer ones that cannot; (None, []) if there is none.

    Returns:
        (path or None, list of messages).
    """
    complaints = []
    for path in reversed(all_checkpoints(directory)):
        try:
            read_state(path)
            return path, complaints
        except CheckpointError as error:
            complaints.append(str(error))
    return None, complaints
