"""The commands ``barchan run ...``: one for each experiment, and one for a scene in a file."""

from collections import Counter
from datetime import datetime
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from barchan.errors import SceneError
from barchan.parallel import world
from barchan.report import Journal


class ExperimentOrFile(TyperGroup):
    """``run avalanche`` and ``run my.toml``: what ends in .toml goes to the command ``file``.

    The experiments are imported when one is asked for, since that takes half a second, which other commands need not wait.
    """

    def list_commands(self, ctx):
        """Their names."""
        self._add_experiments()
        return sorted(self.commands)

    def resolve_command(self, ctx, args):
        """The command that the arguments mean."""
        self._add_experiments()
        if args and args[0].endswith(".toml"):
            args = ["file", *args]
        return super().resolve_command(ctx, args)

    def _add_experiments(self):
        from barchan.experiments import EXPERIMENTS

        self.commands |= {name: _command(one) for name, one in EXPERIMENTS.items() if name not in self.commands}


run_app = typer.Typer(no_args_is_help=True, cls=ExperimentOrFile, help="Run an experiment, or a scene file: barchan run my.toml.")

Threads = Annotated[int | None, typer.Option(min=1, help="threads; default all cores; the result is the same")]
Out = Annotated[Path | None, typer.Option(help="directory of the run; default runs/<experiment>-<date>-<time>")]
Resume = Annotated[Path | None, typer.Option(help="continue the run in this directory; its scene is used")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="any parameter, with its unit: radius_max=1.12mm")
]
CheckpointEvery = Annotated[int, typer.Option(min=1, help="steps between checkpoints")]


@run_app.command()
def avalanche(
    grains: Annotated[str | None, typer.Option(help="about how many grains flow, in the same outline; default 7560")] = None,
    figure3: Annotated[bool, typer.Option("--figure3", help="the paper's Figure 3: 120,000 grains, 1.2 s; takes hours")] = False,
    angle: Annotated[str | None, typer.Option(help="of the floor after the release; default 31.2 deg")] = None,
    duration: Annotated[str | None, typer.Option(help="simulated time after the release; default 0.7 s")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="simulated time before the release; default 0.3 s")] = None,
    seed: Annotated[str | None, typer.Option(help="of the radii; default 1")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """A sand avalanche down an inclined plane (Walther & Sbalzarini 2009). Values may have units: --duration 600ms."""
    from barchan.experiments import EXPERIMENTS
    from barchan.experiments.avalanche.parameters import FIGURE_3

    experiment = EXPERIMENTS["avalanche"]
    given = {"angle": angle, "duration": duration, "equilibrate": equilibrate, "seed": seed}
    flags = [f"{name}={value}" for name, value in given.items() if value is not None]
    changes = _assignments(experiment, [*flags, *(set_ or [])])
    if resume is not None:
        refused = [name for name, there in (("--grains", grains), ("--figure3", figure3), ("--out", out)) if there]
        _resume(experiment, resume, changes, refused, _manner(threads, checkpoint_every))
        return
    scene = experiment.scene.make((FIGURE_3 if figure3 else {}) | changes)
    if grains is not None:
        if figure3 or "coarse_graining" in changes:
            raise SceneError("--grains sets coarse_graining; give only one of --grains, --figure3 and --set coarse_graining=...")
        scene = scene.with_grains(_whole_number("--grains", grains))
    _start(experiment, scene, out, _manner(threads, checkpoint_every))


@run_app.command(hidden=True)
def file(path: Path, threads: Threads = None, out: Out = None, set_: Set = None, checkpoint_every: CheckpointEvery = 5000):
    """Run the scene in a TOML file."""
    experiment, scene = read(path)
    scene = experiment.scene.make(scene.model_dump() | _assignments(experiment, set_ or []))
    _start(experiment, scene, out, _manner(threads, checkpoint_every))


def _command(experiment):
    """The command of an experiment all of whose flags are parameters, each with the help that its scene has for it."""

    def run(threads, out, resume, set_, checkpoint_every, **given):
        _run(experiment, given, set_, out, resume, _manner(threads, checkpoint_every))

    default = experiment.scene()
    options = {name: Annotated[str | None, typer.Option(help=default.help(name))] for name in experiment.flags}
    common = {"threads": Threads, "out": Out, "resume": Resume, "set_": Set}
    parameters = [Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=of) for name, of in (options | common).items()]
    every = Parameter("checkpoint_every", Parameter.KEYWORD_ONLY, default=experiment.checkpoint_every, annotation=CheckpointEvery)
    run.__signature__ = Signature([*parameters, every])
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in (*parameters, every)}
    app = typer.Typer(add_completion=False)
    example = next(name for name in experiment.flags if " " in default.readable(name))
    flag = f"--{example.replace('_', '-')} {default.readable(example).replace(' ', '')}"
    app.command(experiment.name, help=f"{experiment.title}.\n\nValues may have units, as in {flag}.")(run)
    return typer.main.get_command(app)


def _manner(threads, checkpoint_every):
    from barchan.experiments.session import Manner

    return Manner(threads, checkpoint_every)


def read(path):
    """Experiment and scene of a scene file."""
    from barchan.experiments import EXPERIMENTS
    from barchan.scene import read_scene_file

    name, scene = read_scene_file(path, {name: experiment.scene for name, experiment in EXPERIMENTS.items()})
    return EXPERIMENTS[name], scene


def _run(experiment, given, assignments, out, resume, manner):
    """Start or resume an experiment of which all flags are parameters."""
    flags = [f"{parameter}={value}" for parameter, value in given.items() if value is not None]
    changes = _assignments(experiment, [*flags, *(assignments or [])])
    if resume is not None:
        _resume(experiment, resume, changes, ["--out"] if out else [], manner)
    else:
        _start(experiment, experiment.scene.make(changes), out, manner)


def _assignments(experiment, texts):
    """Parameters from texts such as radius_max=1.12mm."""
    from barchan.scene import parse_assignment

    pairs = [parse_assignment(text, experiment.scene) for text in texts]
    twice = [name for name, count in Counter(name for name, _ in pairs).items() if count > 1]
    if twice:
        raise SceneError(f"{', '.join(twice)} is given twice; give each parameter once")
    return dict(pairs)


def _whole_number(flag, text):
    try:
        return int(text.replace(",", "").replace("_", ""))
    except ValueError:
        raise SceneError(f"{flag} = {text!r} must be a whole number") from None


def _start(experiment, scene, out, manner):
    from barchan.experiments import session

    out = out or world().from_first(Path("runs") / f"{experiment.name}-{datetime.now():%Y%m%d-%H%M%S}")
    session.start(experiment, scene, out, manner, Journal())


def _resume(experiment, directory, changes, refused, manner):
    """Continue a run; only parameters that extend it may change."""
    from barchan.experiments import session

    if not (directory / "scene.toml").is_file():
        raise SceneError(f"nothing to resume in {directory}: it holds no scene.toml")
    there, scene = read(directory / "scene.toml")
    if there is not experiment:
        raise SceneError(
            f"{directory} holds a run of '{there.name}'; resume it with: barchan run {there.name} --resume {directory}"
        )
    refused += [name for name in changes if name not in experiment.scene.extendable]
    if refused:
        raise SceneError(
            f"--resume continues the scene in {directory}; {', '.join(refused)} cannot be changed, only "
            f"{', '.join(experiment.scene.extendable)} can. Start a new run for another scene"
        )
    session.resume(experiment, experiment.scene.make(scene.model_dump() | changes), directory, manner, Journal())
