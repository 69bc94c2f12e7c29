"""The command ``barchan``."""

import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from barchan.errors import BarchanError, Interrupted, SceneError
from barchan.parallel import Serial, world
from barchan.report import Journal
from barchan.run_commands import Threads, read, run_app

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Granular flow and bonded grains, from a laptop to a cluster.",
)
app.add_typer(run_app, name="run")


@app.command()
def check(path: Path):
    """Check a scene file, and say how large its run is; nothing is written. Exit code 2 if it cannot run."""
    from barchan.experiments.session import counted, prepared

    experiment, scene = read(path)
    sim = prepared(experiment, scene, None, Journal())
    stable = "" if sim.stable_dt is None else f" (stable: {sim.stable_dt:.4g} s)"  # bender looks at it by itself
    steps = f"{experiment.stages(scene)[-1].end:,} steps of {sim.dt:.4g} s{stable}"
    typer.echo(f"{path} is sound: {experiment.name}, {counted(sim)}, {steps}")


@app.command()
def show(directory: Path):
    """Print the summary of a run and draw its figures again, from its stored data."""
    from barchan.experiments import summary

    experiment, scene = read(directory / "scene.toml")
    summary.show(experiment, scene, directory, Journal(stream=sys.stdout))


@app.command("list")
def list_():
    """List the experiments and the contact laws."""
    from barchan.experiments import EXPERIMENTS
    from barchan.laws import SHIPPED
    from barchan.report import table

    typer.echo("experiments (barchan run NAME):")
    typer.echo("\n".join(table([(name, experiment.title) for name, experiment in EXPERIMENTS.items()])))
    typer.echo("contact laws (barchan.laws.NAME):")
    typer.echo("\n".join(table([(name, (law.__doc__ or "").strip().splitlines()[0]) for name, law in SHIPPED.items()])))


@app.command()
def selftest(threads: Threads = None):
    """Check physics and bits on this machine: two minutes. Exit code 3 if a check fails."""
    from barchan import selftest as checks

    if not checks.run(typer.echo, threads):
        raise typer.Exit(3)


_BENCHES = "chute, dense, dense-1m, dense-2x30000, avalanche, rebuild, gas, small"
_SIZES = "bidisperse-10 (-20, -40), dunkirk-10 (-20, -40), exponential-50, flat-100"


@app.command()
def bench(
    name: Annotated[str, typer.Argument(help=f"{_BENCHES}, size-classes", metavar="CASE")],
    case: Annotated[str | None, typer.Option(help=f"of size-classes: {_SIZES}")] = None,
    threads: Annotated[int, typer.Option(min=1, help="threads of barchan and of LAMMPS' OPENMP package")] = 1,
    ranks: Annotated[int, typer.Option(min=1, help="MPI ranks of barchan and of LAMMPS")] = 2,
    json: Annotated[
        Path | None, typer.Option(help="file for the result; default runs/bench/<case>.json; a figure beside it")
    ] = None,
):
    """Time barchan beside other DEM codes found on this machine, in turns: minutes, the cases of 1,000,000 grains longer."""
    from barchan.bench import benchmark, results

    if (name == "size-classes") != (case is not None):
        raise SceneError(f"barchan bench {name}: --case goes with size-classes: barchan bench size-classes --case bidisperse-10")
    case = case or name
    signal.signal(signal.SIGTERM, _interrupted)  # no code of the benchmark shall outlive it
    path = json or Path("runs") / "bench" / f"{case}.json"
    results.check_path(path)
    result = benchmark.run(case, threads, ranks, Journal())
    typer.echo("\n".join(results.lines(result)))
    typer.echo(f"  written: {', '.join(map(str, [path, *results.write(result, path)]))}")


@app.command()
def scaling(
    grains: Annotated[int, typer.Option(min=100, help="of each process, about")] = 30_000,
    threads: Annotated[int, typer.Option(min=1, help="of each process")] = 1,
    steps: Annotated[int | None, typer.Option(min=1, help="of one timing; default about two seconds")] = None,
    sync: Annotated[bool, typer.Option("--sync", help="let processes wait for each other after each timed phase")] = False,
):
    """Measure how well processes share a dense bed: mpiexec -n 2 barchan scaling. A minute for small beds."""
    from barchan.bench import scaling as study

    result = study.measure(world(), grains, threads, steps, sync, Journal())
    typer.echo("\n".join(study.lines(result)))


@app.command()
def diff(first: Path, second: Path):
    """Compare the last states of two runs or checkpoint files; exit 0 only if all saved bits are the same."""
    from barchan.compare import differences, last_state

    lines = differences(last_state(first), last_state(second))
    for line in lines:
        typer.echo(line)
    if lines:
        raise typer.Exit(1)
    typer.echo("identical")


@app.command()
def compile():
    """Compile the loops of all laws now, so that no later start has to wait."""
    from barchan.warmup import compile_shipped

    compile_shipped(Journal().compiling)


@app.command()
def version():
    """Print the version."""
    from barchan.version import VERSION

    typer.echo(VERSION)


def main():
    """Run the command; an expected error is one clear line and an exit code (2: bad input, 3: a failed run, 130: stopped)."""
    signal.signal(signal.SIGINT, _interrupted)
    comm = Serial()
    try:
        comm = world()
        if comm.rank:  # the first rank speaks for all
            sys.stdout = sys.stderr = open(os.devnull, "w")
        app()
    except BarchanError as error:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # an impatient user shall still read why it ended
        comm.end(error, lambda error=error: typer.echo(f"barchan: {error}", err=True))
        sys.exit(error.exit_code)
    except OSError as error:  # of a path that a user gave: too long, not to be entered, a directory where a file should be
        comm.end(error, lambda error=error: typer.echo(f"barchan: {error.filename}: {error.strerror}", err=True))
        sys.exit(2)


def _interrupted(number, frame):
    """Ctrl-C where no run is under way: before its first step, or while figures are drawn. An error, so that of several processes
    all learn of it."""
    raise Interrupted("interrupted; what was written is whole (barchan show DIR draws the figures of a finished run)")
