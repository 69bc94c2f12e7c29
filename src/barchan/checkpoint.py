"""The whole state, written and read: all that the next step reads, so that a resumed run has the bits of one that never
stopped.

A checkpoint is one HDF5 file, written under another name and renamed when it is complete, with a checksum over everything in
it. It holds data only: laws and functions of time stay in the user's script, and a hash tells if they have changed.
"""

import json
import os
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from barchan import soundness
from barchan.actions.change import make_again
from barchan.errors import CheckpointError, SceneError
from barchan.forces import Damping
from barchan.kernels.provenance import source_hash
from barchan.neighbors.rows import ContactRows
from barchan.parallel import Serial, files
from barchan.parallel.files import Array
from barchan.parallel.guard import on_first_rank, raise_together
from barchan.parallel.regroup import ById
from barchan.writers.output import write_together

FORMAT = 9

#: Groups of what belongs to grains, as rows of theirs.
_ROWS = ("contacts", "bonds")

#: Grains for each rank, about, that are on the way to a file at a time.
AT_A_TIME = 200_000


class State(NamedTuple):
    """A state as plain data, grains in ascending order of id: all of them, or a rank's part.

    ``about``: JSON-able facts (step, time, walls, ...). ``fields``: name -> array. ``contacts``: of each grain with grains of
    larger id and with walls, by ascending key. ``bonds``: of each grain with grains of larger id, in the same way. ``cracks``:
    (k, columns of ``bonds.cracks``), those that this rank has.
    """

    about: dict
    fields: dict
    contacts: ContactRows
    bonds: ContactRows
    cracks: np.ndarray


def collect(sim):
    """The state of all ranks, on every rank. Reads, and changes nothing."""
    grains = sim.grains
    fields = {field.name: grains.view(field.name) for field in grains.saved_fields()}
    remembered = _remembered(sim, np.arange(grains.n))
    bonds, cracks = sim.bonds.rows(fields["id"], sim.comm.rank), sim.bonds.cracks.in_order(sim.comm, sim.next_id)[0]
    parts = sim.comm.all_gather(({name: values.copy() for name, values in fields.items()}, remembered, bonds, cracks))
    parts, *rows, cracks = zip(*parts)
    fields = {name: np.concatenate([fields[name] for fields in parts]) for name in fields}
    order = np.argsort(fields["id"], kind="stable")
    rows = (ContactRows.join(of_ranks).take(order) for of_ranks in rows)
    return State(_about(sim), {name: values[order] for name, values in fields.items()}, *rows, np.concatenate(cracks))


def _remembered(sim, some):
    """What some of this rank's grains remember, of a pair the one with the smaller id.

    Args:
        some: their rows, ascending.
    """
    if not sim.is_listed:
        return sim.put_away_rows.take(some)
    wanted = np.zeros(sim.grains.n, dtype=bool)
    wanted[some] = True
    return sim.contacts.detach(wanted, on_both=False).of(some)


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
        "large_overlaps": int(sim.comm.sum([sim.faults.large_overlaps])[0]),
        "notes": sim.notes,
        "gravity": gravity,
        "damping": {name: float(value) for name, value in sim.damping._asdict().items()},
        "law": _about_law(sim.law),
        "bonds": {
            "law": _about_law(sim.bonds.law) if sim.bonds.law else None,
            "kinds": [{"name": kind.name, **kind.given} for kind in sim.bonds.kinds],
            "active": sim.bonds.active,
        },
        "materials": sim.materials.describe(),
        "walls": [wall.state() for wall in sim.walls],
        "loads": sim.loads.state(),
        "shape": sim.shape.name,
        "box": {
            "dimension": sim.box.dimension,
            "low": sim.box.first[0].tolist(),
            "high": sim.box.first[1].tolist(),
            "periodic": list(sim.box.periodic),
        },
        "stretched": {**sim.box.state(), "servos": sim.deformation.state(sim)},
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


def _about_law(law):
    return {"name": law.name, "hash": source_hash(law), "history": law.history}


def save(sim, path):
    """Write the state of ``sim`` to the file ``path``; an older file of that name stays whole until the new one is. Each rank
    writes a part; the file is the same for any number of them.

    Raises:
        OutputError: the file cannot be written (full disk, no permission).
        SceneError: ``Simulation.notes`` holds something else than numbers and text.
    """
    sim.take_up_changes()
    about = _about(sim)
    try:
        text = json.dumps(about)
    except TypeError as error:
        raise SceneError(f"checkpoint {path}: Simulation.notes and material properties hold numbers and text: {error}") from None
    write_together(sim, path, lambda: _write(sim, path, text))


