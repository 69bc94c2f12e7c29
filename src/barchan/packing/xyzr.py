"""Spheres as YADE writes them as text, one a line: ``yade.export.text``, ``textExt`` and ``SpherePack.save``."""

from barchan.errors import PackingError
from barchan.packing.lines import read_lines, table, wrong
from barchan.packing.packing import box_of, packing_of

#: What a line ``#format ...`` may say: columns of each row. YADE counts materials from 0.
_FORMATS = {"x_y_z_r": ("x", "y", "z", "radius"), "x_y_z_r_matId": ("x", "y", "z", "radius", "material")}


def read_xyzr(path):
    """Read lines ``x y z r``. ``#`` begins a comment; ``#format x_y_z_r_matId`` a fifth column, the number of the material;
    ``##PERIODIC:: a b c`` is a periodic box of these edges from the origin on.

    Returns:
        A ``Packing``.

    Raises:
        PackingError: the file is no such file, or damaged.
    """
    names, box, rows = _FORMATS["x_y_z_r"], None, []
    for number, line in enumerate(read_lines(path), 1):
        words = line.partition("#")[0].split()
        remark = line.split() if line.startswith("#") else [""]
        if words:
            rows.append((number, words))
        elif remark[0] == "#format":
            names = _FORMATS.get(" ".join(remark[1:]))
        elif remark[0] == "##PERIODIC::":
            box = box_of(path, number, (0.0, 0.0, 0.0), table(path, [(number, remark[1:])], (3,))[0], (True, True, True))
        if names is None:
            raise wrong(path, number, f"format {' '.join(remark[1:])} cannot be read; these can: {', '.join(_FORMATS)}")
    if not rows:
        raise PackingError(f"packing {path} holds no grains; there must be lines 'x y z r'")
    columns = dict(zip(names, table(path, rows, (len(names),)).T))
    return packing_of(path, [number for number, _ in rows], columns, box)
