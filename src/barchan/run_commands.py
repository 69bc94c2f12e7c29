"""The commands ``barchan run ...``: one for each experiment, and one for a scene in a file."""

from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from barchan.errors import SceneError
from barchan.parallel import world
from barchan.report import Journal


class ExperimentOrFile(TyperGroup):
    """``run avalanche`` and ``run my.toml``: what ends in .toml goes to the command ``file``."""

    def resolve_command(self, ctx, args):
        """The command that the arguments mean."""
        if args and args[0].endswith(".toml"):
            args = ["file", *args]
        return super().resolve_command(ctx, args)


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
    grains: Annotated[str | None, typer.Option(help="about how many grains flow, in the same outline [7560]")] = None,
    figure3: Annotated[bool, typer.Option("--figure3", help="the paper's Figure 3: 120,000 grains, 1.2 s; takes hours")] = False,
    angle: Annotated[str | None, typer.Option(help="of the floor after the release [31.2 deg]")] = None,
    duration: Annotated[str | None, typer.Option(help="simulated time after the release [0.7 s]")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="simulated time before the release [0.3 s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of the radii [1]")] = None,
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


@run_app.command()
def bender(
    packing: Annotated[str | None, typer.Option(help="random, which is pressed, or fcc, a crystal [random]")] = None,
    across: Annotated[str | None, typer.Option(help="width of the sample in mean diameters [8]")] = None,
    along: Annotated[str | None, typer.Option(help="its length in mean diameters [120]")] = None,
    pressure: Annotated[str | None, typer.Option(help="stress on the sample [100 kPa]")] = None,
    shear_frequency: Annotated[str | None, typer.Option(help="of the pulse of shear [20 kHz]")] = None,
    compression_frequency: Annotated[str | None, typer.Option(help="of the pulse of compression [27 kHz]")] = None,
    sweep: Annotated[str | None, typer.Option(help="number of frequencies, each 1.25 times that before [1]")] = None,
    patch: Annotated[str | None, typer.Option(help="diameter of the patch that is shaken; 0: all of the section [0 mm]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """Waves through a sample, as of bender elements (Marketos et al. 2013). Values may have units: --shear-frequency 15kHz."""
    given = {"packing": packing, "across": across, "along": along, "pressure": pressure}
    given |= {"shear_frequency": shear_frequency, "compression_frequency": compression_frequency}
    given |= {"sweep": sweep, "patch": patch, "seed": seed}
    _run("bender", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def bond(
    radius: Annotated[str | None, typer.Option(help="of the grains [0.5 m]")] = None,
    radius_factor: Annotated[str | None, typer.Option(help="radius of the bond, relative to that of the grains [1]")] = None,
    tensile_strength: Annotated[str | None, typer.Option(help="stress at which the bond breaks in tension [29.995 MPa]")] = None,
    shear_strength: Annotated[str | None, typer.Option(help="at which it breaks in shear and torsion [39.998 MPa]")] = None,
    increment: Annotated[str | None, typer.Option(help="way of a step [1 um]")] = None,
    steps: Annotated[str | None, typer.Option(help="number of steps [12000]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """Two bonded grains, pulled, sheared, spun until the bond breaks (Marketos 2013). Values may have units: --increment 1um."""
    given = {"radius": radius, "radius_factor": radius_factor, "tensile_strength": tensile_strength}
    given |= {"shear_strength": shear_strength, "increment": increment, "steps": steps}
    _run("bond", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def column(
    columns: Annotated[str | None, typer.Option(help="number of columns, each with an aspect ratio of its own [3]")] = None,
    aspect_min: Annotated[str | None, typer.Option(help="smallest ratio of height to radius [0.6]")] = None,
    aspect_max: Annotated[str | None, typer.Option(help="largest ratio of height to radius [2.4]")] = None,
    column_radius: Annotated[str | None, typer.Option(help="radius of the columns [60 mm]")] = None,
    friction: Annotated[str | None, typer.Option(help="between grains, and at the floor [0.3]")] = None,
    duration: Annotated[str | None, typer.Option(help="simulated time after the release [0.75 s]")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="simulated time before the release [0.36 s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """The collapse of columns of several aspect ratios (Lube et al. 2004). Values may have units: --column-radius 5cm."""
    given = {"columns": columns, "aspect_min": aspect_min, "aspect_max": aspect_max, "column_radius": column_radius}
    given |= {"friction": friction, "duration": duration, "equilibrate": equilibrate, "seed": seed}
    _run("column", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def compression(
    grains: Annotated[str | None, typer.Option(help="about how many grains rain [3000]")] = None,
    stress_rate: Annotated[str | None, typer.Option(help="rate at which the stress grows [2e6 Pa/s]")] = None,
    end_stress: Annotated[str | None, typer.Option(help="stress on all walls at the end [100 kPa]")] = None,
    dt: Annotated[str | None, typer.Option(help="time step [1.8 us]")] = None,
    controller: Annotated[str | None, typer.Option(help="servo, which finds its gain, or proportional [servo]")] = None,
    gain: Annotated[str | None, typer.Option(help="of the proportional controller [0.01 m/N/s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and first velocities [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 20_000,
):
    """A sample under six stress-controlled walls (Marketos et al. 2013). Values may have units: --end-stress 50kPa."""
    given = {"grains": grains, "stress_rate": stress_rate, "end_stress": end_stress, "dt": dt}
    given |= {"controller": controller, "gain": gain, "seed": seed}
    _run("compression", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def drum(
    grains: Annotated[str | None, typer.Option(help="number of grains [3000]")] = None,
    drum_radius: Annotated[str | None, typer.Option(help="inner radius of the drum [69 mm]")] = None,
    length: Annotated[str | None, typer.Option(help="of the drum, between its ends [92.5 mm]")] = None,
    ends: Annotated[str | None, typer.Option(help="plates, that turn with it, or periodic [plates]")] = None,
    rotation: Annotated[str | None, typer.Option(help="angular velocity, in radians [2.198 1/s]")] = None,
    friction: Annotated[str | None, typer.Option(help="between grains [0.3]")] = None,
    duration: Annotated[str | None, typer.Option(help="time of turning [5 s]")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="time before the drum turns [0.3 s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 20_000,
):
    """A turning drum: angle of the surface, flowing layer, mixing, torque, power. Values may have units: --length 10cm."""
    given = {"grains": grains, "drum_radius": drum_radius, "length": length, "ends": ends, "rotation": rotation}
    given |= {"friction": friction, "duration": duration, "equilibrate": equilibrate, "seed": seed}
    _run("drum", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def oedometer(
    grains: Annotated[str | None, typer.Option(help="about how many grains rain [3000]")] = None,
    stress_rate: Annotated[str | None, typer.Option(help="rate at which the stress grows and is taken back [1.5e6 Pa/s]")] = None,
    max_stress: Annotated[str | None, typer.Option(help="largest stress on the top [120 kPa]")] = None,
    end_stress: Annotated[str | None, typer.Option(help="stress on the top after unloading [20 kPa]")] = None,
    wall_friction: Annotated[str | None, typer.Option(help="friction coefficient of walls [0]")] = None,
    dt: Annotated[str | None, typer.Option(help="time step [2 us]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and first velocities [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 20_000,
):
    """One-dimensional compression in an oedometer, with unloading. Values may have units: --max-stress 100kPa."""
    given = {"grains": grains, "stress_rate": stress_rate, "max_stress": max_stress, "end_stress": end_stress}
    given |= {"wall_friction": wall_friction, "dt": dt, "seed": seed}
    _run("oedometer", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def repose(
    method: Annotated[str | None, typer.Option(help="what is lifted, cylinder or plate [cylinder]")] = None,
    grains: Annotated[str | None, typer.Option(help="number of grains [3000]")] = None,
    friction: Annotated[str | None, typer.Option(help="between grains [0.5]")] = None,
    lift_speed: Annotated[str | None, typer.Option(help="of cylinder or plate [0.05 m/s]")] = None,
    duration: Annotated[str | None, typer.Option(help="simulated time after the lift [0.3 s]")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="simulated time before the lift [0.4 s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """The angle of repose, by lifting a cylinder or a plate from around grains. Values may have units: --lift-speed 2cm/s."""
    given = {"method": method, "grains": grains, "friction": friction, "lift_speed": lift_speed}
    given |= {"duration": duration, "equilibrate": equilibrate, "seed": seed}
    _run("repose", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def rock(
    test: Annotated[str | None, typer.Option(help="compression, tension, brazilian, or all side by side [all]")] = None,
    grains: Annotated[str | None, typer.Option(help="of the block from which specimens are cut [3600]")] = None,
    modulus: Annotated[str | None, typer.Option(help="Young's modulus of the bonds [15 GPa]")] = None,
    tensile_strength: Annotated[str | None, typer.Option(help="of the bonds, the mean [15 MPa]")] = None,
    shear_strength: Annotated[str | None, typer.Option(help="of the bonds, the mean [45 MPa]")] = None,
    duration: Annotated[str | None, typer.Option(help="time of loading [2 ms]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii, places and strengths [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """A bonded rock in compression, in tension and as a Brazilian disc. Values may have units: --tensile-strength 8MPa."""
    given = {"test": test, "grains": grains, "modulus": modulus, "tensile_strength": tensile_strength}
    given |= {"shear_strength": shear_strength, "duration": duration, "seed": seed}
    _run("rock", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def shear(
    grains: Annotated[str | None, typer.Option(help="number of grains [1500]")] = None,
    pressure: Annotated[str | None, typer.Option(help="normal stress along the gradient [1 kPa]")] = None,
    friction: Annotated[str | None, typer.Option(help="between grains [0.5]")] = None,
    restitution: Annotated[str | None, typer.Option(help="of normal impacts [0.7]")] = None,
    inertial_number: Annotated[str | None, typer.Option(help="of the first stage [0.3]")] = None,
    rates: Annotated[str | None, typer.Option(help="number of stages, each half as fast as the one before [6]")] = None,
    strain: Annotated[str | None, typer.Option(help="over which each stage is averaged [1.5]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 20_000,
):
    """Simple shear in a periodic box: friction and solid fraction over the inertial number. Values may have units."""
    given = {"grains": grains, "pressure": pressure, "friction": friction, "restitution": restitution}
    given |= {"inertial_number": inertial_number, "rates": rates, "strain": strain, "seed": seed}
    _run("shear", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command()
def silo(
    grains: Annotated[str | None, typer.Option(help="number of grains in each silo [7000]")] = None,
    outlets: Annotated[str | None, typer.Option(help="number of silos, each with an outlet of its own [4]")] = None,
    outlet_min: Annotated[str | None, typer.Option(help="diameter of the smallest outlet [25 mm]")] = None,
    outlet_max: Annotated[str | None, typer.Option(help="diameter of the largest outlet [40 mm]")] = None,
    silo_diameter: Annotated[str | None, typer.Option(help="inner diameter of the silos [80 mm]")] = None,
    friction: Annotated[str | None, typer.Option(help="between grains [0.2]")] = None,
    duration: Annotated[str | None, typer.Option(help="simulated time after the opening [0.9 s]")] = None,
    equilibrate: Annotated[str | None, typer.Option(help="simulated time to come to rest in [0.36 s]")] = None,
    seed: Annotated[str | None, typer.Option(help="of radii and places [1]")] = None,
    threads: Threads = None,
    out: Out = None,
    resume: Resume = None,
    set_: Set = None,
    checkpoint_every: CheckpointEvery = 5000,
):
    """Discharge of silos through outlets of several diameters (Beverloo 1961). Values may have units: --outlet-max 4cm."""
    given = {"grains": grains, "outlets": outlets, "outlet_min": outlet_min, "outlet_max": outlet_max}
    given |= {"silo_diameter": silo_diameter, "friction": friction, "duration": duration}
    given |= {"equilibrate": equilibrate, "seed": seed}
    _run("silo", given, set_, out, resume, _manner(threads, checkpoint_every))


@run_app.command(hidden=True)
def file(path: Path, threads: Threads = None, out: Out = None, set_: Set = None, checkpoint_every: CheckpointEvery = 5000):
    """Run the scene in a TOML file."""
    experiment, scene = read(path)
    scene = experiment.scene.make(scene.model_dump() | _assignments(experiment, set_ or []))
    _start(experiment, scene, out, _manner(threads, checkpoint_every))


def _manner(threads, checkpoint_every):
    from barchan.experiments.session import Manner

    return Manner(threads, checkpoint_every)


def read(path):
    """Experiment and scene of a scene file."""
    from barchan.experiments import EXPERIMENTS
    from barchan.scene import read_scene_file

    name, scene = read_scene_file(path, {name: experiment.scene for name, experiment in EXPERIMENTS.items()})
    return EXPERIMENTS[name], scene


def _run(name, given, assignments, out, resume, manner):
    """Start or resume an experiment of which all flags are parameters."""
    from barchan.experiments import EXPERIMENTS

    experiment = EXPERIMENTS[name]
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
