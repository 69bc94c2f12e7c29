"""Meshes from files, which are data from outside: nothing in them is believed before it is checked."""

from pathlib import Path

import numpy as np

from barchan.errors import SceneError
from barchan.words import shown

#: Length of a unit [m].
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}

#: Forms of files that are read, by the end of their names.
FORMS = (".stl", ".obj", ".ply")


def read_triangles(path, unit):
    """Vertices [length] and triangles of an STL, OBJ or PLY file. Triangles of which two corners are at one place are left out.

    Args:
        path: of the file.
        unit: of its lengths: one of ``UNITS``, in a scene in SI units, or a number, its length in those of the scene.

    Raises:
        SceneError: it cannot be read, or has no triangles; or trimesh is not installed.
    """
    path, length = Path(path), _length(unit)
    if path.suffix.lower() not in FORMS:
        raise SceneError(f"mesh '{path}': its name must end with one of {', '.join(FORMS)}")
    try:
        import trimesh
    except ImportError:
        raise SceneError("reading meshes from files needs the package trimesh: pip install 'barchan[mesh]'") from None
    try:
        with open(path, "rb") as file:
            more = {"skip_materials": True} if path.suffix.lower() == ".obj" else {}
            found = trimesh.load(file, file_type=path.suffix.lower()[1:], process=False, force="mesh", **more)
        vertices, triangles = np.array(found.vertices, dtype=np.float64), np.array(found.faces, dtype=np.int64)
    except OSError as error:
        raise SceneError(f"mesh '{path}' cannot be read: {error.strerror}") from error
    except Exception as error:  # whatever a reader stumbles over in a file from outside
        raise SceneError(f"mesh '{path}' is no {path.suffix[1:].upper()} file that can be read: {shown(str(error))}") from error
    if triangles.ndim != 2 or triangles.shape[1:] != (3,) or not len(triangles) or not np.isfinite(vertices).all():
        raise SceneError(
            f"mesh '{path}' has {len(triangles)} triangles and {len(vertices)} vertices; it must have some, all finite"
        )
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SceneError(f"mesh '{path}' has triangles of vertices that it does not have; it holds {len(vertices)}")
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    whole = (a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)
    return length * vertices, triangles[whole]


def _length(unit):
    if isinstance(unit, str) and unit in UNITS:
        return UNITS[unit]
    try:
        number = float(unit)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not 0.0 < number < np.inf:
        raise SceneError(
            f"mesh: unit = {shown(unit)} must be one of {', '.join(UNITS)}, or a number > 0: the length of the file's unit in "
            f"those of the scene. Files do not tell it"
        )
    return number