def _write(sim, path, about):
    comm, grains = sim.comm, sim.grains
    remembered = sim.contacts.count_remembered() if sim.is_listed else len(sim.put_away_rows.keys)
    total, *counts = comm.sum([grains.n, remembered, sim.bonds.n_counted(comm.rank)]).tolist()
    cracks, before, n_cracks = sim.bonds.cracks.in_order(comm, sim.next_id)
    fields = grains.saved_fields()
    arrays = {f"grains/{f.name}": Array(np.dtype(f.dtype), (total, f.width)[: 1 + (f.width > 1)]) for f in fields}
    for name, count, width in zip(_ROWS, counts, (sim.law.history_width, 2 + sim.bonds.width)):
        arrays[f"{name}/start"] = Array(np.dtype(np.int64), (total + 1,))
        arrays[f"{name}/keys"] = Array(np.dtype(np.int64), (count,))
        arrays[f"{name}/values"] = Array(np.dtype(np.float64), (count, width))
    arrays["cracks/values"] = Array(np.dtype(np.float64), (n_cracks, cracks.shape[1]))
    with files.writing_hdf5(comm, path, arrays, {"/": {"about": about}}) as file:
        if comm.rank == 0:
            for name in _ROWS:
                file.put(f"{name}/start", 0, np.zeros(1, dtype=np.int64))
        file.put("cracks/values", before, cracks)
        _put_all(sim, file, fields, ceil(total / (AT_A_TIME * comm.size)))


def _put_all(sim, file, fields, slabs):
    """Put grains and contacts into the file in the order of ids, so many slabs one after another: what is on the way takes no
    more memory than a slab does."""
    comm, ids, begin, first = sim.comm, sim.grains.view("id"), 0, dict.fromkeys(_ROWS, 0)
    ends = [sim.next_id * slab // max(slabs, 1) for slab in range(slabs + 1)]
    for low, high in pairwise(ends):
        some = np.flatnonzero((ids >= low) & (ids < high))
        parts = ById(comm, ids[some], low, high)
        for name, known in zip(_ROWS, (_remembered(sim, some), sim.bonds.rows(ids[some], comm.rank))):
            rows = parts.bring_rows(known)
            before = first[name] + int(comm.before([len(rows.keys)])[0])
            file.put(f"{name}/start", begin + parts.begin + 1, before + rows.start[1:])
            file.put(f"{name}/keys", before, rows.keys)
            file.put(f"{name}/values", before, rows.values)
            first[name] += int(comm.sum([len(rows.keys)])[0])
        for field in fields:
            file.put(f"grains/{field.name}", begin + parts.begin, parts.bring(sim.grains.view(field.name)[some]))
        begin += parts.total


def read_state(path, comm=None):
    """Read a state from a file: all of it, or of several ranks each its part. Its structure is sound; its values may be those of
    a run that failed.

    Raises:
        CheckpointError: the file is missing, cut, altered, or no checkpoint of barchan; on all ranks alike.
    """
    path, comm = Path(path), comm or Serial()
    if not path.is_file():
        raise CheckpointError(f"checkpoint {path}: there is no such file")
    state = fault = None
    try:
        files.check(comm, path)
        state = _read(path, comm.rank, comm.size)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError) as error:
        fault = " ".join(str(error).split())[:300]
    told = comm.all_gather((fault, state.fields["id"][[0, -1]].tolist() if state and len(state.fields["id"]) else None))
    fault = next((fault for fault, _ in told if fault), None)
    ends = [ids for _, ids in told if ids]
    if not fault and any(a[1] >= b[0] for a, b in pairwise(ends)):
        fault = "ids do not ascend"
    if fault:
        raise CheckpointError(_broken(path, fault))
    return state


def _broken(path, reason):
    return f"checkpoint {path}: {reason}; it is cut, altered or no checkpoint of barchan. Use the one before it"


