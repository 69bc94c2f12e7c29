"""The whole state, written and read: all that the next step reads, so that a resumed run has the bits of one that never
stopped.

A checkpoint is one HDF5 file, written under another name and renamed when it is complete, with a checksum over everything in
it. It holds data only: laws and functions of time stay in the user's script, and a hash tells if they have changed.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from barchan.errors import CheckpointError
from barchan.kernels.provenance import source_hash
from barchan.neighbors.rows import ContactRows

FORMAT = 1


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
        CheckpointError: the file cannot be written (full disk, no permission).
    """
    sim.take_up_changes()
    state, failure = collect(sim), None
    if sim.comm.rank == 0:
        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            write_state(state, path)
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno else str(error).split("\n")[0]
            failure = f"checkpoint {path} cannot be written: {reason}. The one before it is untouched"
        except TypeError as error:
            failure = (
                f"checkpoint {path} cannot be written: Simulation.notes and material properties hold numbers and text: {error}"
            )
    failure = sim.comm.all_gather(failure)[0]
    if failure:
        raise CheckpointError(failure)


def write_state(state, path):
    """Write a state to a file, atomically."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with h5py.File(partial, "w") as file:
            for name, values in _datasets(state).items():
                file[name] = values
            file.attrs["about"] = json.dumps(state.about)
            file.attrs["checksum"] = _checksum(state)
            file.flush()
            os.fsync(file.id.get_vfd_handle())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def _datasets(state):
    datasets = {f"grains/{name}": values for name, values in state.fields.items()}
    return datasets | {f"contacts/{name}": values for name, values in state.contacts._asdict().items()}


def _checksum(state):
    digest = hashlib.sha256(json.dumps(state.about).encode())
    for name, values in sorted(_datasets(state).items()):
        digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def read_state(path):
    """Read a state from a file.

    Raises:
        CheckpointError: the file is missing, cut, altered, or no checkpoint of barchan.
    """
    path = Path(path)
    if not path.is_file():
        raise CheckpointError(f"checkpoint {path}: there is no such file")
    try:
        with h5py.File(path, "r") as file:
            about = json.loads(file.attrs["about"])
            fields = {name: dataset[()] for name, dataset in file["grains"].items()}
            contacts = ContactRows(*(file["contacts"][name][()] for name in ContactRows._fields))
            expected = file.attrs["checksum"]
        state = State(about, fields, contacts)
        sound = isinstance(about, dict) and _checksum(state) == expected
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError) as error:
        raise CheckpointError(
            f"checkpoint {path} cannot be read ({error}); it is cut, altered or no checkpoint of barchan. Use the one before it"
        ) from None
    if not sound:
        raise CheckpointError(f"checkpoint {path}: its checksum is wrong; it was cut or altered. Use the one before it")
    if about.get("format") != FORMAT:
        raise CheckpointError(f"checkpoint {path} has format {about.get('format')!r}; this barchan reads format {FORMAT}")
    return state


def restore(sim, path):
    """Put a state into a simulation that was built by the same script, without its grains.

    Law, materials, walls and box must be those of the script; positions of walls, gravity and all grains come from the file.

    Raises:
        CheckpointError: the file is damaged, or belongs to another scene (the message names the first difference).
    """
    state = read_state(path)
    about = state.about
    now = _about(sim)
    for what in ("law", "materials", "box"):
        if json.dumps(now[what], sort_keys=True) != json.dumps(about[what], sort_keys=True):
            raise CheckpointError(
                f"checkpoint {path} belongs to another scene: its {what} is {about[what]}, here it is {now[what]}"
            )
    there, here = ([(wall["kind"], wall["material"]) for wall in walls] for walls in (about["walls"], now["walls"]))
    if there != here:
        raise CheckpointError(
            f"checkpoint {path} has the walls (kind, material) {there}, here there are {here}; add the same "
            f"walls in the same order before restoring"
        )
    if "hash" in about["gravity"] or callable(sim.gravity):
        if about["gravity"] != now["gravity"]:
            raise CheckpointError(
                f"checkpoint {path}: gravity was {about['gravity']}, here it is {now['gravity']}; "
                f"a changed function of time cannot continue the run"
            )
    else:
        sim.gravity = tuple(about["gravity"]["value"])
    for wall, wall_state in zip(sim.walls, about["walls"]):
        wall.restore(wall_state)
    for field in about["user_fields"]:
        own = next((f for f in sim.grains.table if f.name == field["name"]), None)
        if own is None:
            sim.add_field(field["name"], field["width"], field["dtype"], field["default"], field["dimension"])
        elif (own.width, np.dtype(own.dtype).name) != (field["width"], field["dtype"]):
            raise CheckpointError(
                f"checkpoint {path}: field '{own.name}' is {field['width']} {field['dtype']} wide there, {own.width} "
                f"{np.dtype(own.dtype).name} here"
            )
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
