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


class Division(NamedTuple):
    """How a code that has to be told searches grains of very different sizes.

    Attributes:
        ends: radii at which a size class ends, the last class apart, ascending [length]; () is one class of all.
        cells: edge of the cells of the smallest class, relative to how far apart the centres of two of its grains may be that are
            listed; None: what the code takes by itself.
    """

    ends: tuple
    cells: float | None = None

    def __str__(self):
        ends = f"classes to {', '.join(f'{end:.3g}' for end in self.ends)}" if self.ends else "one class"
        return ends if self.cells is None else f"{ends}, cells {self.cells:g}"


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
        ends: to choose from, as ``Division`` has them, first a good one, with which codes start; () where sizes hardly differ.
        cells: the same, for codes that take them.
        scans: how often each division is timed.
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
    ends: tuple = ()
    cells: tuple = (0.5, 1.0, 1.5, 2.0, 3.0)
    scans: int = 2

    @property
    def count(self):
        """How many grains there are."""
        return len(self.grains.radius)

    @property
    def of(self):
        """What is timed: a "rebuild" or a "step"."""
        return "rebuild" if self.forced else "step"

    @property
    def diameter(self):
        """The largest diameter [length]."""
        return 2.0 * float(self.grains.radius.max())

    def divisions(self, peer):
        """What a ``Peer`` has to try: some ``Division``, or none."""
        if not peer.told:
            return ()
        return tuple(Division(ends, cells) for ends in self.ends for cells in (self.cells if peer.cells else (None,)))

    def first(self, count):
        """The same case with the ``count`` largest grains that move: what a code needs before it has any work. (Cells as small as
        small grains want would need more memory than these.)"""
        moving = np.flatnonzero(~self.grains.frozen)
        largest = moving[np.argsort(-self.grains.radius[moving], kind="stable")[:count]]
        return self._replace(grains=self.grains.take(largest))

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
        values["ends"] = [tuple(ends) for ends in values["ends"]]
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})
