"""Runs an experiment in a directory: checks first, then scene, progress, checkpoints, summary; and resumes it."""

import os
import shlex
import signal
import time
import warnings
from contextlib import contextmanager
from typing import NamedTuple

from barchan import record
from barchan.checkpoint import Checkpoints, save
from barchan.errors import BarchanError, Interrupted, RunError, SceneError
from barchan.experiments import summary
from barchan.parallel.guard import first_on_node, on_first_rank, told_as
from barchan.report import ProgressLine
from barchan.rundir import RunDirectory
from barchan.triggers import Every
from barchan.warmup import compile_scene
from barchan.writers import read_table


class Manner(NamedTuple):
    """How to run, whatever is run: it changes no result."""

    threads: int | None
    checkpoint_every: int


def start(experiment, scene, path, manner, journal):
    """Run ``scene`` in the directory ``path``, from its beginning.

    Everything is checked before the directory is made.

    Raises:
        SceneError: the scene cannot be run, or the directory is in use or holds a run.
        RunError: the run had to stop; its last state is saved.
        Interrupted: a signal ended it; it can be resumed.
    """
    sim = prepared(experiment, scene, manner.threads, journal)
    directory = RunDirectory(path, sim.comm)
    try:
        if directory.is_foreign:
            raise SceneError(f"{path} holds other files, and no run; choose an empty directory, or a new one, with --out")
        if directory.has_checkpoints:
            raise SceneError(
                f"run directory {path} already holds a run. Use --resume {path} to continue it, or choose another --out"
            )
        directory.claim(experiment.name, scene, record.versions())
        journal.keep(directory.path / "log.txt")
        _tell_of_cores(sim, journal)
        journal.say(f"starting in {path}: {counted(sim)}, {experiment.stages(scene)[-1].end:,} steps")
        _run(experiment, scene, sim, directory, manner, journal)
    finally:
        directory.release()


def resume(experiment, scene, path, manner, journal):
    """Continue the run in the directory ``path``; ``scene`` is the one it holds, perhaps with a later end.

    Raises:
        what ``start`` raises.
    """
    directory = RunDirectory(path)
    try:
        journal.keep(directory.path / "log.txt")
        sim = experiment.build(scene, manner.threads, with_grains=False)
        first_on_node(sim.comm, lambda: compile_scene(sim, journal.compiling))
        directory.sweep()
        found, complaints = directory.resume(sim)
        for complaint in complaints:
            journal.say(f"warning: {complaint}")
        if complaints and not found:
            raise SceneError(
                f"no checkpoint in {path} is sound; remove {directory.checkpoints} to start again from the beginning"
            )
        if not found:
            journal.say(f"no checkpoint yet in {path}: starting again")
            sim = prepared(experiment, scene, manner.threads, journal)
        _check_same(scene, sim, directory)
        on_first_rank(sim.comm, lambda: _read_tables(directory.path))
        if sim.step_number >= experiment.stages(scene)[-1].end:
            longer = " or ".join(f"--set {name}=..." for name in scene.extendable)
            journal.say(f"the run in {path} is finished, at step {sim.step_number:,}; give a longer {longer} to continue it")
        else:
            directory.rewrite(experiment.name, scene, record.versions())
            _tell_of_cores(sim, journal)
            journal.say(f"resuming in {path}: {counted(sim)}, step {sim.step_number:,}")
            _run(experiment, scene, sim, directory, manner, journal)
    finally:
        directory.release()


def prepared(experiment, scene, threads, journal):
    """The simulation at its start, compiled and checked: nothing was written."""
    sim = experiment.build(scene, threads, with_grains=True)
    first_on_node(sim.comm, lambda: compile_scene(sim, journal.compiling))
    sim.prepare()
    return sim


def _read_tables(path):
    """A damaged table is named before the first step, not after the last."""
    for table in sorted((path / "tables").glob("*.csv")):
        read_table(table)


def counted(sim):
    """How many grains there are, for a person."""
    immobile = int((sim.grains.view("frozen") == 1).sum())
    immobile, count = sim.comm.sum([immobile, sim.grains.n]).tolist()
    on = f" on {sim.comm.size} processes" if sim.comm.size > 1 else ""
    return f"{count - immobile:,} grains that move, {immobile:,} immobile ones{on}"


