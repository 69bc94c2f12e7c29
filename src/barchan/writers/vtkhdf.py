"""The VTKHDF layout of poly data (points, and cells made of them), as ParaView and ``vtkHDFReader`` read it."""

import h5py
import numpy as np

from barchan.atomic import reading_hdf5
from barchan.errors import ResultError

#: Poly data came with version 2.0 of the layout.
VERSION = (2, 0)

#: Integers (ids, connectivity) shrink to nothing; doubles hardly do. Measured on 120,000 grains: 18.4 -> 14.0 MB in 20 ms; with
#: all arrays 12.7 MB in 180 ms. Every HDF5 has gzip.
SQUEEZED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}

KINDS_OF_CELLS = ("Vertices", "Lines", "Polygons", "Strips")


def write_polydata(file, points, cells, data):
    """Write poly data of one time into an open HDF5 file.

    Everything is written in the precision of the state: neighbours overlap by a millionth of the box, which single
    precision would blur.

    Args:
        points: (n, 3) [length].
        cells: kind of cell -> (k, points of a cell) numbers of points; all kinds but one are usually missing.
        data: "PointData", "CellData", "FieldData" -> name -> array.
    """
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = VERSION
    root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", len("PolyData")))
    root["NumberOfPoints"] = np.array([len(points)])
    root["Points"] = np.asarray(points, dtype=np.float64)
    for kind in KINDS_OF_CELLS:
        connectivity = cells.get(kind, np.zeros((0, 1), dtype=np.int64))
        group = root.create_group(kind)
        group["NumberOfCells"] = np.array([len(connectivity)])
        group["NumberOfConnectivityIds"] = np.array([connectivity.size])
        _put(group, "Offsets", np.arange(len(connectivity) + 1) * connectivity.shape[1])
        _put(group, "Connectivity", connectivity.ravel())
    for group, arrays in data.items():
        for name, values in arrays.items():
            _put(root, f"{group}/{name}", values)


def _put(group, name, values):
    """Write an array in a type that VTK has: booleans as bytes, unusual floating-point numbers as doubles."""
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    elif values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8):
        values = values.astype(np.float64)
    group.create_dataset(name, data=values, **(SQUEEZED if values.dtype.kind in "iu" else {}))


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
