"""An experiment run from beginning to end, perhaps with a stop: every file that it leaves."""

from barchan.checkpoint import restore, save


def run(experiment, given, directory, threads, stop=None):
    """Run it all, or from a checkpoint at a step on; the instruments write into ``directory``."""
    scene = experiment.scene.make(given)
    sim = experiment.build(scene, threads=threads)
    sim.writers = experiment.instruments(scene, directory)
    for stage in experiment.stages(scene):
        stage.begin(sim)
        if stop is not None and sim.step_number <= stop < stage.end:
            sim.run(stop - sim.step_number)
            save(sim, directory / "stop.h5")
            sim = experiment.build(scene, threads=threads, with_grains=False)
            restore(sim, directory / "stop.h5")
            sim.writers = experiment.instruments(scene, directory)
        sim.run(stage.end - sim.step_number)
    save(sim, directory / "end.h5")


def files(directory):
    """Name -> bytes of what was left, but for the state in which it was stopped."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file() and path.name != "stop.h5"
    }
