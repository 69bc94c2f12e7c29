"""What an experiment is: the answers that a run in a directory asks for. Every ready scene gives one."""

from collections.abc import Callable
from typing import NamedTuple


class Stage(NamedTuple):
    """A part of an experiment. ``begin(sim)`` is called once, before its first step; ``end`` is the step at which it ends."""

    name: str
    end: int
    begin: Callable


class Check(NamedTuple):
    """Something that must hold for the results to mean anything."""

    name: str
    measured: str
    allowed: str
    passed: bool


class Results(NamedTuple):
    """What an experiment has shown.

    ``values``: (name, value with unit) lines. ``differs``: (parameter, value here, value in the paper). ``checks``: list of
    ``Check``.
    """

    values: list
    differs: list
    checks: list


class Experiment(NamedTuple):
    """A ready scene.

    Attributes:
        name: on the command line.
        title: one line.
        scene: its ``Scene`` class, the parameters.
        build: function (scene, threads, with_grains) -> Simulation.
        stages: function (scene) -> list of ``Stage``.
        instruments: function (scene, directory) -> writers that measure while it runs.
        results: function (scene, directory) -> ``Results``, from what was stored.
        figures: function (scene, directory) -> paths of pictures, from what was stored.
        flags: parameters that the command line has flags for.
        checkpoint_every: steps between checkpoints, unless told.
    """

    name: str
    title: str
    scene: type
    build: Callable
    stages: Callable
    instruments: Callable
    results: Callable
    figures: Callable
    flags: tuple = ()
    checkpoint_every: int = 5000
