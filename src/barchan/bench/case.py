"""What is simulated in a benchmark, told to every code in the same words. Plain NumPy: drivers of other codes read it too."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np


class Grains(NamedTuple):
    """The grains at the start.

    Attributes:
        position: (n, 3) [length].
        radius, density: (n,) [length], [mass/length^3].
        velocity, omega: (n, 3), at the full step [length/time], [1/time].
        frozen: (n,) bool: immobile.
    """

    position: np.ndarray
    radius: np.ndarray
    density: np.ndarray
    velocity: np.ndarray
    omega: np.ndarray
    frozen: np.ndarray

    def take(self, rows):
        """The grains of these rows."""
        return Grains(*(np.ascontiguousarray(column[rows]) for column in self))


class Constants(NamedTuple):
    """Constants of a contact law as LAMMPS' ``gran/hooke/history`` and ``gran/hertz/history`` take them.

    Attributes:
        kn, kt: stiffness [force/length]; with Hertz [force/length^2].
        gamma_n, gamma_t: damping [1/time]; with Hertz [1/(length time)].
        friction: coefficient.
    """

    kn: float
    kt: float
    gamma_n: float
    gamma_t: float
    friction: float


class Case(NamedTuple):
    """A benchmark.

    Attributes:
        name, title: how it is called, and what it is.
        grains: a ``Grains``.
        low, high: corners of the box [length]. periodic: along x, y, z; elsewhere the box is only wide enough.
        law: "hooke" or "hertz". constants: its ``Constants``.
        dt: time step [time]. gravity: [length/time^2].
        floor: height of a plane that carries the grains [length]; None: there is none.
        steps: of one timing. scan_steps: of one look at a skin. rounds: timings of each code.
        skins: to choose from, relative to the largest diameter, ascending.
        forced: True times one rebuild (steps that all rebuild less steps that never do) instead of one step.
    """

    name: str
    title: str
    grains: Grains
    low: tuple
    high: tuple
    periodic: tuple
    law: str
    constants: Constants
    dt: float
    gravity: tuple = (0.0, 0.0, 0.0)
    floor: float | None = None
    steps: int = 1000
    scan_steps: int = 500
    rounds: int = 7
    skins: tuple = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28)
    forced: bool = False

    @property
    def count(self):
        """How many grains there are."""
        return len(self.grains.radius)

    @property
    def diameter(self):
        """The largest diameter [length]."""
        return 2.0 * float(self.grains.radius.max())

    def first(self, count):
        """The same case with the first ``count`` grains that move: what a code needs before it has any work."""
        return self._replace(grains=self.grains.take(np.flatnonzero(~self.grains.frozen)[:count]))

    def save(self, folder):
        """Write it into a folder, as ``case.json`` and ``grains.npz``."""
        np.savez(Path(folder) / "grains.npz", **self.grains._asdict())
        values = self._asdict() | {"grains": None, "constants": self.constants._asdict()}
        (Path(folder) / "case.json").write_text(json.dumps(values), encoding="utf-8")

    @classmethod
    def load(cls, folder):
        """Read what ``save`` wrote."""
        values = json.loads((Path(folder) / "case.json").read_text(encoding="utf-8"))
        with np.load(Path(folder) / "grains.npz", allow_pickle=False) as saved:
            values["grains"] = Grains(**{name: saved[name] for name in saved.files})
        values["constants"] = Constants(**values["constants"])
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})
