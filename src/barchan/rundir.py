"""A run's directory: its scene, its checkpoints, and the lock that keeps two runs from writing into one."""

import fcntl
from pathlib import Path

from barchan.checkpoint import newest_sound, restore
from barchan.errors import SceneError


class RunDirectory:
    """The directory of one run.

    The scene is written before anything else, so that a run that was killed before its first checkpoint can still resume.

    Args:
        path: made if it does not exist.

    Raises:
        SceneError: the directory cannot be written, or another run is using it.
    """

    def __init__(self, path):
        self.path = Path(path)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.path / ".lock", "w")
        except OSError as error:
            raise SceneError(f"run directory {self.path} cannot be written: {error}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SceneError(f"run directory {self.path} is in use by another run; wait for it or choose another --out") from None
        for unfinished in (*self.path.glob(".*.partial"), *self.checkpoints.glob(".*.partial")):
            unfinished.unlink(missing_ok=True)  # left by a run that was killed while it wrote

    @property
    def scene_file(self):
        """Where the scene is kept."""
        return self.path / "scene.json"

    @property
    def checkpoints(self):
        """Where the checkpoints are kept."""
        return self.path / "checkpoints"

    def claim(self, scene):
        """Write the scene, or find the same one there.

        Raises:
            SceneError: the directory holds another scene.
        """
        if self.scene_file.exists():
            there = type(scene).read(self.scene_file)
            if there != scene:
                changed = [n for n in type(scene).model_fields if getattr(there, n) != getattr(scene, n)]
                raise SceneError(
                    f"run directory {self.path} holds another scene (it differs in {', '.join(changed)}). "
                    f"Use --resume {self.path} to continue that one, or choose another --out"
                )
            return
        try:
            scene.write(self.scene_file)
        except OSError as error:
            raise SceneError(f"run directory {self.path} cannot be written: {error}") from None

    def resume(self, sim):
        """Restore the newest sound checkpoint into ``sim``.

        Returns:
            (True if there was one, complaints about damaged ones).
        """
        path, complaints = newest_sound(self.checkpoints)
        if path is not None:
            restore(sim, path)
        return path is not None, complaints

    def release(self):
        """Give the directory free."""
        fcntl.flock(self._lock, fcntl.LOCK_UN)
        self._lock.close()
