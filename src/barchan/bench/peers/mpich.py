"""The MPI that pip installs, with which codes are started on several ranks."""

import importlib.metadata

from barchan.errors import SceneError
from barchan.kernels.compiler import default_threads

#: What to do where it is missing.
ADVICE = "pip install 'barchan[test]'"


def library_folder():
    """Folder of its ``libmpi``.

    Raises:
        SceneError: it is not installed.
    """
    return _file("libmpi.").parent


def on_ranks(ranks, command):
    """The command that starts ``command`` on so many ranks. Raises what ``library_folder`` does."""
    return (str(_file("mpiexec")), "-n", str(ranks), *command)


def why_not(ranks):
    """Why nothing can be run on so many ranks here; None if it can."""
    if ranks > default_threads():
        return f"this process may use {default_threads()} core(s)"
    try:
        _file("mpiexec")
    except SceneError as error:
        return str(error)
    return None


def _file(start):
    """The first file of the wheel whose name begins so."""
    try:
        files = importlib.metadata.files("mpich") or ()
    except importlib.metadata.PackageNotFoundError:
        files = ()
    for file in files:
        if file.name.startswith(start):
            return file.locate().resolve()
    raise SceneError(f"not installed: the mpich wheel is missing ({ADVICE})")
