"""A packing: places and sizes of grains, as files hand them on."""

from typing import NamedTuple

import numpy as np

from barchan.domain import Box
from barchan.packing.lines import whole, wrong


class Packing(NamedTuple):
    """Grains of a file, in ascending order of their ids if it has any, else as they stand there.

    ``position`` (n, 3) and ``radius`` (n,) [length]; ``material`` (n,): numbers from 0; ``velocity`` (n, 3) [length/time], as
    the file gives it, 0 if it does not; ``box``: a ``Box`` or None.
    """

    position: np.ndarray
    radius: np.ndarray
    material: np.ndarray
    velocity: np.ndarray
    box: Box | None


def packing_of(path, lines, columns, box):
    """The packing that columns make.

    Args:
        path: of the file, for messages.
        lines: (n,) number of the line of each grain.
        columns: name -> (n,) doubles: ``x y z``, ``radius`` or ``diameter``, perhaps ``id``, ``material`` (from 0) or ``type``
            (from 1), and ``vx vy vz``; others are left alone.

    Raises:
        PackingError: a radius is not above 0, a number of a material is none, or two grains have one id.
    """
    lines, count = np.asarray(lines, dtype=np.int64), len(lines)
    radius = columns["radius"] if "radius" in columns else 0.5 * columns["diameter"]
    bad = np.flatnonzero(radius <= 0.0)
    if len(bad):
        raise wrong(path, lines[bad[0]], f"radius = {radius[bad[0]]:g} [length] must be above 0")
    if "type" in columns:
        material = whole(path, lines, columns["type"], "type", 1) - 1
    else:
        material = whole(path, lines, columns.get("material", np.zeros(count)), "material", 0)
    order = order_of(path, lines, columns["id"]) if "id" in columns else np.arange(count)
    position, velocity = (
        np.stack([columns.get(name, np.zeros(count)) for name in names], axis=1)
        for names in (("x", "y", "z"), ("vx", "vy", "vz"))
    )
    return Packing(position[order], radius[order], material[order], velocity[order], box)


def order_of(path, lines, ids):
    """Rows in ascending order of their ids.

    Args:
        lines: (n,) number of the line of each row.
        ids: (n,) doubles.

    Raises:
        PackingError: an id is no whole number, or there twice.
    """
    ids = whole(path, lines, ids, "id", 0)
    order = np.argsort(ids, kind="stable")
    twice = np.flatnonzero(np.diff(ids[order]) == 0)
    if len(twice):
        first, second = order[twice[0]], order[twice[0] + 1]
        raise wrong(path, lines[second], f"id {ids[second]} is that of the grain in line {lines[first]}, too")
    return order


def box_of(path, line, low, high, periodic=(False, False, False)):
    """The box of a file.

    Raises:
        PackingError: a high corner does not exceed the low one.
    """
    if not (np.asarray(high) > low).all():
        raise wrong(path, line, f"the box from {list(map(float, low))} to {list(map(float, high))} [length] has no volume")
    return Box(low, high, periodic)


def check_names(path, line, names):
    """Refuse columns that do not make a packing.

    Raises:
        PackingError: naming what is missing, or there twice.
    """
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    both = [pair for pair in (("radius", "diameter"), ("type", "material")) if set(pair) <= set(names)]
    missing = [name for name in "xyz" if name not in names]
    if not {"radius", "diameter"} & set(names):
        missing.append("radius (or diameter)")
    some = {"vx", "vy", "vz"} & set(names)
    missing += [name for name in ("vx", "vy", "vz") if some and name not in names]
    if twice or both:
        raise wrong(path, line, f"columns {' and '.join(twice or both[0])} cannot be there {'twice' if twice else 'together'}")
    if missing:
        raise wrong(path, line, f"no column {', '.join(missing)}; there are: {', '.join(names)}")
