"""How the writers of this room put files on the disk: rank 0 writes, and what it cannot write stops all ranks."""

import os
import re
from pathlib import Path

from barchan.errors import OutputError, RankError
from barchan.parallel.guard import on_first_rank, told_as
from barchan.triggers import trigger


def write_on_first_rank(sim, path, write):
    """Call ``write()`` on rank 0; all ranks must call this.

    Args:
        path: what is written, for the message; its directory is made if it does not exist.

    Raises:
        OutputError: the operating system refused (on rank 0; a RankError that quotes it on the others).
    """
    write_together(sim, path, lambda: on_first_rank(sim.comm, write))


def write_together(sim, path, write):
    """Call ``write()`` on all ranks; what it raises, it raises on all. Takes and raises what ``write_on_first_rank`` does."""
    try:
        on_first_rank(sim.comm, lambda: Path(path).parent.mkdir(parents=True, exist_ok=True))
        write()
    except RankError as error:
        raise told_as(RankError(f"step {sim.step_number}: {path} cannot be written: {error}"), error) from None
    except FileExistsError as error:
        refusal = OutputError(
            f"step {sim.step_number}: {path} cannot be written: {Path(path).parent} is a file, not a directory. "
            f"Choose another directory"
        )
        raise told_as(refusal, error) from None
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else error
        refusal = OutputError(
            f"step {sim.step_number}: {path} cannot be written: {reason}. What was there before is untouched. Make room, or "
            f"choose a directory that can be written, then resume from the last checkpoint"
        )
        raise told_as(refusal, error) from None


class StepFiles:
    """The base of writers of one file a step, ``<kind>_<step>.<suffix>``.

    The first write removes the files of later steps: they were left by a run that was killed after its last checkpoint, and
    this run will write them again.

    Args:
        directory: where; made if it does not exist.
        due: trigger, a function of the step.
    """

    kind = suffix = None

    def __init__(self, directory, due):
        self.directory, self._is_first = Path(directory), True
        self.due = trigger(due, f"{type(self).__name__} in {directory}")

    def write(self, sim):
        """Write the present state.

        Raises:
            OutputError: the operating system refused; no part of a file is left.
            SceneError: the state has no forces yet.
        """
        content = self.collect(sim)
        path = self.directory / f"{self.kind}_{sim.step_number:012d}.{self.suffix}"

        if self._is_first:
            write_on_first_rank(sim, path, lambda: self.begin(sim.step_number))
            self._is_first = False
        write_together(sim, path, lambda: self.put(path, content, sim))

    def collect(self, sim):
        """What to write, of each rank a part; called on all ranks."""
        raise NotImplementedError

    def put(self, path, content, sim):
        """Write what ``collect`` returned to the file ``path``; called on all ranks."""
        raise NotImplementedError

    def begin(self, step):
        """Put the directory in order before the first write, which is at ``step``; called on rank 0."""
        for path in step_files(self.directory, self.kind, self.suffix):
            if step_of(path) > step:
                path.unlink()


def step_of(path):
    """The step in the name of a file that a ``StepFiles`` wrote."""
    return int(path.stem.split("_")[1])


def step_files(directory, kind, suffix):
    """Paths of the files ``<kind>_<step>.<suffix>`` in a directory, by ascending step."""
    name = re.compile(rf"{kind}_\d+\.{suffix}")
    return sorted((path for path in Path(directory).glob(f"{kind}_*") if name.fullmatch(path.name)), key=step_of)
