"""What a scene is: the parameters of an experiment, checked before anything starts, kept beside its results."""

import json
import os
from difflib import get_close_matches
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from barchan.errors import SceneError


class Scene(BaseModel):
    """Parameters of an experiment. Subclasses declare them as fields with bounds and a description."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def make(cls, values):
        """A scene from a mapping of parameters.

        Raises:
            SceneError: an unknown parameter (with the nearest known name) or a value out of range.
        """
        try:
            return cls(**values)
        except ValidationError as error:
            raise SceneError("; ".join(cls._explain(entry) for entry in error.errors())) from None

    @classmethod
    def _explain(cls, entry):
        name = ".".join(str(part) for part in entry["loc"]) or "scene"
        if entry["type"] == "extra_forbidden":
            near = get_close_matches(name, cls.model_fields, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else f"; known are: {', '.join(cls.model_fields)}"
            return f"unknown parameter '{name}'{hint}"
        known = cls.model_fields.get(name)
        meaning = f" ({known.description})" if known is not None and known.description else ""
        return f"{name} = {entry.get('input')!r}{meaning}: {entry['msg'][:1].lower()}{entry['msg'][1:]}"

    def write(self, path):
        """Write the scene to a file, atomically."""
        path = Path(path)
        partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
        partial.write_text(self.model_dump_json(indent=2) + "\n")
        os.replace(partial, path)

    @classmethod
    def read(cls, path):
        """Read a scene that ``write`` wrote.

        Raises:
            SceneError: the file is missing, no JSON, or not such a scene.
        """
        try:
            values = json.loads(Path(path).read_text())
        except (OSError, ValueError, RecursionError) as error:
            raise SceneError(f"scene {path} cannot be read: {error}") from None
        if not isinstance(values, dict):
            raise SceneError(f"scene {path} must hold a JSON object of parameters, not {type(values).__name__}")
        return cls.make(values)
