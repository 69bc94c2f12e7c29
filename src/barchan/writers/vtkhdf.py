"""The VTKHDF layout of poly data (points, and cells made of them), as ParaView and ``vtkHDFReader`` read it."""

import h5py
import numpy as np

from barchan.errors import ResultError
from barchan.parallel.files import Array, reading_hdf5, writing_hdf5

#: Poly data came with version 2.0 of the layout.
VERSION = (2, 0)

KINDS_OF_CELLS = ("Vertices", "Lines", "Polygons", "Strips")


def write_polydata(comm, path, points, cells, data):
    """Write poly data of one time to a file, of which each rank gives a part.

    Everything is written in the precision of the state: neighbours overlap by a millionth of the box, which single
    precision would blur.

    Args:
        points: (n, 3) of this rank [length].
        cells: kind of cell -> (k, points of a cell) numbers of points of this rank; all kinds but one are usually missing.
        data: "PointData", "CellData", "FieldData" -> name -> array; "FieldData" is the same on all ranks.

    Raises:
        OSError: the operating system refuses.
    """
    columns = {"Points": np.asarray(points, dtype=np.float64)}
    counts = {"NumberOfPoints": len(points)}
    for kind in KINDS_OF_CELLS:
        numbers = cells.get(kind, np.zeros((0, 1), dtype=np.int64))
        ends = (comm.before([len(numbers)])[0] + np.arange(len(numbers) + 1)) * numbers.shape[1]
        columns[f"{kind}/Offsets"] = ends if comm.rank == 0 else ends[1:]
        columns[f"{kind}/Connectivity"] = (comm.before([len(points)])[0] + numbers).ravel()
        counts |= {f"{kind}/NumberOfCells": len(numbers), f"{kind}/NumberOfConnectivityIds": numbers.size}
    for group in ("PointData", "CellData"):
        columns |= {f"{group}/{name}": _writable(values) for name, values in data.get(group, {}).items()}
    columns |= {name: np.array([count])[: comm.rank == 0] for name, count in zip(counts, comm.sum([*counts.values()]).tolist())}
    columns |= {f"FieldData/{name}": values[: len(values) * (comm.rank == 0)] for name, values in data["FieldData"].items()}
    lengths = [len(values) for values in columns.values()]
    begins, totals = comm.before(lengths).tolist(), comm.sum(lengths).tolist()
    arrays = {
        f"VTKHDF/{name}": Array(values.dtype, (total, *values.shape[1:]))
        for (name, values), total in zip(columns.items(), totals)
    }
    kind = np.array(b"PolyData", dtype=h5py.string_dtype("ascii", len("PolyData")))
    with writing_hdf5(comm, path, arrays, {"VTKHDF": {"Version": VERSION, "Type": kind}}) as file:
        for (name, values), begin in zip(columns.items(), begins):
            file.put(f"VTKHDF/{name}", begin, values)


def _writable(values):
    """An array in a type that VTK has: booleans as bytes, unusual floating-point numbers as doubles."""
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    return values.astype(np.float64) if values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8) else values


def read_polydata(path, names=("PointData", "CellData", "FieldData")):
    """Points and data arrays of a file that ``write_polydata`` filled.

    Args:
        names: which groups of data to read; points come with "PointData".

    Returns:
        Group -> name -> array; the points as ``["PointData"]["position"]``.

    Raises:
        ResultError: the file is missing, cut, altered, or no such file.
    """
    try:
        with reading_hdf5(path) as file:
            root = file["VTKHDF"]
            if root.attrs["Type"] != b"PolyData":
                raise ValueError(f"its VTKHDF type is {root.attrs['Type']!r}, not PolyData")
            data = {group: {name: dataset[()] for name, dataset in root.get(group, {}).items()} for group in names}
            if "PointData" in data:
                data["PointData"]["position"] = root["Points"][()]
        if any(values.dtype.kind not in "iuf" for arrays in data.values() for values in arrays.values()):
            raise ValueError("it holds something else than numbers")
    except FileNotFoundError:
        raise ResultError(f"frame {path}: there is no such file") from None
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError) as error:
        raise ResultError(
            f"frame {path} cannot be read ({_brief(error)}); it is cut, altered or no frame of barchan. Remove it; "
            f"the run writes it again when it is resumed from an earlier checkpoint"
        ) from None
    return data


def _brief(error):
    return (str(error) or type(error).__name__).splitlines()[0]
