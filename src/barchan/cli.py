"""The command ``barchan``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from barchan.errors import BarchanError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Granular flow and bonded grains, from a laptop to a cluster.",
)
run_app = typer.Typer(no_args_is_help=True, help="Run an experiment.")
app.add_typer(run_app, name="run")


def _say(text):
    """A line for the user. On a terminal, lines of compilation replace each other."""
    passing = sys.stderr.isatty() and "compiling" in text
    typer.echo(("\r\x1b[K" if sys.stderr.isatty() else "") + text, err=True, nl=not passing)


@run_app.command()
def avalanche(
    grains: Annotated[int, typer.Option(help="grains that flow, about")] = 5000,
    angle: Annotated[float, typer.Option(help="of the floor after the release [degrees]")] = 31.2,
    duration: Annotated[float, typer.Option(help="simulated time after the release [s]")] = 0.2,
    equilibrate: Annotated[float, typer.Option(help="simulated time before the release [s]")] = 0.05,
    seed: Annotated[int, typer.Option(help="of the radii")] = 1,
    threads: Annotated[int | None, typer.Option(help="threads; default all cores; the result is the same")] = None,
    out: Annotated[Path, typer.Option(help="directory of the run")] = Path("runs/avalanche"),
    resume: Annotated[Path | None, typer.Option(help="continue the run in this directory; its scene is used")] = None,
    checkpoint_every: Annotated[int, typer.Option(min=1, help="steps between checkpoints")] = 5000,
):
    """A sand avalanche down an inclined plane (Walther & Sbalzarini 2009)."""
    from barchan.experiments.avalanche import Avalanche
    from barchan.experiments.session import run_avalanche

    if resume is not None:
        run_avalanche(None, resume, threads, checkpoint_every, _say)
    else:
        scene = Avalanche.make({"grains": grains, "angle": angle, "duration": duration, "equilibrate": equilibrate, "seed": seed})
        run_avalanche(scene, out, threads, checkpoint_every, _say)


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

    compile_shipped(_say)


@app.command()
def version():
    """Print the version."""
    from barchan.version import VERSION

    typer.echo(VERSION)


def main():
    """Run the command; an expected error is one clear line and an exit code (2: bad input, 3: a failed run)."""
    try:
        app()
    except BarchanError as error:
        typer.echo(f"barchan: {error}", err=True)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        typer.echo("barchan: interrupted; continue with --resume", err=True)
        sys.exit(130)


if __name__ == "__main__":
    main()
