"""Grains, contacts and meshes as time series for ParaView: one VTKHDF file a step, and a series file that lists them.

Open ``grains.vtkhdf.series``, ``contacts.vtkhdf.series`` or ``meshes.vtkhdf.series``. A frame is written under another name and
renamed, the series anew after each frame: whenever a run is killed, what the series lists is there and whole.
"""

import json
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from barchan.atomic import writing
from barchan.errors import ResultError
from barchan.parallel.guard import on_first_rank
from barchan.writers.collect import FIELDS, contact_lines, grains_at_full_step, mesh_triangles
from barchan.writers.output import StepFiles, step_files, step_of
from barchan.writers.vtkhdf import read_polydata, write_polydata

#: Field data of every frame, and their kinds of number.
_NOW = {"step": "i", "time": "f"}


class FrameFile(NamedTuple):
    """A frame in a directory; ``time`` [time]."""

    step: int
    time: float
    path: Path


class GrainFrame(NamedTuple):
    """Grains at one step, as read: ``fields`` is field name -> array, in ascending order of id; ``time`` [time]."""

    step: int
    time: float
    fields: dict


class _Frames(StepFiles):
    """VTKHDF files of one kind and their series."""

    suffix = "vtkhdf"

    def __init__(self, directory, due):
        super().__init__(directory, due)
        self._times = {}

    def begin(self, step):
        """Find the times of earlier frames; let the series forget the later ones before they go."""
        for path in step_files(self.directory, self.kind, self.suffix):
            if step_of(path) < step:
                try:
                    self._times[path.name] = _step_and_time(path)[1]
                except ResultError as error:
                    warnings.warn(f"{error}. It is left out of the series", stacklevel=2)
        self._write_series()
        super().begin(step)

    def put(self, path, content, sim):
        """Write the frame, then the series that lists it."""
        points, cells, data = content
        now = {"step": np.array([sim.step_number]), "time": np.array([sim.time])}
        write_polydata(sim.comm, path, points, cells, data | {"FieldData": now})
        self._times[path.name] = sim.time
        on_first_rank(sim.comm, self._write_series)

    def _write_series(self):
        files = [{"name": name, "time": time} for name, time in sorted(self._times.items()) if (self.directory / name).is_file()]
        with writing(self.directory / f"{self.kind}.{self.suffix}.series") as partial:
            partial.write_text(json.dumps({"file-series-version": "1.0", "files": files}, indent=1) + "\n")


class GrainFrames(_Frames):
    """A writer: grains as points, ``grains_<step>.vtkhdf``, one file a step, and ``grains.vtkhdf.series``.

    Grains are in ascending order of id. Point data: id, radius [length], mass [mass], velocity [length/time] and omega
    [1/time], both at the full step n, force [force], material (number), frozen, image, and all fields of the user's own.

    Args:
        directory: where; made if it does not exist.
        due: trigger, a function of the step.
    """

    kind = "grains"

    def collect(self, sim):
        """All grains, one vertex each."""
        fields = grains_at_full_step(sim)
        points = fields.pop("position")
        return points, {"Vertices": np.arange(len(points))[:, None]}, {"PointData": fields}


class ContactFrames(_Frames):
    """A writer: contacts that touch as lines, ``contacts_<step>.vtkhdf``, one file a step, and ``contacts.vtkhdf.series``.

    A line goes from the centre of the first grain to the centre of the second, or to the wall. Cell data: force on the first
    [force], normal_force (positive: they push) [force], overlap [length], first and second (ids; the negative key of a wall).

    Args:
        directory: where; made if it does not exist.
        due: trigger, a function of the step.
    """

    kind = "contacts"

    def collect(self, sim):
        """All contacts, two points each."""
        ends, cells = contact_lines(sim)
        return ends.reshape(-1, 3), {"Lines": np.arange(2 * len(ends)).reshape(-1, 2)}, {"CellData": cells}


class MeshFrames(_Frames):
    """A writer: the meshes of the scene as triangles, ``meshes_<step>.vtkhdf``, one file a step, and ``meshes.vtkhdf.series``.

    Cell data: wall (number of the mesh in the scene), triangle (number in the mesh), force of the grains on it [force], torque
    about the point of its mesh [force length], and stress, force over area [force/length^2].

    Args:
        directory: where; made if it does not exist.
        due: trigger, a function of the step.
    """

    kind = "meshes"

    def collect(self, sim):
        """All triangles of all meshes; rank 0 writes them."""
        corners, cells = mesh_triangles(sim)
        if sim.comm.rank > 0:
            corners, cells = corners[:0], {name: column[:0] for name, column in cells.items()}
        return corners.reshape(-1, 3), {"Polygons": np.arange(3 * len(corners)).reshape(-1, 3)}, {"CellData": cells}


def frames(directory, kind):
    """Frames in a directory, by ascending step.

    Args:
        kind: "grains", "contacts" or "meshes".

    Returns:
        A list of ``FrameFile``: (step, time, path).

    Raises:
        ResultError: one of them is damaged, or was not written by barchan.
    """
    return [FrameFile(*_step_and_time(path), path) for path in step_files(directory, kind, _Frames.suffix)]


def read_grain_frame(path):
    """Grains as ``GrainFrames`` wrote them, to the last bit.

    Returns:
        A ``GrainFrame``: step, time, and the fields, with ``position`` (grains, 3) among them.

    Raises:
        ResultError: the file is missing, damaged, or was not written by ``GrainFrames``.
    """
    step, time = _step_and_time(path)
    fields = read_polydata(path, ["PointData"])["PointData"]
    missing = {*FIELDS, "velocity", "omega"} - set(fields)
    if missing:
        raise ResultError(f"frame {path} holds no {', '.join(sorted(missing))}; it was not written by GrainFrames")
    uneven = [name for name, values in fields.items() if values.shape[:1] != fields["id"].shape]
    if uneven:
        raise ResultError(f"frame {path} has {len(fields['id'])} grains, but not as many of {', '.join(uneven)}; it is damaged")
    return GrainFrame(step, time, fields)


def _step_and_time(path):
    now = read_polydata(path, ["FieldData"])["FieldData"]
    if not all(name in now and now[name].shape == (1,) and now[name].dtype.kind == kind for name, kind in _NOW.items()):
        raise ResultError(f"frame {path} does not tell its step and time; it was not written by barchan")
    return int(now["step"][0]), float(now["time"][0])
