"""Has the source of a law or of a function of time changed since a checkpoint was written?"""

import hashlib
import inspect
import textwrap
import types

import numpy as np

from barchan.errors import SceneError


def source_hash(function):
    """Hash of the source of a function and of all functions and numbers of the user that it refers to.

    Args:
        function: a plain function, a lambda, a ``Law``, or an object that can be called.

    Raises:
        SceneError: the source cannot be read, so that a change could not be noticed.
    """
    pieces = []
    _collect(function, pieces, set())
    return hashlib.sha256("\n".join(pieces).encode()).hexdigest()


def _collect(thing, pieces, seen):
    if hasattr(thing, "properties") and hasattr(thing, "mix"):  # a law: what it declares is part of it
        pieces.append(f"{sorted(thing.properties.items())!r} {thing.history!r} {thing.lever}{' couple' * thing.couple}")
        _collect(thing.mix, pieces, seen)
        if thing.reach is not None:
            _collect(thing.reach, pieces, seen)
    plain = getattr(thing, "py_func", getattr(thing, "function", thing))
    if not isinstance(plain, types.FunctionType):
        pieces.append(f"{type(plain).__qualname__} {sorted(getattr(plain, '__dict__', {}).items())!r}")
        plain = vars(type(plain)).get("__call__")
    if not isinstance(plain, types.FunctionType) or plain in seen:
        return
    seen.add(plain)
    try:
        pieces.append(textwrap.dedent(inspect.getsource(plain)))
    except (OSError, TypeError) as error:
        raise SceneError(
            f"the source of '{plain.__qualname__}' cannot be read ({error}), so a checkpoint could not tell if it has "
            f"changed; define it in a file or a notebook cell"
        ) from None
    free = {name: cell.cell_contents for name, cell in zip(plain.__code__.co_freevars, plain.__closure__ or ())}
    for name in (*plain.__code__.co_names, *plain.__code__.co_freevars):
        value = free.get(name, plain.__globals__.get(name))
        if isinstance(value, np.ndarray):
            pieces.append(f"{name} = {value.dtype} {value.shape} {value.tobytes().hex()}")
        elif isinstance(value, (bool, int, float, str, tuple, list, dict, np.generic)):
            pieces.append(f"{name} = {value!r}")
        elif isinstance(value, types.FunctionType):
            _collect(value, pieces, seen)