def _tell_of_cores(sim, journal):
    """More threads than cores only get in each other's way."""
    wanted, cores = sim.comm.ranks_on_node * sim.threads, os.cpu_count() or 1
    if wanted > cores:
        journal.say(
            f"warning: {sim.comm.ranks_on_node} processes of {sim.threads} thread(s) share {cores} cores; fewer would be faster"
        )


def _check_same(scene, sim, directory):
    """Refuse a scene that is not the one the checkpoint was made with; only its end may be later."""
    then = sim.notes.get("scene", scene.fixed_part())
    changed = [name for name, value in scene.fixed_part().items() if then.get(name) != value]
    if changed:
        raise SceneError(
            f"{directory.scene_file} was changed since the run began ({', '.join(changed)}); its checkpoints belong to the scene "
            f"as it was"
        )


def _run(experiment, scene, sim, directory, manner, journal):
    """What is left of the stages, with everything that watches them."""
    stages = experiment.stages(scene)
    sim.notes["scene"] = scene.fixed_part()
    checkpoints = Checkpoints(directory.checkpoints, Every(manner.checkpoint_every))
    progress = ProgressLine([(stage.name, stage.end) for stage in stages], sim.step_number, journal)
    sim.writers = [*experiment.instruments(scene, directory.path), checkpoints, progress]
    sitting = record.Sitting(sim)
    with stopped_by_signals(sim), told_warnings(journal):
        try:
            _stages(stages, sim, sitting)
            checkpoints.write(sim)
        except Interrupted as stop:
            checkpoints.write(sim)
            text = f"{stop}; continue with: barchan run {experiment.name} --resume {shlex.quote(str(directory.path))}"
            journal.note(text)
            raise Interrupted(text) from None
        except RunError as error:
            all_know = sim.comm.size == 1 or getattr(error, "told_by", None) is not None
            text = f"{error}. {_last_state(sim, directory)}" if all_know else str(error)
            journal.note(text)
            raise told_as(type(error)(text), error) from None
        finally:
            progress.close()
            if sim.comm.rank == 0:
                _keep_record(directory, sitting.account(sim), journal)
    on_first_rank(sim.comm, lambda: summary.show(experiment, scene, directory.path, journal))


def _keep_record(directory, account, journal):
    """Add to the record; that it cannot be written must not hide why a run has ended."""
    try:
        record.add(directory.record, account)
    except OSError as error:
        journal.say(f"warning: {directory.record} cannot be written: {error.strerror}")


def _stages(stages, sim, sitting):
    for number, stage in enumerate(stages):
        if sim.notes.get("stage", -1) < number:
            stage.begin(sim)
            sim.notes["stage"] = number
        began = time.monotonic()
        try:
            sim.run(max(stage.end - sim.step_number, 0))
            sitting.count(sim)
        finally:
            sitting.stage(stage.name, time.monotonic() - began)


def _last_state(sim, directory):
    """Save the state in which a run failed, for a look; it is no checkpoint to resume from."""
    path = directory.path / "last_state.h5"
    try:
        with warnings.catch_warnings():  # that a step was broken off is known
            warnings.simplefilter("ignore")
            save(sim, path)
    except BarchanError as error:
        return f"Its last state could not be saved: {error}"
    return f"Its last state is in {path}; the last checkpoint is untouched"


@contextmanager
def told_warnings(journal):
    """Warnings of the library become lines for the user and the log."""
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = lambda message, *where, **more: journal.say(f"warning: {message}")
        yield


@contextmanager
def stopped_by_signals(sim):
    """Ctrl-C, or a batch system's SIGTERM, ends the run after the step at hand; more of them change nothing."""

    asked = []

    def stop(number, frame):
        sim.stop_requested = True
        asked.append(number)

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number in before:
            signal.signal(number, stop)
        yield
    finally:
        for number, handler in before.items():  # once asked, the program is about to end and shall say so
            signal.signal(number, signal.SIG_IGN if asked else handler)