def _read(path, rank, size):
    """A rank's part: as many grains as each other has."""
    with h5py.File(path, "r") as file:
        about = json.loads(file.attrs["about"])
        fields, *tables, cracks = (_arrays(file, name, path.stat().st_size) for name in ("grains", *_ROWS, "cracks"))
        begin, end = (k * (tables[0]["start"].size - 1) // size for k in (rank, rank + 1))
        contacts, bonds = (_part_of(rows, begin, end) for rows in tables)
        cracks = cracks["values"][slice(*(k * len(cracks["values"]) // size for k in (rank, rank + 1)))]
        if rank == size - 1:
            end = None  # it sees if there are more than there should be
        fields = {name: array[begin:end] if array.ndim else array[()] for name, array in fields.items()}
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise ValueError(f"it has another format than {FORMAT}, which this version of barchan reads")
    state = State(about, fields, contacts, bonds, cracks)
    fault = soundness.structure_fault(state)
    if fault:
        raise ValueError(fault)
    return state


def _part_of(rows, begin, end):
    """``ContactRows`` of grains ``begin`` to ``end`` of a group."""
    start, ends = rows["start"][begin : end + 1], np.array([rows["start"][0], rows["start"][-1]])
    fault = soundness.order_fault(start - start[0], start[-1] - start[0]) or soundness.order_fault(ends, len(rows["keys"]))
    if fault or start[0] < 0:
        raise ValueError(fault)
    return ContactRows(start - start[0], *(rows[name][start[0] : start[-1]] for name in ("keys", "values")))


def _arrays(file, name, most):
    """The arrays of a group, if they lie in the file as they were written: plain numbers, whole, and no more than it holds."""
    group = _inside(file, name, h5py.Group)
    datasets = {key: _inside(group, key, h5py.Dataset) for key in group}
    for key, dataset in datasets.items():
        elsewhere = dataset.shape is None or dataset.chunks or dataset.is_virtual or dataset.external
        if elsewhere or dataset.dtype.kind not in "biufc" or dataset.nbytes > most:
            raise ValueError(f"'{name}/{key}' is not stored as barchan stores it")
    return datasets


def _inside(group, name, kind):
    """A member of a group that is no link to elsewhere."""
    if not isinstance(group.get(name, getlink=True), h5py.HardLink) or not isinstance(group[name], kind):
        raise ValueError(f"'{name}' is missing or of another kind")
    return group[name]


def restore(sim, path):
    """Put a state into a simulation that was built by the same script, without its grains.

    Law, materials, walls and box must be those of the script, once what each ``barchan.actions.Change`` had changed by then is
    changed again; positions of walls, gravity, damping and all grains come from the file.

    Raises:
        CheckpointError: the file is damaged, or belongs to another scene (the message names the first difference).
    """
    state = read_state(path, sim.comm)
    make_again(sim, state.about["notes"])
    about, now = state.about, json.loads(json.dumps(_about(sim)))
    difference = soundness.foreign(about, now)
    if difference:
        raise CheckpointError(f"checkpoint {path} belongs to another scene: {difference}")
    fault = soundness.value_fault(state, now["walls"])  # of this rank's part
    raise_together(sim.comm, CheckpointError(_broken(path, fault)) if fault else None)
    if not callable(sim.gravity):
        sim.gravity = tuple(about["gravity"]["value"])
    sim.damping = Damping(**about["damping"])
    sim.box.restore(about["stretched"])
    sim.deformation.restore(sim, about["stretched"]["servos"])
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
        on_first_rank(sim.comm, self._forget_old)

    def _forget_old(self):
        for old in all_checkpoints(self.directory)[: -self.keep]:
            old.unlink(missing_ok=True)

    def _make_room(self, sim):
        """Refuse a directory that holds later steps of another run; put damaged ones aside."""
        later = [p for p in all_checkpoints(self.directory) if int(p.stem.split("_")[1]) > sim.step_number]
        for path in sim.comm.from_first(later):
            try:
                read_state(path, sim.comm)
            except CheckpointError:
                on_first_rank(sim.comm, lambda path=path: os.replace(path, path.with_suffix(".damaged")))
                continue
            raise CheckpointError(
                f"{self.directory} holds checkpoints of another run, up to {later[-1].name}, and this one is at step "
                f"{sim.step_number}. Restore them, or choose another directory"
            )


def all_checkpoints(directory):
    """Checkpoints in a directory, oldest first."""
    return sorted(path for path in Path(directory).glob("checkpoint_*.h5") if path.stem[11:].isdigit() and path.is_file())


def newest_sound(directory, comm=None):
    """The newest checkpoint that can be read, and complaints about newer ones that cannot; (None, []) if there is none.

    Returns:
        (path or None, list of messages).
    """
    complaints, comm = [], comm or Serial()
    for path in comm.from_first(all_checkpoints(directory)[::-1]):
        try:
            read_state(path, comm)
            return path, complaints
        except CheckpointError as error:
            complaints.append(str(error))
    return None, complaints
