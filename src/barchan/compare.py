"""Are two states the same, bit for bit? And if not: which field, which grain, by how much."""

from pathlib import Path

import numpy as np

from barchan.checkpoint import newest_sound, read_state
from barchan.errors import CheckpointError


def last_state(path):
    """The state in a checkpoint file, or the last sound one of a run directory.

    Raises:
        CheckpointError: there is none.
    """
    path = Path(path)
    if path.is_file():
        return read_state(path)
    for directory in (path / "checkpoints", path):
        found, _ = newest_sound(directory)
        if found is not None:
            return read_state(found)
    raise CheckpointError(f"{path} holds no checkpoint; give a run directory or a checkpoint file")


def _bits(values):
    values = np.ascontiguousarray(values)
    return values.view(f"u{values.dtype.itemsize}") if values.dtype.kind == "f" else values


def _difference(name, a, b, labels):
    """One line on how two arrays differ, or None."""
    if a.shape != b.shape or a.dtype != b.dtype:
        return f"{name}: {a.dtype} {a.shape} against {b.dtype} {b.shape}"
    different = (_bits(a) != _bits(b)).reshape(len(a), -1).any(axis=1) if len(a) else np.zeros(0, dtype=bool)
    if not different.any():
        return None
    apart = np.abs(a.astype(np.float64) - b.astype(np.float64)).reshape(len(a), -1).max(axis=1)
    worst = int(np.argmax(np.where(different, np.nan_to_num(apart, nan=np.inf), -1.0)))
    return (
        f"{name}: {int(different.sum())} of {len(a)} differ; most at {labels(worst)}: {a[worst].tolist()} against "
        f"{b[worst].tolist()}, by {apart[worst]:.3g}"
    )


def differences(first, second):
    """Lines that name every difference between two states; empty if all saved bits are the same.

    Args:
        first, second: ``checkpoint.State``; grains are matched by id.
    """
    lines = []
    for name in sorted(set(first.about) | set(second.about)):
        if first.about.get(name) != second.about.get(name):
            lines.append(f"{name}: {first.about.get(name)} against {second.about.get(name)}")
    only = set(first.fields) ^ set(second.fields)
    lines += [f"field {name} is in one state only" for name in sorted(only)]
    ids = first.fields["id"]
    if not np.array_equal(ids, second.fields["id"]):
        missing = np.setxor1d(ids, second.fields["id"])
        return [*lines, f"grains: {len(ids)} against {len(second.fields['id'])}; in one state only: {missing[:5].tolist()}"]
    for name in sorted(set(first.fields) & set(second.fields)):
        lines.append(_difference(name, first.fields[name], second.fields[name], lambda row: f"grain {ids[row]}"))
    lines += _row_differences("contact", first.contacts, second.contacts, ids)
    lines += _row_differences("bond", first.bonds, second.bonds, ids)
    lines.append(_difference("cracks", first.cracks, second.cracks, lambda row: f"crack {row}"))
    return [line for line in lines if line]


def _row_differences(what, a, b, ids):
    owners_a, owners_b = (np.repeat(ids, np.diff(rows.start)) for rows in (a, b))
    pairs_a, pairs_b = (set(zip(o.tolist(), rows.keys.tolist())) for o, rows in ((owners_a, a), (owners_b, b)))
    if pairs_a != pairs_b:
        some = sorted(pairs_a ^ pairs_b)[:5]
        return [f"{what}s: {len(pairs_a)} against {len(pairs_b)} remembered; in one state only: {some}"]
    return [_difference(f"{what} memory", a.values, b.values, lambda row: f"grain {owners_a[row]} with {a.keys[row]}")]
