"""A run's directory: its scene, its checkpoints, and the lock that keeps two runs from writing into one."""

import fcntl
from pathlib import Path

from barchan.checkpoint import all_checkpoints, newest_sound, restore
from barchan.errors import SceneError
from barchan.parallel import world
from barchan.parallel.guard import on_first_rank
from barchan.scene import read_scene_file, write_scene_file


class RunDirectory:
    """The directory of one run; of several ranks the first looks after it, and all must call.

    The scene is written before anything else, so that a run that was killed before its first checkpoint can still resume.

    Args:
        path: made if it does not exist.

    Raises:
        SceneError: the directory cannot be written, or another run is using it.
    """

    def __init__(self, path, comm=None):
        self.path, self.comm, self._lock = Path(path), comm or world(), None
        on_first_rank(self.comm, self._open)

    def _open(self):
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.path / ".lock", "w")
        except OSError as error:
            raise SceneError(f"run directory {self.path} cannot be written: {error}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SceneError(f"run directory {self.path} is in use by another run; wait for it or choose another --out") from None

    def sweep(self):
        """Remove unfinished files, which a run leaves that is killed while it writes. Only where this directory holds a run."""
        on_first_rank(self.comm, self._sweep)

    def _sweep(self):
        for place in (self.path, *(self.path / name for name in ("checkpoints", "tables", "frames", "figures"))):
            for unfinished in place.glob(".*.partial"):
                unfinished.unlink(missing_ok=True)

    @property
    def scene_file(self):
        """Where the scene is kept."""
        return self.path / "scene.toml"

    @property
    def checkpoints(self):
        """Where the checkpoints are kept."""
        return self.path / "checkpoints"

    @property
    def record(self):
        """Where the record of how the run went is kept."""
        return self.path / "record.json"

    @property
    def has_checkpoints(self):
        """True if a run has got somewhere in here."""
        return on_first_rank(self.comm, lambda: bool(all_checkpoints(self.checkpoints)))

    @property
    def is_foreign(self):
        """True if there are files in here, but no scene."""
        return on_first_rank(
            self.comm, lambda: not self.scene_file.exists() and any(entry.name != ".lock" for entry in self.path.iterdir())
        )

    def claim(self, experiment, scene, ran_with):
        """Write the scene, or find the same one there.

        Args:
            experiment: its name.
            scene: its ``Scene``.
            ran_with: versions: name -> text or number.

        Raises:
            SceneError: the directory holds another scene, or cannot be written.
        """
        on_first_rank(self.comm, lambda: self._claim(experiment, scene, ran_with))

    def _claim(self, experiment, scene, ran_with):
        if self.scene_file.exists():
            _, there = read_scene_file(self.scene_file, {experiment: type(scene)})
            if there != scene:
                raise SceneError(
                    f"run directory {self.path} holds another scene: {'; '.join(there.differences(scene))}. "
                    f"Use --resume {self.path} to continue that one, or choose another --out"
                )
        else:
            self._rewrite(experiment, scene, ran_with)

    def rewrite(self, experiment, scene, ran_with):
        """Write the scene, over the one that is there. Takes and raises what ``claim`` does."""
        on_first_rank(self.comm, lambda: self._rewrite(experiment, scene, ran_with))

    def _rewrite(self, experiment, scene, ran_with):
        try:
            write_scene_file(self.scene_file, experiment, scene, ran_with)
        except OSError as error:
            raise SceneError(f"run directory {self.path} cannot be written: {error}") from None

    def resume(self, sim):
        """Restore the newest sound checkpoint into ``sim``.

        Returns:
            (True if there was one, complaints about damaged ones).
        """
        path, complaints = newest_sound(self.checkpoints, self.comm)
        if path is not None:
            restore(sim, path)
        return path is not None, complaints

    def release(self):
        """Give the directory free."""
        if self._lock:
            fcntl.flock(self._lock, fcntl.LOCK_UN)
            self._lock.close()
