"""Named errors. Each message says what, where, its value, what is allowed and what to do."""


class BarchanError(Exception):
    """Base of every error that barchan raises on purpose; ``exit_code`` is what the command returns."""

    exit_code = 3


class SceneError(BarchanError, ValueError):
    """The scene cannot be run as it is written; nothing was started."""

    exit_code = 2


class LawError(SceneError):
    """A contact law breaks the contract of laws."""


class MaterialError(SceneError):
    """A material or a pair of materials is missing or out of range."""


class CheckpointError(SceneError):
    """A checkpoint cannot be read, is damaged, or belongs to another scene."""


class PackingError(SceneError):
    """A file of grains is missing, damaged, or of no form that can be read."""


class ResultError(SceneError):
    """A file of results (a frame, a table) is missing, damaged, or was not written by barchan."""


class RunError(BarchanError, RuntimeError):
    """A running simulation left the range in which its result means something."""


class LostGrainError(RunError):
    """A grain left the box through a face that is not periodic."""


class NotFiniteError(RunError):
    """A position, velocity or force is NaN or infinite."""


class OverlapError(RunError):
    """Two grains, or a grain and a wall, overlap by more than the scene allows."""


class OutputError(RunError):
    """Results cannot be written: full disk, no permission, or a file of another kind in their place."""


class RankError(RunError):
    """Another rank failed; the message carries its rank and its error."""


class Interrupted(BarchanError):
    """A run was asked to stop, and did after a whole step; its state is sound and can be continued."""

    exit_code = 130
