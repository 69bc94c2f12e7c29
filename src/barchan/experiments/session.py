"""Runs an experiment in a directory: scene first, progress, checkpoints, summary, and resume."""

from barchan.checkpoint import Checkpoints
from barchan.errors import SceneError
from barchan.experiments import avalanche
from barchan.report import ProgressLine, summary
from barchan.rundir import RunDirectory
from barchan.triggers import Every
from barchan.warmup import compile_law


def run_avalanche(scene, path, threads, checkpoint_every, say):
    """Start the avalanche ``scene`` in the directory ``path``, or continue the one that is there.

    Args:
        scene: an ``Avalanche``, or None to continue with the scene of the directory.
        say: function that shows a line of text to the user.

    Raises:
        SceneError: the directory is in use, holds another scene, or holds none to continue.
    """
    if scene is None and not (path / "scene.json").is_file():
        raise SceneError(f"nothing to resume in {path}: it holds no scene.json")
    directory = RunDirectory(path)
    resumed = scene is None
    scene = avalanche.Avalanche.read(directory.scene_file) if resumed else scene
    if not resumed and any(directory.checkpoints.glob("checkpoint_*.h5")):
        raise SceneError(f"run directory {path} already holds a run. Use --resume {path} to continue it, or choose another --out")
    directory.claim(scene)
    sim = avalanche.build(scene, threads, with_grains=False)
    compile_law(sim.law, sim.materials.list, say)
    found, complaints = directory.resume(sim) if resumed else (False, [])
    for complaint in complaints:
        say(f"warning: {complaint}")
    if not found:
        sim = avalanche.build(scene, threads)
    if sim.notes.setdefault("scene", scene.model_dump()) != scene.model_dump():
        raise SceneError(f"{directory.scene_file} was changed since the run began; its checkpoints belong to the scene as it was")
    say(f"{'resuming' if found else 'starting'} in {path}: {sim.grains.n:,} grains, step {sim.step_number:,}")
    checkpoints = Checkpoints(directory.checkpoints, Every(checkpoint_every))
    sim.writers = [checkpoints]
    avalanche.run(sim, scene, lambda phase, steps: [ProgressLine(phase, steps)])
    checkpoints.write(sim)
    for line in summary(sim):
        say(line)
    directory.release()
    return sim
